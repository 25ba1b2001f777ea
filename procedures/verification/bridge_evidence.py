"""Verification by an LCR meter: its test signal harms nothing and turns nothing."""

from collections.abc import Sequence

from drivers.interfaces import ImpedanceReading, LcrMeter, OverloadError, Wanted
from drivers.interfaces.text import Text, text
from procedures.core.actions import Connect
from procedures.estimation.fitting.intervals import Interval, around
from procedures.estimation.winding.wiring import Kind, Mistake, Pole, SensingLeads, WiringOutcome, mistakes, odd_line
from procedures.verification.check import Check, mistake_record, records
from procedures.verification.lines import Reference
from procedures.verification.two_poles import NO_PATH, THIRD, expected, loop, one_of_three, poles_of
from procedures.verification.two_poles import judged as judged_alike

#: Clips against each other read within so many limits of error of zero, and this (Ω) where no more is stated.
_ZERO, _CONTACT = 2.0, 1e-3
#: Of the limit of error, so much may differ between a reading and a like one.
_DIFFERING = 1.0 / 3.0


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
    """Hold a bridge's reading against the connection as intended; `reference` is at the reading's own frequency, or None."""
    readings: dict[str, float] = {}
    resistance, touching = NO_PATH, Interval(0.0, _CONTACT)
    if reading is not None:
        accuracy = reading.resistance_accuracy
        # What the instrument may be off by is in a reference of its own: then only what makes two like readings differ counts.
        gain, offset = (0.0, 0.0) if reference is None or reference.own else (accuracy.gain, accuracy.offset)
        resistance = around(reading.resistance, gain=gain, offset=offset + accuracy.resolution + 3.0 * accuracy.noise)
        touching = Interval(0.0, _ZERO * accuracy.offset + _CONTACT)
        readings["resistance"] = reading.resistance
    found, earlier = judged_alike(
        mistakes(poles_of(connect)), lambda known: [loop(resistance, known, touching)], reference
    )
    reason = ""
    if found.outcome is WiringOutcome.UNVERIFIED:
        reason = "too close" if reference else "unknown"
    evidence = _evidence(reading, expected(connect, reference))
    return Check(found.outcome, "lcr_meter", records(found, earlier, SensingLeads()), readings, reason, evidence)


def compared(lines: Sequence[float], which: int) -> Check:
    """Hold one of three line readings (Ω) against the other two, which stand for what it should be."""
    joined = mistake_record(Mistake(Kind.JOINED, (THIRD[which],), (Pole.OPEN,) * 3), SensingLeads())
    return one_of_three("lcr_meter", lines, which, joined, odd=odd_line(lines) == which)


def _evidence(reading: ImpedanceReading | None, wanted: float | None) -> Text:
    if reading is None:
        return text("the LCR meter finds an open circuit")
    if wanted is None:
        return text("the LCR meter reads {read:.4g} Ω", read=reading.resistance)
    return text(
        "the LCR meter reads {read:.4g} Ω; {expected:.4g} Ω are expected for this connection",
        read=reading.resistance,
        expected=wanted,
    )
