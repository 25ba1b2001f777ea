"""The last step of both dynamic pole-pair methods: p = 60 f / n."""

import math
from typing import Any

from GTC import ureal

from drivers.interfaces import Reading
from drivers.interfaces.text import text
from procedures.core.bench import Bench, ProcedureError
from procedures.core.procedure import Procedure
from procedures.estimation.fitting.misfit import NO_MISFIT, Answer, Cause, Finding, Misfit
from procedures.estimation.mechanics import pole_pairs
from procedures.estimation.mechanics.pole_pairs import FrequencyRatio

#: rpm in a rad/s.
_RPM = 30.0 / math.pi
#: A ratio further than this from a whole number is a slip, whatever the instruments state.
_ASIDE = 0.25


def known_pole_pairs(procedure: Procedure[Any]) -> float:
    """Return the number of pole pairs as counted before, or as the motor file has it.

    Raises ProcedureError where neither says it.
    """
    plate = procedure.nameplate
    pairs = procedure.known_value("pole_pairs") or plate.pole_pairs or plate.expected.get("pole_pairs")
    if not pairs:
        raise ProcedureError(
            text(
                "the number of pole pairs is not known: give pole_pairs in the motor file, or run a procedure that counts them before"
            )
        )
    return float(pairs)


def frequency_reading(bench: Bench, channel: int) -> Reading | None:
    """Return the frequency (Hz) read off the screen where the oscilloscope can give no waveform, else None."""
    scope = bench.oscilloscope
    return None if scope.gives_waveforms else scope.measure_frequency(channel)


def ratio(frequency: float, uncertainty: float, speed: Reading) -> FrequencyRatio:
    """Return 60·f/n from electrical frequency (Hz, with its uncertainty) and the tachometer's reading (rad/s).

    Raises ProcedureError where the shaft stands.
    """
    speed_rpm = speed.value * _RPM
    if speed_rpm < 1.0:
        raise ProcedureError(
            text(
                "the tachometer reads {speed:.3g} rpm at {frequency:.4g} Hz: the rotor does not turn. Lower the frequency or "
                "raise the current; the inverter's DC link may be too low for the motor at this frequency",
                speed=speed_rpm,
                frequency=frequency,
            )
        )
    half_width = (speed.accuracy.gain * speed.value + speed.accuracy.offset + speed.accuracy.resolution) * _RPM
    return pole_pairs.from_frequency(frequency, speed_rpm, uncertainty, half_width)


def is_clear(found: FrequencyRatio) -> bool:
    """Tell whether the ratio stands for one whole number and no other."""
    return found.certain and abs(found.ratio - found.pole_pairs) <= _ASIDE


def count(
    procedure: Procedure[Any],
    frequency: float,
    uncertainty: float,
    speed: Reading,
    *,
    section: str,
    slower: tuple[int, float] | None = None,
) -> None:
    """Report pole pairs from electrical frequency (Hz, with its uncertainty) and the tachometer's reading (rad/s).

    `slower` is a wave of the second or third part of the frequency beside it, and its share: where it gives a whole number too, the
    count is withheld. Raises ProcedureError where the shaft stands, or the two figures allow no whole number or more than one.
    """
    found = ratio(frequency, uncertainty, speed)
    speed_rpm = speed.value * _RPM
    procedure.findings |= {
        "frequency": frequency,
        "speed_rpm": speed_rpm,
        "ratio": found.ratio,
        "certain": found.certain,
    }
    if not is_clear(found):
        raise ProcedureError(
            text(
                "60·f/n = {ratio:.3f} at {frequency:.4g} Hz and {speed:.4g} rpm is, within the uncertainty of both, not clearly one whole "
                "number; turn faster, read the speed with more digits, or check that it is the speed of the motor and not of a gearbox",
                ratio=found.ratio,
                frequency=frequency,
                speed=speed_rpm,
            )
        )
    misfit = NO_MISFIT
    if slower is not None and found.pole_pairs % slower[0] == 0:
        part, share = slower
        figures: dict[str, float | str] = {
            "record": "frequency",
            "frequency": frequency,
            "pairs": float(found.pole_pairs),
            "slower": frequency / part,
            "fewer": float(found.pole_pairs // part),
            "share": share,
        }
        misfit = Misfit((Finding(Cause.WRONG_PERIOD, Answer.WITHHELD, ("pole_pairs",), figures=figures),))
    procedure.report(
        "pole_pairs",
        ureal(float(found.pole_pairs), 0.0),
        section=section,
        estimator="nearest whole number to 60 f / n",
        note_value=found.ratio,
        misfit=misfit,
    )
