"""Verification by a supply: a harmless current through the terminals, and what it meets."""

import math
from collections.abc import Mapping
from dataclasses import dataclass

from drivers.interfaces import OutputMode, Reading, Supply
from drivers.interfaces.text import Text, text
from procedures.core.actions import Connect
from procedures.estimation.fitting.intervals import Interval, around
from procedures.estimation.winding.wiring import SensingLeads, WiringOutcome, mistakes
from procedures.verification.check import Check, records
from procedures.verification.lines import Reference
from procedures.verification.two_poles import ANY_PATH, NO_PATH, expected, loop, poles_of
from procedures.verification.two_poles import judged as judged_alike


@dataclass(frozen=True)
class SupplyReading:
    """A supply's output at rest: voltage (V) and current (A) within their errors, and whether the current has a path."""

    voltage: Interval
    current: Interval
    path: bool

    @property
    def resistance(self) -> Interval:
        """Resistance (Ω) of all that is connected; infinite without a path."""
        if not self.path:
            return NO_PATH
        if self.current.low <= 0.0:
            return ANY_PATH
        return Interval(max(0.0, self.voltage.low) / self.current.high, self.voltage.high / self.current.low)


def read(supply: Supply) -> SupplyReading:
    """Read a supply that is on and has settled."""
    current, voltage = within(supply.measure_current()), within(supply.measure_voltage())
    # A current too small for the meter still shows by what regulates.
    path = supply.output_mode() is OutputMode.CONSTANT_CURRENT or current.low > 0.0
    return SupplyReading(voltage, current, path)


def within(reading: Reading) -> Interval:
    """Return a reading within its limits of error."""
    accuracy = reading.accuracy
    return around(
        reading.value, gain=accuracy.gain, offset=accuracy.offset + accuracy.resolution + 3.0 * accuracy.noise
    )


def judged(
    connect: Connect, read: SupplyReading, reference: Reference | None, leads: float, *, swinging: bool
) -> Check:
    """Hold a supply's readings against the connection as intended.

    `leads` (Ω) is the most that its leads may have. With a rotor free to swing, whose EMF is in the voltage, only the path counts.
    """
    resistance = read.resistance
    usable = ANY_PATH if swinging and read.path else resistance
    between = reference.leads if reference else Interval(0.0, leads)
    found, earlier = judged_alike(mistakes(poles_of(connect)), lambda known: [loop(usable, known, between)], reference)
    return Check(
        found.outcome,
        "supply",
        records(found, earlier, SensingLeads()),
        figures(read),
        "" if found.outcome is not WiringOutcome.UNVERIFIED else _reason(reference, swinging=swinging),
        evidence(read, expected(connect, reference)),
    )


def figures(read: SupplyReading) -> Mapping[str, float]:
    """Return the middle of what was read, for the record."""
    readings = {"voltage": middle(read.voltage), "current": middle(read.current)}
    if read.path and read.current.low > 0.0:
        readings["resistance"] = readings["voltage"] / readings["current"]
    return readings


def evidence(read: SupplyReading, wanted: float | None) -> Text:
    """Return the reading in words, and what belongs to the connection as intended."""
    if not read.path:
        return text("no current flows at {voltage:.3g} V", voltage=middle(read.voltage))
    resistance = middle(read.voltage) / middle(read.current) if read.current.low > 0.0 else math.nan
    if wanted is None:
        return text("the supply reads {read:.4g} Ω", read=resistance)
    return text(
        "the supply reads {read:.4g} Ω; {expected:.4g} Ω plus its leads are expected for this connection",
        read=resistance,
        expected=wanted,
    )


def _reason(reference: Reference | None, *, swinging: bool) -> str:
    if reference is None:
        return "unknown"
    return "swinging" if swinging else "too close"


def middle(interval: Interval) -> float:
    """Return the figure that was read."""
    return 0.5 * (interval.low + interval.high)
