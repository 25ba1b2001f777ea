"""Notation of units: names of the SI and what is used beside it, with prefixes, multiplied by · and divided by /."""

import re

#: Those that may have a prefix, and those that may not.
_PREFIXED = "g m s A K mol cd rad sr Hz N Pa J W C V F Ω S Wb T H lm lx L eV Ah Wh VA var bar rpm"
_ALONE = "1 % ‰ ppm dB °C ° min h d"
_FACTOR = re.compile(f"√?([pnuµμmkMGT]?({_PREFIXED.replace(' ', '|')})|{_ALONE.replace(' ', '|')})⁻?[⁰¹²³⁴⁵⁶⁷⁸⁹]*")
ALLOWED_UNITS = (
    f"{_PREFIXED} (also with one of the prefixes p n µ m k M G T) and {_ALONE}, with exponents as in m², √ before a factor, "
    "multiplied by · and divided by /, as in V·s/rad"
)


def is_unit(written: str) -> bool:
    """Tell whether a text is a unit as results have it: Ω, V·s/rad, kg·m², N·m/√W, 1/K."""
    return all(_FACTOR.fullmatch(factor) for factor in re.split("[·/]", written))
