"""A simulated instrument: the same seed gives the same readings, and it behaves on a bench beside others."""

from dataclasses import replace

import numpy as np

from bench.i18n.errors import InputError
from bench.motor.motor_file import load_motor
from bench.plugins.catalogues import Catalogues, installed
from bench.testing.conformance.driver import subject_of
from bench.testing.conformance.report import Checks, ConformanceReport
from bench.testing.conformance.session import session_of
from bench.testing.conformance.stand import DriverUnderTest, motor_for, stand
from drivers.catalogue import Driver
from drivers.interfaces import Role
from sim_instruments.bench import VirtualBench
from sim_instruments.catalogue import FIXTURE, Options, SimulatedInstrument, SimulatedUnit
from sim_instruments.faults.line_faults import Faults

_TRANSPORTS = ("visa", "modbus", "serial", "can", "can-fd")


def check_simulated_instrument(
    simulated: SimulatedInstrument | str,
    *,
    station: Options | None = None,
    driver: Driver | str | None = None,
    options: object = None,
    catalogues: Catalogues | None = None,
) -> ConformanceReport:
    """Check a simulated instrument, itself or by its name; with a `driver` (and its `options`) before it, likewise, also its readings.

    `station` is what a station file says of it.

    Raises InputError for one that is not there, and a driver that is none.
    """
    catalogues = catalogues or installed()
    if isinstance(simulated, str):
        simulated = catalogues.simulated_instruments.need(simulated, lambda why: InputError(why))
    checks = Checks()
    known = simulated.role in {role.value for role in Role}
    checks.that("role", known, simulated.role, "Take one of the roles of drivers.interfaces.Role")
    checks.that("transport", simulated.transport in _TRANSPORTS, simulated.transport, f"Take one of {_TRANSPORTS}")
    ratings = dict(simulated.ratings(station or {}))
    positive = all(value > 0.0 and name.startswith("maximum_") for name, value in ratings.items())
    checks.that("ratings", positive, f"{ratings}", "Give maximum_voltage and the like, SI, positive")
    _check_alone(SimulatedUnit(simulated, options=station or {}), checks)
    if driver is not None:
        subject = subject_of(driver, Role(simulated.role), options, catalogues, simulated)
        _check_readings(replace(subject, station=station or {}), checks)
    return checks.report(f"{simulated.name} (simulated instrument)")


def _check_alone(unit: SimulatedUnit, checks: Checks) -> None:
    simulated = unit.kind
    motor, six_step = motor_for(Role(simulated.role), np.random.default_rng(0))
    with VirtualBench(motor, [unit], sockets=False, six_step=six_step, fixture=simulated.role in FIXTURE) as bench:
        before = bench.world.truth()
        bench.instrument(simulated.role)
        remedy = "Give it `faults`, a Faults()"
        checks.that("has faults", isinstance(bench.faults(simulated.role), Faults), "none", remedy)
        remedy = "Give it `connection`, a Connection()"
        checks.that("has a cable", bench.connection(simulated.role).up, "it is out", remedy)
        checks.that("has an address", bool(bench.address(simulated.role)), "none", "Compare its transport")
        after = bench.world.truth()
        remedy = "Begin as after switching on at the mains"
        checks.that("off when it is made", not after["energised"], "it is on", remedy)
        remedy = "That is the hands' work"
        checks.that("leaves the world alone", before["wiring"] == after["wiring"], "it rewires", remedy)
        bench.clock.sleep(1.0)
        checks.that("off after a while", not bench.world.truth()["energised"], "it is on", "Wait for a command")
    if simulated.transport == "visa":
        units = [unit, replace(unit, name="second")]
        with VirtualBench(load_motor("lg-400w").virtual_motor(), units, sockets=False, fixture=True) as bench:
            replies = []
            for name in bench.roles:
                bench.instrument(name).write(b"*IDN?\n")
                replies.append(bench.instrument(name).read(200, 1.0)[0])
            right, remedy = all(reply.endswith(b"\n") and len(reply) > 4 for reply in replies), "Answer it"
            checks.that("*IDN?", right, f"{replies}", remedy)


def _check_readings(subject: DriverUnderTest, checks: Checks) -> None:
    """Check that the same seed gives the same dialogue, to the last digit."""
    session, dialogues = session_of(subject.role), []
    for _ in range(2):
        traffic: list[tuple[str, str]] = []
        with stand(subject, 1) as made:
            session.prepare(made)
            instrument = made.open(traffic=lambda direction, text, kept=traffic: kept.append((direction, text)))  # type: ignore[misc]
            session.brief(made, instrument, checks)
            instrument.close()
        dialogues.append(traffic)
    right, remedy = bool(dialogues[0]) and dialogues[0] == dialogues[1], "Draw noise from the place's generator only"
    checks.that("the same seed gives the same readings", right, "they differ", remedy)
