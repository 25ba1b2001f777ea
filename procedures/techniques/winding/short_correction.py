"""Short correction of an LCR meter: its leads are clipped together, read and subtracted."""

from drivers.interfaces import LcrMeter
from procedures.core.actions import ShortMeterLeads
from procedures.core.bench import Bench


def short_correct(bench: Bench, bridge: LcrMeter) -> None:
    """Take the leads' own impedance out of the bridge's readings; they stay together until they are put on the motor."""
    bench.perform(ShortMeterLeads())
    bridge.correct_short()
