"""Records whose times are in another unit than the file says: told where physics knows what they cannot be."""

from collections.abc import Iterable

from bench.analysis.outcome import AnalysisOutcome
from drivers.interfaces.text import text

#: Time constants of windings (s): 0.1 ms to 100 ms, a toy's some 10 µs; large machines' some more.
_TIME_CONSTANTS = (5e-6, 0.1)
#: Electrical frequencies (Hz) at which a back-EMF is recorded: below, it is turned slower than a hand does; above, faster than motors go.
_FREQUENCIES = (1.0, 20e3)
#: A tachometer's speed that agrees to this share confirms a frequency: units are wrong by more.
_CONFIRMED = 0.1
#: How long (s) a shaft takes to come to rest.
_COASTS = (0.05, 1800.0)


def warn_of_time_constant(outcome: AnalysisOutcome, seconds: float) -> None:
    """Ask about a winding's time constant (s) that none has."""
    least, most = _TIME_CONSTANTS
    if seconds > most:
        outcome.warn(
            text(
                "the time constant is {tau:.3g} s, where windings have 0.1 ms to 100 ms: is the time column really in seconds? Times in ms "
                "under a heading in s make the inductance a thousand times too large, and nothing else in the record shows it",
                tau=seconds,
            ),
            "long-time-constant",
        )
    elif seconds < least:
        outcome.warn(
            text(
                "the time constant is {tau:.3g} s, where windings have 0.1 ms to 100 ms: is the time column really in its heading's unit? "
                "Times in s under a heading in ms make the inductance a thousand times too small, and nothing else in the record shows it",
                tau=seconds,
            ),
            "short-time-constant",
        )


def judge_frequency(outcome: AnalysisOutcome, frequency: float, speed: float | None, withheld: Iterable[str]) -> None:
    """Give none of `withheld` where nobody records a back-EMF at such an electrical frequency (Hz), unless the rotor's `speed`, in
    electrical turns a second (None where it is not known), says that it is so.
    """
    least, most = _FREQUENCIES
    if least <= frequency <= most or (speed is not None and abs(frequency / speed - 1.0) < _CONFIRMED):
        return
    outcome.withhold(
        withheld,
        "unlikely-frequency",
        text(
            "the electrical frequency is {frequency:.3g} Hz, where motors are turned at 1 Hz to 20 kHz: is the time column in its "
            "heading's unit? A unit off by a thousand makes the flux linkage wrong by as much; --speed-rpm with --pole-pairs confirms the "
            "frequency where it is right",
            frequency=frequency,
        ),
    )


def warn_of_coast(outcome: AnalysisOutcome, seconds: float) -> None:
    """Ask about a coast-down of a length (s) that no motor's shaft takes."""
    least, most = _COASTS
    if not least <= seconds <= most:
        outcome.warn(
            text(
                "the coast-down lasts {seconds:.3g} s, where motors take 0.05 s to half an hour: is the time column in its heading's unit? "
                "A unit off by a thousand makes every deceleration wrong by as much",
                seconds=seconds,
            ),
            "unlikely-coast",
        )
