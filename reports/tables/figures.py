"""Figures as engineers write them: a prefix that fits, as many digits as the uncertainty carries."""

import math
import re
from dataclasses import dataclass

#: Units that take a prefix, at the beginning of a product or quotient too, but not where it is a rate per revolutions.
_PREFIXED = {"Ω", "H", "Wb", "N", "A", "V", "F", "W", "J", "C", "S", "T"}
_PREFIXES = ((1e9, "G"), (1e6, "M"), (1.0, ""), (1e-3, "m"), (1e-6, "µ"), (1e-9, "n"))
#: The hyphen before a number that stands by itself, also behind a bracket or a comma of either language.
_NEGATIVE = re.compile(r"(?:(?<=^)|(?<=[\s(\[±（，、：]))-(?=\d)")
_RAISED = str.maketrans("-0123456789", "⁻⁰¹²³⁴⁵⁶⁷⁸⁹")
#: Inertia has its prefix in the square length: kg·mm² is 1e-6 kg·m².
_SMALL_INERTIA = 1e-2


@dataclass(frozen=True)
class Scale:
    """Factor by which a figure in SI is divided, and the unit that then stands behind it."""

    factor: float
    unit: str


def scale_of(value: float, unit: str) -> Scale:
    """Return the scale in which the figure lies between 1 and 1000, above a million for large ones, where its unit takes a prefix."""
    size = abs(value)
    if unit == "1":
        return Scale(1.0, "")
    if unit == "kg·m²" and 0.0 < size < _SMALL_INERTIA:
        return Scale(1e-6, "kg·mm²")
    if re.split("[·/]", unit)[0] not in _PREFIXED or "rpm" in unit or not size:
        return Scale(1.0, unit)
    for factor, prefix in _PREFIXES:
        # Figures down to a tenth read well without a prefix, as 0.034 V·s/rad does not.
        if size >= factor * 0.9995:
            return Scale(factor, prefix + unit)
    factor, prefix = _PREFIXES[-1]
    return Scale(factor, prefix + unit)


def decimals_for(uncertainty: float, value: float, digits: int = 2) -> int:
    """Return the decimals that show `digits` significant ones of the uncertainty; without one, four of the value."""
    if uncertainty > 0.0 and math.isfinite(uncertainty):
        return max(0, digits - 1 - math.floor(math.log10(uncertainty)))
    if value and math.isfinite(value):
        if value == round(value):
            return 0
        return max(0, 3 - math.floor(math.log10(abs(value))))
    return 0


def figure(value: float | None, decimals: int) -> str:
    """Return a figure with its decimals; a dash for none."""
    if value is None or math.isnan(value):
        return "–"
    return with_minus(f"{value:.{decimals}f}")


def with_minus(words: str) -> str:
    """Return words whose numbers have a minus where they had a hyphen; names and dates keep theirs."""
    return _NEGATIVE.sub("−", words)


def general(value: float, digits: int) -> str:
    """Return a figure with so many significant digits at most, as a product with a power of ten where it is very small or large."""
    mantissa, _, exponent = f"{value:.{digits}g}".partition("e")
    return with_minus(f"{mantissa}·10{str(int(exponent)).translate(_RAISED)}" if exponent else mantissa)


def percent(relative: float) -> str:
    """Return a relative uncertainty in per cent with two significant digits."""
    if not math.isfinite(relative) or relative <= 0.0:
        return "–"
    return f"{100.0 * relative:.{decimals_for(100.0 * relative, 0.0)}f}"
