"""Limits of a station's instruments that are reported before anything is energised."""

import math

from drivers.interfaces import Accuracy
from drivers.interfaces.text import Text, text
from procedures.core.bench import Role
from procedures.core.result import Notice

_RECTANGULAR = 1.0 / math.sqrt(3.0)


def relative_uncertainty(accuracy: Accuracy, value: float) -> float:
    """Return the relative standard uncertainty that limits of error leave to a reading of `value` (not 0)."""
    return _RECTANGULAR * math.hypot(accuracy.gain, accuracy.offset / abs(value))


def temperature_uncertainty(half_width: float, coefficient: float, reference: float, temperature: float) -> float:
    """Return the relative standard uncertainty of a resistance whose temperature (°C) is known within ± `half_width` (K)."""
    return _RECTANGULAR * half_width * coefficient / (1.0 + coefficient * (temperature - reference))


def cannot_support(
    procedure: str, instrument: Role, conditions: Text, *, gives: float, asked: float, remedy: Text
) -> Notice:
    """Return the warning that an instrument cannot support what is asked for: relative standard uncertainties, and what would do."""
    return Notice(
        "cannot-support",
        text(
            "{procedure}: the {instrument} {conditions} can give {gives:.2g} %, and {asked:.2g} % is asked for (relative standard "
            "uncertainty); {remedy}",
            procedure=procedure,
            instrument=Text(instrument.value),
            conditions=conditions,
            gives=100.0 * gives,
            asked=100.0 * asked,
            remedy=remedy,
        ),
    )
