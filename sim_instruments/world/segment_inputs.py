"""The inputs of the next segment's laws."""

import math
from collections.abc import Callable
from dataclasses import dataclass, replace

import numpy as np

from sim_instruments.physics.circuits.crossing import first_rise
from sim_instruments.physics.circuits.network import Network
from sim_instruments.physics.circuits.saturated import SaturatedTransient
from sim_instruments.physics.circuits.source import CurrentSource, Source, VoltageSource, absent
from sim_instruments.physics.circuits.transient import LinearTransient
from sim_instruments.physics.circuits.windings import FloatArray, Windings
from sim_instruments.physics.closed_loops import ClosedLoops
from sim_instruments.physics.mapped.network import MappedNetwork
from sim_instruments.physics.mapped.rotation import MappedRotation
from sim_instruments.physics.motion.motion import Motion, Ramp, RestingShaft, Wavering
from sim_instruments.physics.rotating import Rotating
from sim_instruments.world.constants import Constants
from sim_instruments.world.segment import Circuit, DynamometerLaw, Outcome, Segment, State
from sim_instruments.world.settings import WorldSettings
from sim_instruments.world.sources.supply_regime import Regime

StandingCircuit = LinearTransient | SaturatedTransient


@dataclass(frozen=True)
class SegmentInputs:
    """Constants, settings and state at a time (s), with the circuit that they make; `output` None is an open output."""

    constants: Constants
    settings: WorldSettings
    state: State
    time: float
    windings: Windings
    network: Network
    output: Regime | None

    @property
    def electrical_angle(self) -> float:
        """The rotor's electrical angle (rad)."""
        return self.state.angle * self.windings.pole_pairs

    def open_source(self) -> VoltageSource:
        """Return the supply's output where nothing is connected to it: whatever it does, it does without a current."""
        source = absent(self.time) if self.output is None else self.output.source
        return source if isinstance(source, VoltageSource) else absent(self.time)

    def loops(self) -> FloatArray:
        """Return the loop currents (A) that the circuit starts with."""
        return self.network.loop_currents(self.state.winding_currents, self.electrical_angle)

    def segment(
        self,
        motion: Motion,
        circuit: Circuit,
        end: float,
        law: DynamometerLaw,
        *,
        live: bool,
        outcome: Outcome = "none",
        in_step: bool = True,
    ) -> Segment:
        """Return a segment of these laws."""
        output = self.output
        if law.kind == "balance":
            law = replace(law, cogging=True)
        if output is not None and output.end < end:
            end, outcome = output.end, "trip voltage" if output.trips_voltage else "none"
        return Segment(
            self.time,
            end,
            motion,
            circuit,
            self.windings,
            self.constants.shaft(self.settings),
            live,
            "off" if output is None else output.mode,
            outcome,
            law,
            in_step,
        )

    def standing_circuit(self) -> tuple[StandingCircuit, float]:
        """Return the circuit of a standing rotor, and when (s) a threshold of the supply's regime ends it."""
        output, network, angle = self.output, self.network, self.electrical_angle
        source: Source = absent(self.time) if output is None else output.source
        circuit: StandingCircuit
        if network.saturation is None or not network.loops:
            circuit = LinearTransient(network, angle, self.time, self.loops(), source)
        else:
            until = math.inf if output is None else output.end
            circuit = SaturatedTransient(network, network.saturation, angle, self.time, self.loops(), source, until)
        if output is None:
            return circuit, math.inf
        return circuit, self._threshold(circuit, output)

    def _threshold(self, circuit: StandingCircuit, output: Regime) -> float:
        thresholds, network = output.thresholds, self.network
        regulated = isinstance(output.source, CurrentSource)
        level = thresholds.voltage if regulated else thresholds.current
        if math.isinf(level):
            return math.inf
        sign = 1 if regulated else thresholds.current_direction
        course: Callable[[FloatArray], FloatArray]
        if isinstance(circuit, LinearTransient):
            exponentials = circuit.source_course()
            if exponentials.stays_below(level, sign):
                return math.inf
            course = exponentials.at
            # A course that leaves its level for the other side must not seem to pass it.
            level += sign * exponentials.rounding
            passing = exponentials.passing(level, sign, output.end)
            if passing is not None:
                return passing
        elif regulated:
            course = circuit.source_voltage
        else:
            course = lambda times: network.source_current(circuit.winding_currents(times))  # noqa: E731

        def excess(times: FloatArray) -> FloatArray:
            return sign * (course(times) - level)

        constants = 1.0 / circuit.rates
        if isinstance(output.source, CurrentSource):
            return first_rise(excess, self.time, output.end, constants)
        if sign < 0 and float(excess(np.array([self.time]))[0]) >= 0.0:
            return self.time if output.source.voltage == 0.0 else output.end
        return first_rise(excess, self.time, output.end, constants)

    def turning_circuit(self, motion: Motion) -> Rotating | ClosedLoops | MappedRotation:
        """Return the circuit of a rotor that turns without an inverter or a six-step drive on it."""
        network = self.network
        if isinstance(network, MappedNetwork):
            return MappedRotation(network, motion, self.rotating_source())
        # Shorted turns and eddy currents keep the currents that the mean inductance gives.
        if type(network) is Network and network.joins_terminals:
            return ClosedLoops(network, motion)
        return Rotating(network, motion, self.rotating_source())

    def rotating_source(self) -> Source:
        """Return the supply's source for a shaft turned from outside: its steady state, voltage or current."""
        if self.output is None or not self.settings.supply.on:
            return absent(self.time)
        supply, limit, network = self.settings.supply, self.settings.supply_limit, self.network
        if not network.drives_current:
            return VoltageSource(self.time, supply.voltage)
        loops = np.linalg.solve(network.damping, network.drive * supply.voltage)
        if float(network.drive @ loops) > limit:
            return CurrentSource(limit)
        return VoltageSource(self.time, supply.voltage)


