"""What is said of a record that does not look like its model: what was seen, what was done about it, what to do."""

from typing import Any

from drivers.interfaces.text import Text, Translate, english, text
from procedures.estimation.fitting.misfit import Answer, Cause, Finding

#: By cause: what was seen and what to do. A sentence may name the figures that come with every finding of its cause.
_SEEN = {
    Cause.UNEXPLAINED: text(
        "the record differs from the model by more than noise, and by none of the causes known here: look at its residual before you trust "
        "the figure"
    ),
}
#: What is said otherwise of a current step: its findings carry `record` = "step" among their figures.
_SEEN_IN_STEP = {
    Cause.NO_BASELINE: text(
        "no baseline: the record shows {samples:.0f} samples of the circuit at rest before the step, at least {needed:.0f} are needed; set "
        "the trigger so that the record begins before the supply is switched on"
    ),
    Cause.CLIPPED: text(
        "the {channel} is cut off at {level:.4g}, the end of a range or the supply's limit, and {lost:.0%} of the step is lost: use a "
        "wider range, or a smaller step"
    ),
    Cause.TOO_COARSE: text(
        "the converter's step of the {channel} ({resolution:.3g}) is more than ten times the noise, so that rounding does not average out "
        "and hides other causes: use a finer range"
    ),
    Cause.SKEW: text(
        "the current is recorded {time:.3g} s later than the voltage (earlier where negative): deskew the probes, and state what is left"
    ),
    Cause.BANDWIDTH: text(
        "the {channel} channel follows with a time constant of {time_constant:.3g} s ({bandwidth:.3g} Hz): switch off its bandwidth limit, "
        "or use a faster probe"
    ),
    Cause.SATURATION: text(
        "the inductance goes with the current: at {current:.4g} A it is {share:.3g} times that at zero current, which is the one given; "
        "step to {smaller:.3g} A, where it differs by about 1 %"
    ),
    Cause.SECOND_TIME_CONSTANT: text(
        "a second time constant of {time_constant:.3g} s, coupled by {coupling:.2g}, as eddy currents in iron or magnets make it; the "
        "inductance given is that of slow changes"
    ),
    Cause.AC_COUPLED: text(
        "the current's channel is AC coupled, with a corner of {corner:.3g} Hz: couple it DC, or use a probe that measures direct current"
    ),
    Cause.HUM: text(
        "mains hum of {frequency:.0f} Hz and {amplitude:.3g} A on the current: keep the leads short and twisted, and the probe away from "
        "transformers"
    ),
    Cause.SLOPE: text(
        "the current's channel drifts by {slope:.3g} A/s: let the probe warm up and degauss it, or take a shorter record"
    ),
    Cause.REPEATS_DIFFER: text(
        "{count:.0f} steps on one axis contradict each other, by {ratio:.2g} times what their own uncertainties explain: check the lock of "
        "the shaft and the contacts, and measure again"
    ),
}
_DONE = {
    Answer.MODELLED: text("it is in the model, and the interval holds it"),
    Answer.WIDENED: text("the interval is widened by what it may do"),
    Answer.WITHHELD: text("no figure is given, for no interval from this record would hold the truth"),
}


def sentence(finding: Finding) -> Text:
    """Return what was seen, what was done and what to do."""
    of_step = finding.figures.get("record") == "step" and finding.cause in _SEEN_IN_STEP
    seen = (_SEEN_IN_STEP if of_step else _SEEN)[finding.cause]
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
