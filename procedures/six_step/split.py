"""The equivalent resistance at one load, and its parts."""

import math
from dataclasses import dataclass

from GTC.lib import UncertainReal

from drivers.interfaces import Accuracy
from procedures.core.budget import Uncertainties
from procedures.estimation.six_step import currents as six_step
from procedures.estimation.winding.connections import Connection
from procedures.six_step.load_points import LoadPoint
from procedures.six_step.parts import Parts


@dataclass(frozen=True)
class ResistanceSplit:
    """R_eq (Ω) at one load, and of it the copper's and the commutation's part, None where the currents could not be separated."""

    point: LoadPoint
    equivalent: UncertainReal
    copper: UncertainReal | None
    commutation: UncertainReal | None
    row: dict[str, float | None]


def split_point(
    point: LoadPoint, temperature: UncertainReal, parts: Parts, connection: Connection, unc: Uncertainties
) -> ResistanceSplit:
    """Return R_eq = (V_bus − k_e·ω)/I_s at one load and its parts, with the winding at a temperature (°C)."""
    voltage = point.bus_voltage.with_errors(unc, "drive, bus voltage")
    current = point.bus_current.with_errors(unc, "drive, bus current")
    emf = parts.emf_at(temperature) * unc.instrument("tachometer", point.speed.value, point.speed.accuracy)
    equivalent = (voltage - emf) / current
    resistance = parts.winding.resistance_at(temperature)
    r, supply = float(resistance.x), point.bus_current.value
    row: dict[str, float | None] = {
        "load_torque": point.torque,
        "shaft_torque": point.shaft_torque.value,
        "shaft_torque_limit": point.shaft_torque.accuracy.offset
        + point.shaft_torque.accuracy.gain * abs(point.shaft_torque.value),
        "electrical_frequency": point.electrical_frequency,
        "speed_rpm": point.speed.value * 30.0 / math.pi,
        "bus_voltage": point.bus_voltage.value,
        "bus_current": supply,
        "winding_temperature": float(temperature.x),
        "emf": float(emf.x),
        "equivalent_resistance": float(equivalent.x),
        "switches": 2.0 * float(parts.switch_resistance.x),
        "R_11r": None,
        "R_11L": None,
        "copper_loss": None,
        "copper_resistance": None,
        "commutation_resistance": None,
    }
    if point.line is None:
        return ResistanceSplit(point, equivalent, None, None, row)
    state = six_step.conducting_state(point.line, connection)
    channel = scope_gain(unc, point.current_accuracy)
    copper = 3.0 * resistance * (state.period_rms * (1.0 + channel) / current) ** 2
    commutation = equivalent - 2.0 * parts.switch_resistance - copper
    row |= {
        "R_11r": state.resistive(r),
        "R_11L": state.inductive(float(parts.winding.inductance.x), point.state_time),
        "winding_average": state.average,
        "winding_rms": state.period_rms,
        "winding_start": state.start,
        "winding_end": state.end,
        "copper_loss": 3.0 * r * state.period_rms**2,
        "copper_resistance": float(copper.x),
        "commutation_resistance": float(commutation.x),
    }
    return ResistanceSplit(point, equivalent, copper, commutation, row)


def scope_gain(unc: Uncertainties, accuracy: Accuracy) -> UncertainReal:
    """Return the relative gain error of the current's channel, a quantity around zero."""
    return (
        unc.instrument("oscilloscope, current channel", 1.0, Accuracy(gain=accuracy.gain, source=accuracy.source)) - 1.0
    )
