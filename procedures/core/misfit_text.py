"""What is said of a record that does not look like its model: what was seen, what was done about it, what to do."""

from typing import Any

from drivers.interfaces.text import Text, Translate, english, text
from procedures.estimation.fitting.misfit import Answer, Cause, Finding

#: By cause: what was seen and what to do. A sentence may name the figures that come with every finding of its cause.
_SEEN = {
    Cause.WINDAGE: text(
        "friction grows with the square of speed too: {share:.0%} of it at {speed:.0f} rad/s is air's and a fan's (quadratic friction)"
    ),
    Cause.STRIBECK: text(
        "friction is {share:.0%} of the Coulomb friction larger at low speed, up to about {speed:.3g} rad/s (Stribeck effect)"
    ),
    Cause.SPEED_FILTER: text(
        "the speed follows the shaft through a filter of about {time_constant:.2g} s: state the sensor's filter, or make it faster"
    ),
    Cause.TORQUE_FILTER: text(
        "the torque follows the shaft through a filter of about {time_constant:.2g} s: state the transducer's filter, or make it faster"
    ),
    Cause.DROPOUTS: text(
        "{count:.0f} of {readings:.0f} speeds are zero or wild and were left out: check the sensor's cable and threshold"
    ),
    Cause.COGGING: text("the speed ripples {order:.0f} times a turn, as cogging or torque ripple makes it"),
    Cause.ECCENTRICITY: text(
        "readings ripple {order:.0f} times a turn, as a coupling or an encoder that runs out makes them: align it"
    ),
    Cause.REGRIP: text(
        "the hand stopped or turned back {count:.0f} times during the sweep, as when it grips anew: turn one way without a stop"
    ),
    Cause.TURNING_POINTS: text(
        "the sweep shows {maxima:.0f} maxima and {minima:.0f} minima of the inductance clear of its ends, two of each are needed to know "
        "both axes: turn on through two electrical turns"
    ),
    Cause.SLOPE: text("readings drift with time beyond their scatter: let instrument and object settle, and repeat"),
    Cause.CLIPPED: text(
        "channel {channel} stands at an end of its range during {lost:.0%} of the record: take a wider range"
    ),
    Cause.REPEATS_DIFFER: text(
        "{count:.0f} readings of one quantity, {terminals}, contradict each other: {least:.4g} … {most:.4g} {unit}; look at contacts, "
        "range and unit, and take them again"
    ),
    Cause.UNEXPLAINED: text(
        "the record differs from the model by more than noise, and by none of the causes known here: look at its residual before you trust "
        "the figure"
    ),
}
_DONE = {
    Answer.MODELLED: text("it is in the model, and the interval holds it"),
    Answer.WIDENED: text("the interval is widened by what it may do"),
    Answer.WITHHELD: text("no figure is given, for no interval from this record would hold the truth"),
}


def sentence(finding: Finding) -> Text:
    """Return what was seen, what was done and what to do."""
    seen = _SEEN[finding.cause]
    return text("{seen}; {done}", seen=Text(seen.template, dict(finding.figures)), done=_DONE[finding.answer])


def misfit_row(finding: Finding, translate: Translate = english) -> dict[str, Any]:
    """Return a finding as it stands under `misfit` in `result.json`."""
    return {
        "cause": finding.cause.value,
        "answer": finding.answer.value,
        "parameters": list(finding.estimates),
        "score": finding.score,
        "message": sentence(finding).render(translate),
        "figures": dict(finding.figures),
    }
