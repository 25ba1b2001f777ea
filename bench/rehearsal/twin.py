"""The virtual twin of a station: its roles and limits, each driver's simulated counterpart, and the motor or a plausible one."""

from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import dataclass

from bench.i18n.errors import InputError, at
from bench.motor.motor_file import MotorFile
from bench.operators.virtual import VirtualOperator
from bench.plugins.catalogue import reason
from bench.rehearsal.assumed import Assumption, assumed_drive, assumed_motor
from bench.rehearsal.counterparts import counterparts_of, twin_station
from bench.run.context import RunContext
from bench.run.run_operator import VirtualHands
from bench.run.simulation import InProcessSimulation
from bench.station.station_file import Station
from bench.station.visa_library import StationVisa
from drivers.interfaces.text import Text, text
from procedures.core.bench import Role
from sim_instruments.bench import VirtualBench
from sim_instruments.six_step.machine import virtual_motor


@dataclass(frozen=True)
class Twin:
    """The surroundings of a rehearsal, the assumed figures of the motor, and the differences between twin and station."""

    context: RunContext
    assumed: tuple[Assumption, ...]
    differences: tuple[Text, ...]


@contextmanager
def twin_of(station: Station, motor: MotorFile, seed: int) -> Iterator[Twin]:
    """Give the twin; nothing of the station is opened.

    Raises InputError for a motor file that does not go with a drive, and naming a simulated instrument that cannot be had or fails when
    it is made.
    """
    assumed: tuple[Assumption, ...] = ()
    truth, six_step = motor.virtual, motor.six_step
    if truth is None:
        truth, assumed = assumed_motor(motor.nameplate)
    if Role.DRIVE in station.entries and six_step is None:
        six_step, more = assumed_drive(truth, motor.nameplate)
        truth, assumed = virtual_motor(six_step), (*assumed, *more)
    differences: list[Text] = []
    counterparts = counterparts_of(station, motor.nameplate)
    for role in station.entries:
        if role in counterparts:
            differences += counterparts[role].differences
        else:
            differences.append(text("{role}: the virtual twin has none; simulated hands do its work", role=role.value))
    units = [counterpart.unit for counterpart in counterparts.values()]
    with VirtualBench(truth, units, seed=seed, six_step=six_step, sockets=False) as bench:
        _make(bench, station)
        context = RunContext(
            twin_station(station, counterparts, bench),
            bench.clock,
            VirtualHands.of(VirtualOperator(bench.world, seed)),
            StationVisa(bench.visa_library),
            InProcessSimulation(bench, truth, six_step),
        )
        yield Twin(context, assumed, tuple(differences))


def _make(bench: VirtualBench, station: Station) -> None:
    """Make the simulated instruments that are others' now, so that one that fails is named."""
    known = station.catalogues.simulated_instruments
    for role, entry in station.entries.items():
        name = entry.driver.simulated
        if name in known.names and role.value in bench.roles and known.origin(name).name != "motorbench":
            try:
                bench.instrument(role.value)
            except Exception as error:
                why = text("simulated instrument {name}: {why}", name=name, why=reason(error))
                raise InputError(at(role.value, why)) from error
