"""Effect of a defect on a motor's function, whether a procedure detects it or not."""

import math
from collections.abc import Iterator
from dataclasses import dataclass
from enum import Enum

from sim_instruments.physics.motor.motor import VirtualMotor


class DefectSeverity(Enum):
    """Severity of a defect to the motor's user; a `slight` one a plan may let through."""

    SLIGHT = "slight"
    MARGINAL = "marginal"
    GROSS = "gross"


@dataclass(frozen=True)
class RatedPoint:
    """A motor's rated current (A, phase, peak) and speed (rad/s)."""

    current: float
    speed: float

    def torque(self, motor: VirtualMotor) -> float:
        """Return the rated torque (N·m)."""
        return motor.torque_constant * self.current


#: From where on a quantity makes a defect marginal, and gross: torque per ampere off by so much of the type's, copper loss of the hottest
#: phase at rated torque beyond the type's by so much of it, drag and torque ripple beyond the type's by so much of rated torque,
#: Hall edges off by so many electrical degrees. They are a choice, stated where results are.
THRESHOLDS: dict[str, tuple[float, float]] = {
    "torque": (0.05, 0.10),
    "heat": (0.10, 0.25),
    "drag": (0.02, 0.05),
    "ripple": (0.02, 0.05),
    "commutation": (5.0, 15.0),
}
#: Insulation (Ω) below which it is marginal, and gross: IEEE 43's least for windings since about 1970, and for random-wound ones
#: below 1 kV. One source.
INSULATION = (1.0e8, 5.0e6)


@dataclass(frozen=True)
class FunctionCost:
    """A defect's grade, with what decides it: a key of THRESHOLDS, "insulation", or "fails" for a motor that does not do its work."""

    grade: DefectSeverity
    by: str
    value: float = math.nan


#: Of a motor that turns the wrong way, or not at all, or is none of the type, or was not measured.
FAILS = FunctionCost(DefectSeverity.GROSS, "fails")


def function_cost(sound: VirtualMotor, bad: VirtualMotor, rating: RatedPoint) -> FunctionCost:
    """Return what a motor costs against a sound one of its type: the worst of all quantities."""
    if (
        bad.exchanged != sound.exchanged
        or bad.pole_pairs != sound.pole_pairs
        or _halls_wrong(bad)
        or (sound.halls and not bad.halls)
    ):
        return FAILS
    costs = [_graded(name, value) for name, value in _quantities(sound, bad, rating)]
    marginal, gross = INSULATION
    resistance = bad.insulation_resistance
    grade = (
        DefectSeverity.GROSS
        if resistance < gross
        else DefectSeverity.MARGINAL
        if resistance < marginal
        else DefectSeverity.SLIGHT
    )
    costs.append((grade, marginal / resistance, FunctionCost(grade, "insulation", resistance)))
    order = list(DefectSeverity)
    return max(costs, key=lambda cost: (order.index(cost[0]), cost[1]))[2]


def _graded(name: str, value: float) -> tuple[DefectSeverity, float, FunctionCost]:
    marginal, gross = THRESHOLDS[name]
    # Shares that were set to a threshold lie on it, whatever rounding makes of them.
    size = abs(value) * (1.0 + 1e-9)
    grade = (
        DefectSeverity.GROSS
        if size >= gross
        else DefectSeverity.MARGINAL
        if size >= marginal
        else DefectSeverity.SLIGHT
    )
    return grade, size / marginal, FunctionCost(grade, name, value)


def _quantities(sound: VirtualMotor, bad: VirtualMotor, rating: RatedPoint) -> Iterator[tuple[str, float]]:
    torque = rating.torque(sound)
    shares = [emf * turns for emf, turns in zip(bad.emf_shares, bad.turn_shares, strict=True)]
    short_heat = _short_heat(bad, rating.speed)
    per_ampere = bad.flux_linkage / sound.flux_linkage * sum(shares) / 3.0
    yield "torque", per_ampere - 1.0
    # A delta's windings carry 1/√3 of the lines' current.
    current = rating.current / (math.sqrt(3.0) if sound.connection == "delta" else 1.0)
    hottest = 0.0
    for number, (own, usual) in enumerate(zip(bad.phase_resistances, sound.phase_resistances, strict=True)):
        loss = 0.5 * usual * current**2
        short = bad.shorted_turns is not None and bad.shorted_turns.winding == number
        hottest = max(hottest, own / usual / per_ampere**2 + (short_heat / loss if short else 0.0) - 1.0)
    yield "heat", hottest
    drag = bad.coulomb_friction + bad.viscous_friction * rating.speed + 0.5 * bad.rubbing_torque
    drag += short_heat / rating.speed - sound.coulomb_friction - sound.viscous_friction * rating.speed
    yield "drag", drag / torque
    harmonics = sum(amplitude for order, amplitude, _ in bad.flux_harmonics if order % 2 == 0)
    harmonics -= sum(amplitude for order, amplitude, _ in sound.flux_harmonics if order % 2 == 0)
    cogging = (bad.cogging_torque - sound.cogging_torque) / torque
    yield "ripple", cogging + harmonics + max(shares) - min(shares)
    if bad.halls is not None and sound.halls is not None:
        turned = bad.halls.offset - sound.halls.offset
        places = zip(bad.halls.placements, sound.halls.placements, strict=True)
        yield "commutation", math.degrees(max(abs(turned + own - usual) for own, usual in places))


def _short_heat(motor: VirtualMotor, speed: float) -> float:
    """Return the heat (W) of a winding's shorted turns at a speed (rad/s), terminals open."""
    short = motor.shorted_turns
    if short is None:
        return 0.0
    turns = motor.turn_shares[short.winding]
    inductance = turns**2 * (motor.d_axis_inductance + motor.q_axis_inductance + motor.winding_zero_sequence_inductance)
    flux = motor.pole_pairs * motor.flux_linkage * turns * motor.emf_shares[short.winding]
    slope, corner = short.brake(motor.phase_resistances[short.winding], inductance / 3.0, flux)
    return slope * speed**2 / (1.0 + (speed * motor.pole_pairs / corner) ** 2)


def _halls_wrong(motor: VirtualMotor) -> bool:
    halls = motor.halls
    return halls is not None and bool(halls.stuck or halls.inverted or halls.order != (1, 2, 3))
