"""Numbers in a form for readers."""

_PREFIXES = ((1e9, "G"), (1e6, "M"), (1e3, "k"))
#: From here on digits are counted rather than read.
_LONG = 1e5


def short(value: float, unit: str = "") -> str:
    """Return a number, with its `unit` where one is given: 200 MΩ rather than 2e+08 Ω."""
    for factor, prefix in _PREFIXES:
        if abs(value) >= max(_LONG, factor):
            return f"{value / factor:g} {prefix}{unit}"
    return f"{value:g} {unit}".rstrip()
