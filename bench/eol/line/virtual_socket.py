"""A socket of virtual benches: for each motor a bench of its own, with that motor drawn from the spread of its type."""

import hashlib
from collections.abc import Callable, Collection, Iterator, Sequence
from contextlib import contextmanager
from dataclasses import fields, replace

import numpy as np

from bench.eol.line.messages import Batch
from bench.eol.plan_file import SpreadSection
from bench.operators.virtual import VirtualOperator
from bench.rehearsal.counterparts import counterparts_of, twin_station
from bench.run.context import RunContext, with_fixture
from bench.run.run_operator import VirtualHands
from bench.run.simulation import InProcessSimulation
from bench.station.sharing import Sharing
from bench.station.station_file import Station
from bench.station.visa_library import StationVisa
from bench.virtual.virtual_station import virtual_station
from drivers.interfaces import Clock
from procedures.core.bench import Role
from sim_instruments.bench import VirtualBench
from sim_instruments.catalogue import FIXTURE, SimulatedUnit, find
from sim_instruments.instruments.errors import Errors
from sim_instruments.physics.motor import VirtualMotor


class VirtualSocket:
    """Makes a virtual bench for each motor of a socket; its instruments' errors stay, those of `shared` ones in all sockets.

    It has the counterparts of the instruments of a station that it is the `twin` of, else the usual ones.
    """

    def __init__(self, batch: Batch, socket: int, shared: Collection[Role], twin: Station | None = None) -> None:
        self._batch = batch
        self._twin = twin
        self._counterparts = counterparts_of(twin) if twin else {}
        if batch.motor.six_step is None:
            self._counterparts.pop(Role.DRIVE, None)
        own, common = (Errors.drawn(np.random.default_rng([batch.request.seed, unit])) for unit in (socket + 1, 0))
        names = {role.value for role in shared}
        self._errors = Errors(
            **{each.name: getattr(common if each.name in names else own, each.name) for each in fields(Errors)}
        )
        self._stations: dict[tuple[tuple[str, str], ...], Station] = {}

    @contextmanager
    def context(
        self, serial_number: str, seed: int, on_advance: Callable[[float], None], sharing: Callable[[Clock], Sharing]
    ) -> Iterator[RunContext]:
        """Give the context for the motor with this serial number; `on_advance` is called with the bench's time (s) as it goes on."""
        batch = self._batch
        motor, six_step = batch.motor.virtual_motor(), batch.motor.six_step
        if six_step is None:
            motor = drawn_motor(motor, batch.plan.spread, seed_of(batch.request.seed, serial_number))
        # Relays and an actuator work in place of virtual hands.
        fixture = batch.request.operator != "virtual"
        with VirtualBench(
            motor,
            self._units(fixture=fixture),
            seed=seed,
            errors=self._errors,
            six_step=six_step,
            sockets=False,
            fixture=fixture,
        ) as bench:
            bench.clock.on_advance(on_advance)
            context = RunContext(
                self._station(bench),
                bench.clock,
                VirtualHands.of(VirtualOperator(bench.world, seed)),
                StationVisa(bench.visa_library),
                InProcessSimulation(bench, motor, six_step),
                sharing=sharing(bench.clock),
            )
            yield (
                with_fixture(context, lambda: float(bench.world.truth()["winding_temperature"])) if fixture else context
            )

    def _units(self, *, fixture: bool) -> Sequence[SimulatedUnit] | None:
        if self._twin is None:
            return None
        hands = [SimulatedUnit(find(name)) for name in FIXTURE.values()] if fixture else []
        return [*(each.unit for each in self._counterparts.values()), *hands]

    def _station(self, bench: VirtualBench) -> Station:
        """Return the station of a bench, made once for the same addresses: one bench is like another."""
        addresses = bench.addresses()
        key = tuple((role, str(address)) for role, address in addresses.items())
        if key not in self._stations:
            station = virtual_station(addresses)
            if self._twin is not None:
                made = twin_station(self._twin, self._counterparts, bench)
                station = replace(station, entries=made.entries, way_down=made.way_down, catalogues=made.catalogues)
            self._stations = {key: station}
        return self._stations[key]


def seed_of(*parts: object) -> int:
    """Return a seed that follows from these parts, the same on every machine."""
    return int.from_bytes(hashlib.sha256("\0".join(map(str, parts)).encode()).digest()[:8], "big")


def drawn_motor(nominal: VirtualMotor, spread: SpreadSection, seed: int) -> VirtualMotor:
    """Return one motor of the type, some with a defect; the same for the same seed.

    What is drawn is normally distributed; the three windings share half of the resistance's variance, as wire of one reel.
    """
    random = np.random.default_rng(seed)

    def factor(per_cent: float) -> float:
        return float(np.exp(0.01 * per_cent * random.standard_normal()))

    wire = factor(spread.resistance / np.sqrt(2.0))
    own = [factor(spread.resistance / np.sqrt(2.0)) for _ in range(3)]
    inductance, saliency = factor(spread.inductance), factor(0.3 * spread.inductance)
    flux, inertia, friction = factor(spread.flux), factor(spread.inertia), factor(spread.friction)
    a, b, c = (r * wire * each for r, each in zip(nominal.phase_resistances, own, strict=True))
    motor = replace(
        nominal,
        phase_resistances=(a, b, c),
        d_axis_inductance=nominal.d_axis_inductance * inductance / saliency,
        q_axis_inductance=nominal.q_axis_inductance * inductance * saliency,
        flux_linkage=nominal.flux_linkage * flux,
        inertia=nominal.inertia * inertia,
        coulomb_friction=nominal.coulomb_friction * friction,
        viscous_friction=nominal.viscous_friction * friction,
    )
    if random.random() >= spread.defects:
        return motor
    return DEFECTS[int(random.integers(len(DEFECTS)))](motor)


def bad_joint(motor: VirtualMotor) -> VirtualMotor:
    """Return the motor with a bad joint in phase B."""
    a, b, c = motor.phase_resistances
    return replace(motor, phase_resistances=(a, b * 1.25, c))


def missing_turns(motor: VirtualMotor) -> VirtualMotor:
    """Return the motor without a tenth of the turns of all phases: R goes with the turns, L with their square."""
    a, b, c = motor.phase_resistances
    return replace(
        motor,
        phase_resistances=(0.9 * a, 0.9 * b, 0.9 * c),
        d_axis_inductance=0.81 * motor.d_axis_inductance,
        q_axis_inductance=0.81 * motor.q_axis_inductance,
        flux_linkage=0.9 * motor.flux_linkage,
    )


def weak_magnets(motor: VirtualMotor) -> VirtualMotor:
    """Return the motor with weak magnets."""
    return replace(motor, flux_linkage=0.88 * motor.flux_linkage)


def tight_bearing(motor: VirtualMotor) -> VirtualMotor:
    """Return the motor with a tight bearing."""
    return replace(motor, coulomb_friction=4.0 * motor.coulomb_friction, viscous_friction=3.0 * motor.viscous_friction)


DEFECTS: tuple[Callable[[VirtualMotor], VirtualMotor], ...] = (bad_joint, missing_turns, weak_magnets, tight_bearing)