def dynamometer_ramp(inputs: SegmentInputs) -> tuple[Motion, float]:
    """Return the shaft's motion under the dynamometer's speed control, and its end (s).

    The ramp is the drive's, or what its largest torque allows.
    """
    machine, state, target = inputs.constants.dynamometer, inputs.state, inputs.settings.dynamometer_target
    change = target - state.speed
    if abs(change) <= 1e-9 * max(abs(target), 1.0) or _about(state.speed, target, machine.speed_ripple):
        if target == 0.0:
            return RestingShaft(state.angle), math.inf
        # Once a turn; it starts at its zero, so that speed and angle run on without a step.
        return Wavering(inputs.time, state.angle, target, machine.speed_ripple, abs(target)), math.inf
    shaft = inputs.constants.shaft(inputs.settings)
    sign = math.copysign(1.0, change)
    top = max(abs(state.speed), abs(target))
    braking = abs(target) < abs(state.speed) and target * state.speed >= 0.0
    friction = shaft.coulomb_friction + shaft.viscous_friction * top
    if not shaft.bearing.plain:
        friction = max(shaft.static_friction, shaft.friction(top))
    available = machine.maximum_torque + (0.0 if braking else -friction)
    rate = min(machine.speed_ramp, available / shaft.inertia)
    if rate <= 0.0:
        return RestingShaft(state.angle), math.inf
    # A ramp through standstill is cut there: no segment turns both ways.
    stop = 0.0 if state.speed * target < 0.0 else target
    end = inputs.time + abs(stop - state.speed) / rate
    return Ramp(inputs.time, state.angle, state.speed, sign * rate), max(
        end, float(np.nextafter(inputs.time, math.inf))
    )


def _about(speed: float, target: float, ripple: float) -> bool:
    return target != 0.0 and abs(speed - target) <= 1.001 * ripple * abs(target)
