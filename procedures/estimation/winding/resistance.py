"""Stator resistance from line readings, its temperature, and the slope of voltage over current (§3.2)."""

from collections.abc import Sequence
from typing import NamedTuple

import numpy as np
from numpy.typing import ArrayLike

from procedures.estimation.fitting.checks import positive, same_length, series
from procedures.estimation.fitting.fit import EstimationError, Fit, FloatArray
from procedures.estimation.fitting.linear import least_squares
from procedures.estimation.winding.connections import Connection, ReadingConnection, phase_factor


class LineMean(NamedTuple):
    """Mean resistance (Ω) of a winding, and of one leg of the equivalent wye."""

    winding: float
    y_equivalent: float


def phase_resistances(ab: float, bc: float, ca: float, connection: Connection) -> tuple[float, float, float]:
    """Solve three line-to-line readings (Ω) for the three windings: A, B, C of a wye; AB, BC, CA of a delta.

    Raises EstimationError where no three positive resistances give such readings.
    """
    for name, value in (("R_AB", ab), ("R_BC", bc), ("R_CA", ca)):
        positive(name, value, "Ω")
    a, b, c = (ab + ca - bc) / 2, (ab + bc - ca) / 2, (bc + ca - ab) / 2
    if min(a, b, c) <= 0:
        raise EstimationError(
            f"R_AB = {ab:g}, R_BC = {bc:g}, R_CA = {ca:g} Ω: one exceeds the sum of the other two, which no winding does; "
            "check contacts and leads and read again"
        )
    phase_factor(connection, ReadingConnection.LINE_TO_LINE)
    if connection == "wye":
        return a, b, c
    products = a * b + b * c + c * a
    return products / c, products / a, products / b


def from_lines(ab: float, bc: float, ca: float, connection: Connection) -> LineMean:
    """Return winding and equivalent-wye resistance (Ω) from the mean of three line readings (Ω; §3.2.2, erratum E8)."""
    for name, value in (("R_AB", ab), ("R_BC", bc), ("R_CA", ca)):
        positive(name, value, "Ω")
    factor = phase_factor(connection, ReadingConnection.LINE_TO_LINE)
    mean = (ab + bc + ca) / 3
    return LineMean(factor.winding * mean, factor.y_equivalent * mean)


def at_temperature(
    resistance: float, measured_at: float, to: float, coefficient: float = 0.00393, reference: float = 20.0
) -> float:
    """Refer a resistance (Ω) from one temperature (°C) to another (§3.2.1, erratum E7).

    `coefficient` (1/K) holds at `reference` (°C); the default is copper's. The note's rule is 0.004 at 25 °C.
    """
    if not all(np.isfinite(x) for x in (resistance, measured_at, to, coefficient, reference)):
        raise EstimationError("a temperature or the resistance is missing; enter the winding's temperature")
    present = 1 + coefficient * (measured_at - reference)
    wanted = 1 + coefficient * (to - reference)
    if present <= 0 or wanted <= 0:
        raise EstimationError(
            f"{measured_at:g} °C → {to:g} °C is outside the range of a linear temperature coefficient"
        )
    return resistance * wanted / present


def unbalance(lines: Sequence[float]) -> float:
    """Return the largest deviation of a line reading from their mean, relative to the mean."""
    readings = series("line readings", lines, least=2)
    mean = positive("mean of the line readings", float(np.mean(readings)), "")
    return float(np.max(np.abs(readings - mean))) / mean


def slope(
    voltage: ArrayLike, current: ArrayLike, *, voltage_resolution: float = 0.0, both_polarities: bool = True
) -> Fit:
    """Fit V = resistance·I + offset to four-wire readings (V, A, shape (n,)); names `resistance`, `offset`.

    The offset takes thermal EMF and the meter's zero, for which currents of both signs are required unless
    `both_polarities` is False. Raises EstimationError on too few points or one current only.
    """
    v, i = series("voltage", voltage, least=3), series("current", current, least=3)
    same_length(voltage=v, current=i)
    if both_polarities and not (i.min() < 0 < i.max()):
        raise EstimationError("all currents have one sign; take readings with both polarities")
    if np.ptp(i) <= 1e-9 * np.max(np.abs(i)):
        raise EstimationError("all currents are alike; take readings at several currents")
    fit = least_squares(
        ("resistance", "offset"), np.column_stack((i, np.ones_like(i))), v, resolution=voltage_resolution
    )
    if fit.value("resistance") <= 0:
        raise EstimationError(
            "the voltage falls as the current rises: one of the two meters is connected the wrong way round"
        )
    return fit


def drift(blocks: Sequence[tuple[FloatArray, FloatArray, FloatArray]]) -> Fit:
    """Fit how fast the resistances of several pairs of terminals change together (`drift`, relative, 1/s).

    A block is one pair's time (s), current (A) and voltage (V), each of shape (n,). Every pair has its own resistance, thermal
    voltage and offset of the current's meter. Raises EstimationError on too few points.
    """
    names, columns, changing = [], [], []
    sizes = [len(time) for time, _, _ in blocks]
    places = np.cumsum([0, *sizes])
    for k, (time, current, voltage) in enumerate(blocks):
        whole = np.zeros((places[-1], 3))
        whole[places[k] : places[k + 1]] = np.column_stack((current, np.ones_like(current), -np.sign(current)))
        columns.append(whole)
        names += [f"resistance {k}", f"offset {k}", f"meter {k}"]
        changing.append(slope(voltage, current).value("resistance") * current * (time - blocks[0][0][0]))
    design = np.column_stack((np.concatenate(changing), *columns))
    return least_squares(("drift", *names), design, np.concatenate([voltage for _, _, voltage in blocks]))
