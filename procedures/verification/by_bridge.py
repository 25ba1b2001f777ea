"""Verification by an LCR meter: its test signal harms nothing and turns nothing."""

from collections.abc import Sequence
from dataclasses import dataclass

from drivers.interfaces import Aperture, ImpedanceReading, LcrMeter, OverloadError, Wanted
from drivers.interfaces.text import Text, text
from procedures.core.actions import Connect
from procedures.estimation.fitting.intervals import Interval, around
from procedures.estimation.winding.wiring import Kind, Leads, Mistake, Outcome, Pole, mistakes, odd_line
from procedures.verification.check import Check, mistake_record, records
from procedures.verification.lines import Reference
from procedures.verification.two_poles import NO_PATH, THIRD, alike, expected, loop, poles_of
from procedures.verification.two_poles import judged as judged_alike

#: Clips against each other read within so many limits of error of zero, and this (Ω) where no more is stated.
_ZERO, _CONTACT = 2.0, 1e-3
#: Of the limit of error, so much may differ between a reading and a like one.
_DIFFERING = 1.0 / 3.0


@dataclass(frozen=True)
class BridgeSettings:
    """What a bridge is set to: frequency (Hz), level (V rms) and measurement time."""

    frequency: float
    level: float
    aperture: Aperture


def read(bridge: LcrMeter) -> ImpedanceReading | None:
    """Take one reading; None where the bridge finds no path."""
    try:
        return bridge.measure(Wanted.RESISTANCE)
    except OverloadError:
        return None


def like(reading: ImpedanceReading) -> Interval:
    """Return a resistance (Ω) within what a like reading of the same instrument may differ by."""
    accuracy = reading.resistance_accuracy
    return around(reading.resistance, gain=_DIFFERING * accuracy.gain, offset=_DIFFERING * accuracy.offset)


def judged(connect: Connect, reading: ImpedanceReading | None, reference: Reference | None) -> Check:
    """Hold a bridge's reading against the connection as told; `reference` is at the reading's own frequency, or None."""
    told: dict[str, float] = {}
    resistance, touching = NO_PATH, Interval(0.0, _CONTACT)
    if reading is not None:
        accuracy = reading.resistance_accuracy
        # What the instrument may be off by is in a reference of its own: then only what makes two like readings differ counts.
        gain, offset = (0.0, 0.0) if reference is None or reference.own else (accuracy.gain, accuracy.offset)
        resistance = around(reading.resistance, gain=gain, offset=offset + accuracy.resolution + 3.0 * accuracy.noise)
        touching = Interval(0.0, _ZERO * accuracy.offset + _CONTACT)
        told["resistance"] = reading.resistance
    found, earlier = judged_alike(
        mistakes(poles_of(connect)), lambda known: [loop(resistance, known, touching)], reference
    )
    reason = ""
    if found.outcome is Outcome.UNPROVED:
        reason = "too close" if reference else "unknown"
    evidence = _evidence(reading, expected(connect, reference))
    return Check(found.outcome, "lcr_meter", records(found, earlier, Leads()), told, reason, evidence)


def compared(lines: Sequence[float], which: int) -> Check:
    """Hold one of three line readings (Ω) against the other two, which stand for what it should be."""
    told = {"resistance": lines[which]}
    if odd_line(lines) != which:
        like = alike(lines)
        return Check(Outcome.PROVED if like else Outcome.UNPROVED, "lcr_meter", (), told, "alike" if like else "unlike")
    others = [line for k, line in enumerate(lines) if k != which]
    joined = mistake_record(Mistake(Kind.JOINED, (THIRD[which],), (Pole.OPEN,) * 3), Leads())
    evidence = text(
        "the LCR meter reads {read:.4g} Ω there, and {one:.4g} Ω and {other:.4g} Ω between the other terminals",
        read=lines[which],
        one=others[0],
        other=others[1],
    )
    return Check(Outcome.WRONG, "lcr_meter", (joined,), told, "", evidence)


def _evidence(reading: ImpedanceReading | None, wanted: float | None) -> Text:
    if reading is None:
        return text("the LCR meter finds no path")
    if wanted is None:
        return text("the LCR meter reads {read:.4g} Ω", read=reading.resistance)
    return text(
        "the LCR meter reads {read:.4g} Ω, {wanted:.4g} Ω belong to the connection as told",
        read=reading.resistance,
        wanted=wanted,
    )
