"""Sizes of recorded voltages and currents that a bench hardly has: a probe's factor or a prefix is as likely wrong."""

from bench.analysis.outcome import AnalysisOutcome
from drivers.interfaces.text import text

#: Ids of the warnings.
UNUSUAL_CURRENT, UNUSUAL_VOLTAGE = "unusual-current", "unusual-voltage"
#: A step's current (A): below, a bench's probe and scope show noise; above, there is hardly a supply for it.
_CURRENTS = (1e-3, 800.0)
#: Amplitude of a back-EMF (V): what a scope with a divider shows well, and what a probe withstands.
_VOLTAGES = (0.03, 3000.0)


def warn_of_current(outcome: AnalysisOutcome, channel: str, amperes: float) -> None:
    """Warn of a step's current (A) that a bench hardly has."""
    least, most = _CURRENTS
    if not least <= amperes <= most:
        outcome.warn(
            text(
                "the step's current is {amperes:.3g} A by channel {channel}, but benches have {least:g} to {most:g} A. Check the probe's "
                "factor and the unit in the heading (mA under A?): resistance and inductance are wrong by the same factor. No other sign "
                "shows it",
                amperes=amperes,
                channel=channel,
                least=least,
                most=most,
            ),
            UNUSUAL_CURRENT,
        )


def warn_of_voltage(outcome: AnalysisOutcome, channel: str, volts: float) -> None:
    """Warn of a back-EMF's amplitude (V) that a bench hardly has."""
    least, most = _VOLTAGES
    if not least <= volts <= most:
        outcome.warn(
            text(
                "the amplitude is {volts:.3g} V by channel {channel}, but oscilloscopes record back-EMFs of {least:g} to {most:g} V. Check "
                "the probe's factor (--scale) and the unit in the heading: the flux linkage is wrong by the same factor. No other sign "
                "shows it",
                volts=volts,
                channel=channel,
                least=least,
                most=most,
            ),
            UNUSUAL_VOLTAGE,
        )
