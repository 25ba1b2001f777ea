"""The conformity of a motor with its type: each figure with its interval against the type's value and tolerance."""

from enum import Enum

from drivers.interfaces.text import Text, text
from procedures.core.nameplate import Nameplate
from procedures.core.parameter_set import ParameterSet
from procedures.core.result import Notice, Parameter


class Conformity(Enum):
    """The result of comparing an interval with a tolerance (ISO 14253-1): `OPEN` if it lies on both sides of a limit."""

    WITHIN = "within"
    OPEN = "open"
    OUTSIDE = "outside"


def conformity(parameter: Parameter, expected: float, tolerance: float) -> Conformity:
    """Hold a figure's 95 % interval against the type's value (its unit), give or take the share `tolerance` of it."""
    least, most = sorted((expected * (1.0 - tolerance), expected * (1.0 + tolerance)))
    low, high = parameter.coverage_interval
    if least <= low and high <= most:
        return Conformity.WITHIN
    return Conformity.OUTSIDE if high < least or low > most else Conformity.OPEN


def held_against_type(found: ParameterSet, nameplate: Nameplate) -> list[Notice]:
    """Return a warning for every measured figure that is not proved to be within its type's tolerance."""
    said = {
        Conformity.OUTSIDE: text("{label} is {deviation:+.3g} % off the type's value, outside its ±{tolerance:g} %"),
        Conformity.OPEN: text(
            "{label} is {deviation:+.3g} % off the type's value; its interval shows it neither within "
            "±{tolerance:g} % nor outside"
        ),
    }
    notices = []
    for name, tolerance in nameplate.tolerance.items():
        parameter, expected = found.parameters.get(name), nameplate.expected.get(name)
        if parameter is None or not expected or parameter.source != "measured":
            continue
        verdict = conformity(parameter, expected, tolerance)
        if verdict is Conformity.WITHIN:
            continue
        values = {
            "label": parameter.label,
            "deviation": 100.0 * (parameter.value / expected - 1.0),
            "tolerance": 100.0 * tolerance,
        }
        notices.append(Notice("type-tolerance", Text(said[verdict].template, values)))
    return notices
