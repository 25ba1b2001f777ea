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
