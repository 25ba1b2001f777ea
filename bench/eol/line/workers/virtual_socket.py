"""A socket of virtual benches: for each motor a bench of its own, with that motor drawn from the spread of its type."""

import hashlib
from collections.abc import Callable, Collection, Iterator, Sequence
from contextlib import contextmanager
from dataclasses import dataclass, fields, replace
from functools import partial

import numpy as np

from bench.eol.line.workers.messages import Batch
from bench.eol.plan_file import SpreadSection
from bench.motor.motor_file import MotorFile
from bench.operators.virtual import VirtualOperator
from bench.rehearsal.counterparts import counterparts_of, twin_station
from bench.run.context import RunContext, with_fixture
from bench.run.run_operator import VirtualHands
from bench.run.simulation import InProcessSimulation
from bench.station.sharing import Sharing
from bench.station.station_file import Station
from bench.station.visa_library import StationVisa
from bench.virtual.virtual_station import bench_size_for, dc_voltage_for, virtual_station
from drivers.interfaces import Clock
from procedures.core.bench import Role
from sim_instruments.bench import BenchSetting, VirtualBench
from sim_instruments.catalogue import FIXTURE, SimulatedUnit, find, standard_units
from sim_instruments.disturbances.bench import Disturbances
from sim_instruments.faults.description import Description
from sim_instruments.instruments.errors import Errors
from sim_instruments.physics.motor import defects
from sim_instruments.physics.motor.motor import VirtualMotor
from sim_instruments.six_step.machine import driven


def _as_drawn(motor: VirtualMotor) -> VirtualMotor:
    return motor


@dataclass(frozen=True)
class Specimen:
    """The change of a drawn motor, and the faults and disturbances of its bench."""

    change: Callable[[VirtualMotor], VirtualMotor] = _as_drawn
    faults: tuple[Description, ...] = ()
    disturbances: Disturbances | None = None


@dataclass(frozen=True)
class SocketMotors:
    """The motors that come to a virtual socket: those of a type, drawn from its `spread` by `seed`.

    With `operator` virtual, virtual hands work in place of a fixture.
    """

    motor: MotorFile
    spread: SpreadSection
    seed: int
    operator: str = ""

    @staticmethod
    def of(batch: Batch) -> "SocketMotors":
        """Return a batch's."""
        return SocketMotors(batch.motor, batch.plan.spread, batch.request.seed, batch.request.operator)


class VirtualSocket:
    """Makes a virtual bench for each motor of a socket; its instruments' errors stay, those of `shared` ones in all sockets.

    It has the counterparts of the instruments of a station that it is the `twin` of, else the usual ones.
    """

    def __init__(
        self, motors: SocketMotors, socket: int, shared: Collection[Role], twin: Station | None = None
    ) -> None:
        self._motors = motors
        self._twin = twin
        self._size = bench_size_for(motors.motor.virtual_motor(), motors.motor.nameplate)
        self._counterparts = counterparts_of(twin, motors.motor.nameplate) if twin else {}
        if motors.motor.six_step is None:
            self._counterparts.pop(Role.DRIVE, None)
        own, common = (Errors.drawn(np.random.default_rng([motors.seed, unit])) for unit in (socket + 1, 0))
        names = {role.value for role in shared}
        self._errors = Errors(
            **{each.name: getattr(common if each.name in names else own, each.name) for each in fields(Errors)}
        )
        self._stations: dict[tuple[tuple[str, str], ...], Station] = {}

    @contextmanager
    def context(
        self,
        serial_number: str,
        seed: int,
        on_advance: Callable[[float], None],
        sharing: Callable[[Clock], Sharing],
        specimen: Specimen | None = None,
    ) -> Iterator[RunContext]:
        """Give the context for the motor with this serial number, or a `specimen` made of it.

        `on_advance` is called with the bench's time (s) as it goes on.
        """
        motors = self._motors
        six_step, made = motors.motor.six_step, specimen or Specimen()
        drawn = drawn_motor(
            motors.motor.virtual_motor(),
            motors.spread,
            seed_of(motors.seed, serial_number),
            alike=six_step is not None,
        )
        motor = made.change(drawn)
        if six_step is not None:
            six_step, motor = driven(six_step, motor)
        # Relays and an actuator work in place of virtual hands.
        fixture = motors.operator != "virtual"
        with VirtualBench(
            motor,
            self._units(fixture=fixture),
            seed=seed,
            errors=self._errors,
            six_step=six_step,
            sockets=False,
            fixture=fixture,
            setting=None if made.disturbances is None else BenchSetting(disturbances=made.disturbances),
        ) as bench:
            bench.clock.on_advance(on_advance)
            for fault in made.faults:
                bench.injector.add(fault)
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

    def _units(self, *, fixture: bool) -> Sequence[SimulatedUnit]:
        motor = self._motors.motor
        if self._twin is None:
            return standard_units(
                six_step=motor.six_step is not None,
                fixture=fixture,
                dc_voltage=dc_voltage_for(motor.nameplate),
                torque=self._size.torque,
                inverter_current=self._size.inverter_current,
            )
        hands = [SimulatedUnit(find(name)) for name in FIXTURE.values()] if fixture else []
        return [*(each.unit for each in self._counterparts.values()), *hands]

    def _station(self, bench: VirtualBench) -> Station:
        """Return the station of a bench, made once for the same addresses: one bench is like another."""
        addresses = bench.addresses()
        key = tuple((role, str(address)) for role, address in addresses.items())
        if key not in self._stations:
            station = virtual_station(addresses, size=self._size)
            if self._twin is not None:
                made = twin_station(self._twin, self._counterparts, bench)
                station = replace(station, entries=made.entries, way_down=made.way_down, catalogues=made.catalogues)
            self._stations = {key: station}
        return self._stations[key]


def seed_of(*parts: object) -> int:
    """Return a seed that follows from these parts, the same on every machine."""
    return int.from_bytes(hashlib.sha256("\0".join(map(str, parts)).encode()).digest()[:8], "big")


def drawn_motor(nominal: VirtualMotor, spread: SpreadSection, seed: int, *, alike: bool = False) -> VirtualMotor:
    """Return one motor of the type, some with a defect; the same for the same seed.

    What is drawn is log-normally distributed; the three windings share half of the resistance's variance, as wire of one reel, and
    all of it where they must be `alike`, as a six-step drive's are; then there is no saliency either, and no defect.
    """
    random = np.random.default_rng(seed)

    def factor(per_cent: float) -> float:
        return float(np.exp(0.01 * per_cent * random.standard_normal()))

    wire = factor(spread.resistance / np.sqrt(2.0))
    own = [factor(spread.resistance / np.sqrt(2.0)) for _ in range(3)]
    inductance, saliency = factor(spread.inductance), factor(0.3 * spread.inductance)
    flux, inertia, friction = factor(spread.flux), factor(spread.inertia), factor(spread.friction)
    if alike:
        own, saliency = [own[0]] * 3, 1.0
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
    if random.random() >= spread.defects or alike:
        return motor
    return DEFECTS[int(random.integers(len(DEFECTS)))](motor)


#: What one in so many motors of a batch has: each as bad as is found at lines now and then.
DEFECTS: tuple[Callable[[VirtualMotor], VirtualMotor], ...] = (
    partial(defects.bad_joint, share=0.25),
    partial(defects.fewer_turns, share=0.1),
    partial(defects.weak_magnets, share=0.12),
    lambda motor: defects.tight_bearing(motor, 3.0 * motor.coulomb_friction),
)
