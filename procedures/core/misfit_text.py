"""What is said of a record that does not look like its model: what was seen, what was done about it, what to do."""

from collections.abc import Mapping
from typing import Any

from drivers.interfaces.text import Text, Translate, english, text
from procedures.estimation.fitting.misfit import Answer, Cause, Finding

#: By cause: what was seen and what to do. A sentence may name the figures that come with every finding of its cause.
_SEEN = {
    Cause.REPEATS_DIFFER: text(
        "{count:.0f} readings of one quantity, {terminals}, contradict each other: {least:.4g} … {most:.4g} {unit}; look at contacts, "
        "range and unit, and take them again"
    ),
    Cause.CLIPPED: text(
        "channel {channel} stands at an end of its range during {lost:.0%} of the record: take a wider range"
    ),
    Cause.HUM: text(
        "channel {channel} carries mains hum of {frequency:.4g} Hz, {amplitude:.3g} V: twist or shield the leads, ground at one point only"
    ),
    Cause.AC_COUPLED: text(
        "{channels} may be AC coupled, which takes up to {shortfall:.1%} of the reading away at {frequency:.3g} Hz and shows in no record: "
        "couple DC, and say so where the file does not (--coupling dc)"
    ),
    Cause.TOO_COARSE: text(
        "channel {channel} has less noise than a tenth of its step, {resolution:.3g} V: readings do not average the steps out; use a finer "
        "range"
    ),
    Cause.PROBE_FACTOR: text(
        "channel {channel} shows {share:.3g} times what the others show: its probe's factor is wrong, or the probe is off. Analyse again "
        "with --scale {channel}={factor:.4g}; for a run, correct the probe's attenuation in the station file"
    ),
    Cause.CHANNELS_DIFFER: text(
        "the channels differ by {difference:.2%}, {lowest} being the lowest and {highest} the highest, more than noise and stated limits "
        "explain: compare the probes on one signal"
    ),
    Cause.SPEED_TREND: text(
        "the flux linkage goes with the speed, by {span:.2%} from {slowest:.4g} to {fastest:.4g} Hz (laws that fit: {laws}): a divider's "
        "or probe's roll-off, iron, or magnets that warmed up; repeat the first speed last, and take five speeds or more"
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


def told_again(row: Mapping[str, Any], translate: Translate) -> dict[str, Any]:
    """Return a row of `misfit` in another language; the words of a cause that is not known here stay as they were."""
    try:
        finding = Finding(
            Cause(row["cause"]),
            Answer(row["answer"]),
            tuple(row["parameters"]),
            float(row["score"]),
            dict(row["figures"]),
        )
        again = misfit_row(finding, translate)
    except (KeyError, TypeError, ValueError, IndexError):
        return dict(row)
    # A sentence that another version said otherwise is not this version's to replace.
    return {**row, "message": again["message"]} if misfit_row(finding)["message"] == row["message"] else dict(row)


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
