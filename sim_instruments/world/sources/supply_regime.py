"""The next regime of the supply's output: it ramps, holds a voltage or a current, falls after switching off, or trips."""

import math
from dataclasses import dataclass, field

import numpy as np

from sim_instruments.physics.circuits.network import Network
from sim_instruments.physics.circuits.source import CurrentSource, Source, VoltageSource
from sim_instruments.physics.swing import Thresholds
from sim_instruments.world.machine_data import SupplyStage
from sim_instruments.world.segment import State, SupplyMode
from sim_instruments.world.settings import SupplySettings

#: Below this current (A) a falling output opens.
OPENING_CURRENT = 1e-4
#: Up to this voltage (V) nothing is left on a falling output.
NO_VOLTAGE = 1e-12
#: A current (A) is at the limit within this: after an hour of bench time a double's step of time is 1e-12 s, in which a small
#: winding's current rises by some 1e-7 A.
_CURRENT_STEP = 1e-7
#: Constant current gives way to constant voltage this much (relative, and in V) above the level, lest the two alternate.
_HYSTERESIS = 1e-6


@dataclass(frozen=True)
class Regime:
    """A source, its mode, how long it holds at most (s), and the thresholds that end it earlier."""

    source: Source
    mode: SupplyMode
    end: float = math.inf
    thresholds: Thresholds = field(default_factory=Thresholds)
    trips_voltage: bool = False


def over_voltage(supply: SupplySettings, source_voltage: float) -> bool:
    """Say whether the over-voltage protection trips at this output voltage (V)."""
    limit = supply.over_voltage
    return supply.on and limit is not None and source_voltage > limit * (1.0 + 1e-9)


def is_open(supply: SupplySettings, state: State) -> bool:
    """Tell whether the output is off and open: it has no voltage, and no current flows."""
    return not supply.on and state.source_voltage <= NO_VOLTAGE and not state.winding_currents.any()


def regime(
    supply: SupplySettings, limit: float, stage: SupplyStage, state: State, network: Network, time: float
) -> Regime | None:
    """Return what the output does from `time` (s) on up to a current (A), or None where it is off and open."""
    current = float(network.source_current(state.winding_currents[:, np.newaxis])[0])
    voltage = state.source_voltage
    if not supply.on:
        if voltage <= NO_VOLTAGE and current <= OPENING_CURRENT + _CURRENT_STEP:
            return None
        return _falling(stage, time, voltage, OPENING_CURRENT, "off", opens=True)
    if network.drives_current:
        tolerance = _CURRENT_STEP * (1.0 + limit)
        if current > limit + tolerance:
            return _falling(stage, time, voltage, limit, "unregulated", opens=False)
        if current >= limit - tolerance:
            speed = state.speed * network.windings.pole_pairs
            angle = state.angle * network.windings.pole_pairs
            needed = network.voltage_for_constant_current(
                network.loop_currents(state.winding_currents, angle), angle, speed
            )
            highest = supply.voltage + stage.ripple
            if needed <= highest * (1.0 + 0.5 * _HYSTERESIS) + 0.5 * _HYSTERESIS:
                leaving = highest * (1.0 + _HYSTERESIS) + _HYSTERESIS
                return Regime(CurrentSource(limit), "cc", thresholds=Thresholds(voltage=leaving))
    rising = Thresholds(current=limit) if network.drives_current else Thresholds()
    ripple, slope, turn = stage.ripple_at(time)
    if (
        stage.ripple
        and abs(voltage - supply.voltage) <= stage.ripple * (1.0 + _HYSTERESIS)
        and supply.voltage > stage.ripple
    ):
        return Regime(VoltageSource(time, supply.voltage + ripple, slope), "cv", turn, rising)
    if math.isclose(voltage, supply.voltage, rel_tol=1e-12, abs_tol=1e-12):
        return Regime(VoltageSource(time, supply.voltage), "cv", thresholds=rising)
    slope = math.copysign(stage.slew, supply.voltage - voltage)
    target, trips = supply.voltage, False
    if supply.over_voltage is not None and voltage <= supply.over_voltage < supply.voltage:
        target, trips = supply.over_voltage, True
    end = time + (target - voltage) / slope
    if end <= time:
        return Regime(VoltageSource(time, target), "cv", time if trips else math.inf, rising, trips)
    return Regime(VoltageSource(time, voltage, slope), "cv", end, rising, trips)


def _falling(
    stage: SupplyStage, time: float, voltage: float, until_current: float, mode: SupplyMode, *, opens: bool
) -> Regime:
    """Let the down-programmer take the output to 0 V and the current decay to where another regime takes over."""
    thresholds = Thresholds(current=until_current, current_direction=-1)
    if voltage > NO_VOLTAGE:
        end = time + voltage / stage.slew
        # An output that is off keeps falling to 0 V even after its current has gone.
        falling = Thresholds() if opens else thresholds
        return Regime(VoltageSource(time, voltage, -stage.slew), mode, max(end, np.nextafter(time, math.inf)), falling)
    return Regime(VoltageSource(time, 0.0), mode, thresholds=thresholds)
