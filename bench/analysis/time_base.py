"""Detects times in another unit than the file states, by the physically possible ranges."""

from collections.abc import Iterable, Mapping
from typing import Literal

from bench.analysis.outcome import AnalysisOutcome
from bench.captures import Capture
from drivers.interfaces.text import Text, text

#: Time constants of windings (s): 0.1 ms to 100 ms, a toy's some 10 µs; large machines' some more.
_TIME_CONSTANTS = (5e-6, 0.1)
#: Electrical frequencies (Hz) at which a back-EMF is recorded: below, it is turned slower than a hand does; above, faster than motors go.
_FREQUENCIES = (1.0, 20e3)
#: Samples a period below which a back-EMF may be one of a frequency beyond half the sampling rate, and below which no figure is given.
_SAMPLES, _LEAST_SAMPLES = 20, 4
#: A tachometer's speed that agrees to this share confirms a frequency: units are wrong by more.
CONFIRMED = 0.1
#: How long (s) a shaft takes to come to rest.
_COASTS = (0.05, 1800.0)
#: What a record shows of its time: what it is called, its unit and limits, and the power of the time's unit that it goes with.
_SHOWN: Mapping[str, tuple[Text, str, tuple[float, float], int]] = {
    "frequency": (text("the electrical frequency"), "Hz", _FREQUENCIES, -1),
    "time constant": (text("the time constant"), "s", _TIME_CONSTANTS, 1),
    "coast": (text("the length of the coast-down"), "s", _COASTS, 1),
}


def judge_open_time(
    outcome: AnalysisOutcome,
    capture: Capture,
    kind: Literal["frequency", "time constant", "coast"],
    shown: float,
    names: Iterable[str],
) -> bool:
    """Give none of these parameters where nobody said the unit of time, and what the record shows (Hz or s, its times read in s) is what
    motors have with times in ms as well; return whether it is so.
    """
    what, unit, (least, most), power = _SHOWN[kind]
    in_ms = shown * 1e-3**power
    if not capture.time_unit_open or not least <= in_ms <= most:
        return False
    outcome.withhold(
        names,
        "time-unit-open",
        text(
            "the unit of time is not stated: {what} is {in_s:.3g} {unit} for times in s and {in_ms:.3g} {unit} "
            "for times in ms, and motors can have both. Give --time-unit s or --time-unit ms, or write the unit "
            "into the heading, as in 'time (s)'",
            what=what,
            in_s=shown,
            in_ms=in_ms,
            unit=unit,
        ),
    )
    return True


def warn_of_time_constant(outcome: AnalysisOutcome, seconds: float) -> None:
    """Ask about a winding's time constant (s) that none has."""
    least, most = _TIME_CONSTANTS
    if seconds > most:
        outcome.warn(
            text(
                "the time constant is {tau:.3g} s, but windings have 0.1 ms to 100 ms. Is the time column in "
                "seconds? Times in ms under a heading in s make the inductance 1000 times too large; no other "
                "sign shows it",
                tau=seconds,
            ),
            "long-time-constant",
        )
    elif seconds < least:
        outcome.warn(
            text(
                "the time constant is {tau:.3g} s, but windings have 0.1 ms to 100 ms. Is the time column in the "
                "unit of its heading? Times in s under a heading in ms make the inductance 1000 times too small; "
                "no other sign shows it",
                tau=seconds,
            ),
            "short-time-constant",
        )


def judge_frequency(outcome: AnalysisOutcome, frequency: float, speed: float | None, withheld: Iterable[str]) -> None:
    """Give none of `withheld` where nobody records a back-EMF at such an electrical frequency (Hz), unless the rotor's `speed`, in
    electrical turns a second (None where it is not known), says that it is so.
    """
    least, most = _FREQUENCIES
    if least <= frequency <= most or (speed is not None and abs(frequency / speed - 1.0) < CONFIRMED):
        return
    outcome.withhold(
        withheld,
        "unlikely-frequency",
        text(
            "the electrical frequency is {frequency:.3g} Hz, but motors are turned at 1 Hz to 20 kHz. Is the "
            "time column in the unit of its heading? A unit wrong by a factor of 1000 makes the flux linkage "
            "wrong by the same factor. If the frequency is right, confirm it with --speed-rpm and --pole-pairs",
            frequency=frequency,
        ),
    )


def judge_sampling(
    outcome: AnalysisOutcome, frequency: float, rate: float, speed: float | None, withheld: Iterable[str]
) -> None:
    """Say that a frequency (Hz) sampled at a `rate` (Hz) only few times a turn may be another's, and give none of `withheld` at hardly any
    samples, unless the rotor's `speed`, in electrical turns a second (None where it is not known), says that it is so.

    One beyond half the rate folds back without a trace: this asks where that is likely, for it may lie anywhere below half the rate.
    """
    each = rate / frequency
    if each >= _SAMPLES or (speed is not None and abs(frequency / speed - 1.0) < CONFIRMED):
        return
    why = text(
        "a period has only {each:.3g} samples: {frequency:.4g} Hz and {folded:.4g} Hz give the same samples at {rate:.6g} "
        "samples a second, and the flux linkage follows the frequency. Record {wanted} samples a period or more, or "
        "confirm the frequency with --speed-rpm and --pole-pairs",
        each=each,
        frequency=frequency,
        folded=rate - frequency,
        rate=rate,
        wanted=_SAMPLES,
    )
    if each < _LEAST_SAMPLES:
        outcome.withhold(withheld, "few-samples", why)
    else:
        outcome.warn(why, "few-samples")


def warn_of_coast(outcome: AnalysisOutcome, seconds: float, inertia: float | None = None) -> None:
    """Ask about a coast-down of a length (s) that no motor's shaft takes, where it is known one of such an inertia (kg·m²)."""
    least, most = _COASTS
    if inertia is not None and seconds > most * min(1.0, inertia ** (1.0 / 3.0)) and seconds <= most:
        outcome.warn(
            text(
                "the coast-down lasts {seconds:.3g} s, but a shaft of {inertia:.3g} kg·m² comes to rest within "
                "{most:.3g} s. Is the time column in the unit of its heading, and the inertia in kg·m²? A unit "
                "wrong by a factor of 1000 makes the friction wrong by the same factor",
                seconds=seconds,
                inertia=inertia,
                most=most * inertia ** (1.0 / 3.0),
            ),
            "unlikely-coast",
        )
    if not least <= seconds <= most:
        outcome.warn(
            text(
                "the coast-down lasts {seconds:.3g} s, but motors take 0.05 s to half an hour. Is the time "
                "column in the unit of its heading? A unit wrong by a factor of 1000 makes every deceleration "
                "wrong by the same factor",
                seconds=seconds,
            ),
            "unlikely-coast",
        )
