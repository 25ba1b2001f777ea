"""The power balance of a steady state, and the averages over T1T2 that the document's tables list."""

import math
from dataclasses import dataclass

from sim_instruments.six_step.circuit import Idle, Observables, Real
from sim_instruments.six_step.segment import ConductionSegment
from sim_instruments.six_step.steady_state import SteadyState


@dataclass(frozen=True)
class Losses:
    """Average losses in W: windings, transistors, diodes, the source's resistance and the bearings."""

    copper: float
    switches: float
    diode: float
    source: float
    friction: float

    @property
    def total(self) -> float:
        """Sum of all losses in W."""
        return self.copper + self.switches + self.diode + self.source + self.friction


@dataclass(frozen=True)
class BranchVoltages:
    """Average voltages in V of one way from leg 1 to leg 3, counted in the direction of the current.

    `terminal` is computed from the legs, not as the sum of the others. `mutual_inductance` keeps the document's two
    terms apart.
    """

    emf: float
    resistance: float
    self_inductance: float
    mutual_inductance: tuple[float, float]
    terminal: float


@dataclass(frozen=True)
class SupplyVoltages:
    """Average voltages in V from the source to the conducting legs.

    `switches_at_supply_current` is the document's I_s·2·R_t; `switches` is what the two transistors drop in truth,
    more by R_t times the average freewheel current, which T1 carries and the supply does not.
    """

    switches_at_supply_current: float
    switches: float
    source_resistance: float
    source: float


def losses(steady: SteadyState) -> Losses:
    """Average losses of a steady state, exact integrals over T1T2."""
    drive = steady.drive
    products = steady.product_averages
    currents = products[Observables.currents, Observables.currents]
    switches = diode = 0.0
    for segment in steady.segments:
        in_switches, in_diodes = _bridge_losses(steady, segment)
        switches += in_switches
        diode += in_diodes
    return Losses(
        copper=drive.resistance * float(currents.trace()),
        switches=switches / steady.state_time,
        diode=diode / steady.state_time,
        source=drive.source_resistance * float(products[Observables.supply_current, Observables.supply_current]),
        friction=drive.friction_torque(steady.speed) * steady.speed,
    )


def _bridge_losses(steady: SteadyState, segment: ConductionSegment) -> tuple[float, float]:
    """Energy in J that transistors and diodes take during a segment."""
    drive, conduction = steady.drive, segment.circuit.conduction
    observables = segment.circuit.observables
    line: Real = segment.integrals(observables)[Observables.line_currents]
    squares = segment.product_integrals(observables)[Observables.line_currents, Observables.line_currents]
    switches = 0.0
    diode = 0.0 if conduction.idle is Idle.OPEN else drive.diode_drop * abs(float(line[1]))
    for leg, clamped in ((0, conduction.upper_clamped), (2, conduction.lower_clamped)):
        if clamped:
            channel = drive.diode_drop**2 / drive.switch_resistance * segment.duration
            switches += channel
            diode += drive.diode_drop * abs(float(line[leg])) - channel
        else:
            switches += drive.switch_resistance * float(squares[leg, leg])
    return switches, diode


def power_residual(steady: SteadyState) -> float:
    """Give what is missing between supply power, losses and shaft power, relative to the largest of them."""
    lost = losses(steady)
    supplied = steady.drive.source_voltage * steady.average_supply_current
    shaft = steady.load_torque * steady.speed
    largest = max(abs(supplied), abs(shaft), lost.copper, lost.switches, lost.diode, lost.source, lost.friction)
    return (supplied - lost.total - shaft) / largest


def branches(steady: SteadyState) -> dict[str, BranchVoltages]:
    """Average voltages of the ways from leg 1 to leg 3: "c" and "ab" of a delta, "ac" of a wye (tables 1 and 2)."""
    drive, time = steady.drive, steady.state_time
    current, emf = steady.averages[Observables.currents], steady.averages[Observables.emfs]
    leg = steady.averages[Observables.leg_voltages]
    change = (steady.end_currents - steady.start_currents) / time
    terminal = float(leg[0] - leg[2])
    R, L11, L12 = drive.resistance, drive.self_inductance, drive.mutual_inductance

    def branch(direction: tuple[int, int, int], first: float, second: float) -> BranchVoltages:
        through = sum(d * float(i) for d, i in zip(direction, current, strict=True))
        back = sum(d * float(e) for d, e in zip(direction, emf, strict=True))
        rise = sum(d * float(s) for d, s in zip(direction, change, strict=True))
        return BranchVoltages(back, R * through, L11 * rise, (L12 * first, L12 * second), terminal)

    a, b, c = (float(value) for value in change)
    if drive.connection == "delta":
        return {"c": branch((0, 0, -1), -a, -b), "ab": branch((1, 1, 0), a + b, 2 * c)}
    return {"ac": branch((1, 0, -1), c, -a)}


def supply_voltages(steady: SteadyState) -> SupplyVoltages:
    """Average voltages between the source and the conducting legs (the tables' supply column)."""
    drive, averages = steady.drive, steady.averages
    leg = averages[Observables.leg_voltages]
    current = steady.average_supply_current
    return SupplyVoltages(
        switches_at_supply_current=current * 2 * drive.switch_resistance,
        switches=steady.average_bus_voltage - float(leg[0] - leg[2]),
        source_resistance=current * drive.source_resistance,
        source=drive.source_voltage,
    )


def winding_rms(steady: SteadyState) -> Real:
    """Effective currents of the windings a, b, c over T1T2, in A, shape (3,)."""
    return steady.product_averages.diagonal()[Observables.currents] ** 0.5


def equivalent_resistance(steady: SteadyState, winding: int) -> tuple[float, float]:
    """R_11r and R_11L of a winding (0, 1, 2) over T1T2, in Ω.

    R_11r = R_11·(I_eff/I_av)² is loss; R_11L = (L11 − L12)/(2τ)·(i_τ² − i_0²)/I_av² is exchange of stored energy (§7,
    E12, E14). They hold while the winding currents add up to zero, so not with triplen EMF harmonics in a delta.
    Raises ValueError for a winding whose average current is zero.
    """
    average = float(steady.averages[Observables.currents][winding])
    if average == 0 or not math.isfinite(average):
        raise ValueError(f"winding {winding} has an average current of {average:g} A: its resistance is not defined")
    drive = steady.drive
    effective = drive.resistance * float(winding_rms(steady)[winding]) ** 2 / average**2
    stored = float(steady.end_currents[winding] ** 2 - steady.start_currents[winding] ** 2)
    inductance = drive.self_inductance - drive.mutual_inductance
    return effective, inductance / (2 * steady.state_time) * stored / average**2
