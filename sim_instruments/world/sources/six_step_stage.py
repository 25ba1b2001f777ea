"""The six-step drive on the bench: its data, its steady states, and the speed at which it balances a load."""

import math
from dataclasses import dataclass, field, replace

from sim_instruments.physics.motor.motor import VirtualMotor
from sim_instruments.physics.swing import Shaft
from sim_instruments.six_step.drive import SixStepDrive
from sim_instruments.six_step.emf import emf_angle_at_start
from sim_instruments.six_step.load import balance_load, stall_torque
from sim_instruments.six_step.machine import virtual_motor
from sim_instruments.six_step.state import Bridge
from sim_instruments.six_step.steady_state import SteadyState, steady_state

STATE_ANGLE = math.pi / 3.0
#: Solutions kept; a run asks for a few dozen.
_KEPT = 512
#: Temperatures (K) that share their solutions.
_SAME_WARMTH = 0.25
#: Share of the slope between standstill and no load that a torque curve is taken to have at the least.
_LEAST_SLOPE = 0.01
_STEP = 1e-3


@dataclass(frozen=True)
class Balance:
    """A speed (rad/s) that the shaft goes to, and by how much torque falls with speed there (N·m·s/rad)."""

    speed: float
    slope: float
    #: Whether the dynamometer's largest speed ends it, not the drive's torque.
    limited: bool = False


@dataclass
class SixStepStage:
    """A `SixStepDrive` whose machine is the motor on the bench; solutions are kept once found.

    Raises ValueError for a motor that is not the drive's machine.
    """

    drive: SixStepDrive
    motor: VirtualMotor
    bridge: Bridge = field(init=False)
    _states: dict[float, SteadyState] = field(init=False, default_factory=dict)
    _warm: dict[float, "SixStepStage"] = field(init=False, default_factory=dict)
    _balances: dict[tuple[Shaft, float, float], Balance] = field(init=False, default_factory=dict)

    def __post_init__(self) -> None:
        machine = virtual_motor(self.drive)
        for name in ("connection", "pole_pairs", "phase_resistances", "q_axis_inductance", "flux_linkage"):
            own, there = getattr(machine, name), getattr(self.motor, name)
            if own != there:
                raise ValueError(
                    f"the six-step drive's machine has {name} {own} and the motor on the bench {there}; "
                    "make the motor by sim_instruments.six_step.machine.virtual_motor from the drive"
                )
        self.bridge = Bridge(self.drive)

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
        found = self._warm.get(rise)
        if found is None:
            if len(self._warm) >= _KEPT:
                self._warm.clear()
            warm = motor.resistance_temperature + rise
            drive = replace(
                self.drive,
                resistance=motor.resistances_at(warm)[0],
                emf_constant=self.drive.emf_constant * motor.flux_linkage_at(warm) / motor.flux_linkage,
            )
            found = self._warm[rise] = SixStepStage(
                drive,
                replace(
                    motor,
                    phase_resistances=(drive.resistance,) * 3,
                    flux_linkage=drive.emf_constant / drive.pole_pairs,
                ),
            )
        return found

    def state_angle(self, electrical_angle: float) -> float:
        """Return the electrical angle (rad) since a state T1T2 began, from the rotor's on the bench.

        On the bench it is the d axis from winding 0's axis, and the EMF a quarter turn ahead of its flux.
        """
        return electrical_angle + 0.5 * math.pi - emf_angle_at_start(self.drive)

    def steady(self, speed: float) -> SteadyState:
        """Return the steady state at a speed (rad/s). Raises SixStepError where there is none."""
        found = self._states.get(speed)
        if found is None:
            if len(self._states) >= _KEPT:
                self._states.clear()
            found = self._states[speed] = steady_state(self.bridge, speed)
        return found

    def balance(self, shaft: Shaft, torque: float, fastest: float) -> Balance:
        """Return where a shaft goes under a torque from outside (N·m, positive drives it), at most to `fastest` (rad/s).

        Raises SixStepError where the drive cannot carry the load.
        """
        key = (shaft, torque, fastest)
        found = self._balances.get(key)
        if found is None:
            if len(self._balances) >= _KEPT:
                self._balances.clear()
            found = self._balances[key] = self._solve(shaft, torque, fastest)
        return found

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
        limited = math.isfinite(fastest) and steady_state(whole, fastest).load_torque > -torque
        speed = fastest if limited else balance_load(whole, -torque).speed
        faster, slower = (steady_state(whole, speed * (1.0 + step)).load_torque for step in (_STEP, -_STEP))
        least = _LEAST_SLOPE * stall_torque(whole) / whole.no_load_speed
        return Balance(speed, max((slower - faster) / (2.0 * _STEP * speed), least), limited)
