"""The six-step drive on the bench: its data, its steady states, and the speed at which it balances a load."""

import math
from collections.abc import Callable
from dataclasses import dataclass, field, replace
from functools import lru_cache

from sim_instruments.physics.motor.motor import VirtualMotor
from sim_instruments.physics.swing import Shaft
from sim_instruments.six_step.drive import SixStepDrive
from sim_instruments.six_step.emf import emf_angle_at_start
from sim_instruments.six_step.load import balance_load, stall_torque
from sim_instruments.six_step.machine import virtual_motor
from sim_instruments.six_step.state import Bridge
from sim_instruments.six_step.steady_state import SteadyState, steady_state

STATE_ANGLE = math.pi / 3.0
#: Solutions kept of a drive (a run asks for a few dozen), and drives whose solutions the benches of a process share.
_KEPT, _SHARED = 512, 32
#: Temperatures (K) that share their solutions.
_SAME_WARMTH = 0.25
#: Share of the slope between standstill and no load that a torque curve is taken to have at the least.
_LEAST_SLOPE = 0.01
_STEP = 1e-3
#: Rounds and relative distance in which a balance against a drag that depends on the speed is found.
_ROUNDS, _CLOSE = 60, 1e-7


@dataclass(frozen=True)
class Balance:
    """A speed (rad/s) that the shaft goes to, and by how much torque falls with speed there (N·m·s/rad)."""

    speed: float
    slope: float
    #: Whether the dynamometer's largest speed ends it, not the drive's torque.
    limited: bool = False


class _Solutions:
    """Steady states and balances of a drive: kept once found, for every bench in the process that has the same drive."""

    def __init__(self, drive: SixStepDrive) -> None:
        self.bridge = Bridge(drive)
        self.states: dict[float, SteadyState] = {}
        self.balances: dict[tuple[Shaft, float, float], Balance] = {}


@lru_cache(maxsize=_SHARED)
def _solutions_of(drive: SixStepDrive) -> _Solutions:
    return _Solutions(drive)


@dataclass
class SixStepStage:
    """A `SixStepDrive` whose machine is the motor on the bench; solutions are kept once found.

    Raises ValueError for a motor that is not the drive's machine.
    """

    drive: SixStepDrive
    motor: VirtualMotor
    _solutions: _Solutions = field(init=False)
    _warm: dict[float, "SixStepStage"] = field(init=False, default_factory=dict)

    def __post_init__(self) -> None:
        machine = virtual_motor(self.drive)
        for name in ("connection", "pole_pairs", "phase_resistances", "q_axis_inductance", "flux_linkage"):
            own, there = getattr(machine, name), getattr(self.motor, name)
            if own != there:
                raise ValueError(
                    f"the six-step drive's machine has {name} {own} and the motor on the bench {there}; "
                    "make the motor by sim_instruments.six_step.machine.virtual_motor from the drive"
                )
        self._solutions = _solutions_of(self.drive)

    @property
    def bridge(self) -> Bridge:
        """The drive's bridge."""
        return self._solutions.bridge

    @property
    def slowest(self) -> float:
        """Speed (rad/s) below which waveforms are those of this speed."""
        return 2e-3 * self.bridge.no_load_speed

    def at(self, temperature: float) -> "SixStepStage":
        """Return the drive with winding and magnets at a temperature (°C), to a quarter of a kelvin.

        What the drive's figures say holds at the motor's `resistance_temperature`.
        """
        motor = self.motor
        rise = round((temperature - motor.resistance_temperature) / _SAME_WARMTH) * _SAME_WARMTH
        if rise == 0.0:
            return self
        result = self._warm.get(rise)
        if result is None:
            if len(self._warm) >= _KEPT:
                self._warm.clear()
            warm = motor.resistance_temperature + rise
            drive = replace(
                self.drive,
                resistance=motor.resistances_at(warm)[0],
                emf_constant=self.drive.emf_constant * motor.flux_linkage_at(warm) / motor.flux_linkage,
            )
            result = self._warm[rise] = SixStepStage(
                drive,
                replace(
                    motor,
                    phase_resistances=(drive.resistance,) * 3,
                    flux_linkage=drive.emf_constant / drive.pole_pairs,
                ),
            )
        return result

    def state_angle(self, electrical_angle: float) -> float:
        """Return the electrical angle (rad) since a state T1T2 began, from the rotor's on the bench.

        On the bench it is the d axis from winding 0's axis, and the EMF a quarter turn ahead of its flux.
        """
        return electrical_angle + 0.5 * math.pi - emf_angle_at_start(self.drive)

    def steady(self, speed: float) -> SteadyState:
        """Return the steady state at a speed (rad/s). Raises SixStepError where there is none."""
        states = self._solutions.states
        result = states.get(speed)
        if result is None:
            if len(states) >= _KEPT:
                states.clear()
            result = states[speed] = steady_state(self.bridge, speed)
        return result

    def balance(self, shaft: Shaft, torque: float, fastest: float) -> Balance:
        """Return where a shaft goes under a torque from outside (N·m, positive drives it), at most to `fastest` (rad/s).

        Raises SixStepError where the drive cannot carry the load.
        """
        key = (shaft, torque, fastest)
        balances = self._solutions.balances
        result = balances.get(key)
        if result is None:
            if len(balances) >= _KEPT:
                balances.clear()
            result = balances[key] = self._solve(shaft, torque, fastest)
        return result

    def _solve(self, shaft: Shaft, torque: float, fastest: float) -> Balance:
        # Everything that turns counts as the drive's own machine; its currents do not notice.
        whole = Bridge(
            replace(
                self.drive,
                inertia=shaft.inertia,
                coulomb_friction=shaft.coulomb_friction,
                viscous_friction=shaft.viscous_friction,
            )
        )
        drag = shaft.bearing.drag
        limited = math.isfinite(fastest) and steady_state(whole, fastest).load_torque > drag(fastest) - torque
        speed = fastest if limited else balance_load(whole, -torque).speed
        if not (limited or shaft.bearing.plain):
            speed = _balanced(whole, torque, drag, speed)
        faster, slower = (steady_state(whole, speed * (1.0 + step)).load_torque for step in (_STEP, -_STEP))
        least = _LEAST_SLOPE * stall_torque(whole) / whole.no_load_speed
        slope = (slower - faster + drag(speed * (1.0 + _STEP)) - drag(speed * (1.0 - _STEP))) / (2.0 * _STEP * speed)
        return Balance(speed, max(slope, least), limited)


def _balanced(bridge: Bridge, torque: float, drag: Callable[[float], float], fastest: float) -> float:
    """Return the speed (rad/s) below `fastest` at which a bridge also carries a drag (N·m) that depends on it."""
    # The drag at the slower speed is let in bit by bit, so that no step ends in a stall that is none.
    speed = fastest
    for _ in range(_ROUNDS):
        following = balance_load(bridge, drag(speed) - torque).speed
        if abs(following - speed) <= _CLOSE * fastest:
            return following
        speed = 0.5 * (speed + following)
    return speed
