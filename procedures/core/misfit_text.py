"""Messages about a record that differs from its model: what was seen, what was done about it, what to do."""

from collections.abc import Mapping
from typing import Any

from drivers.interfaces.text import Text, Translate, english, text, word
from procedures.core.misfit_sentences import any_record, back_emf, load, mechanics, winding
from procedures.estimation.fitting.misfit import Answer, Cause, Finding

#: By record, then by cause.
_OF_RECORD = winding.SENTENCES | back_emf.SENTENCES | mechanics.SENTENCES | load.SENTENCES
#: Causes whose sentence tells what was done, too.
_ALL_SAID = (Cause.PULSE_ENDS, Cause.REPEATED_ROWS)
_DONE = {
    Answer.MODELLED: text("the model includes it, and so does the interval of every figure that is given"),
    Answer.WIDENED: text("the interval of every figure that is given is widened by its possible effect"),
    Answer.SAID: text("it changes no interval"),
    Answer.WITHHELD: text("no figure is given, because no interval from this record would contain the true value"),
}


def sentence(finding: Finding) -> Text:
    """Return what was seen, what was done and what to do."""
    of_record = _OF_RECORD.get(str(finding.figures.get("record")), {})
    seen = of_record.get(finding.cause) or any_record.SENTENCES[finding.cause]
    figures: dict[str, object] = dict(finding.figures)
    if "channel" in figures:
        # Where it is a quantity, it is said in the reader's words.
        figures["channel"] = word(str(figures["channel"]))
    if "tried" in figures:
        figures["tried"] = [word(name) for name in str(figures["tried"]).split(", ")]
    if finding.cause in _ALL_SAID:
        return Text(seen.template, figures)
    return text("{seen}; {done}", seen=Text(seen.template, figures), done=_DONE[finding.answer])


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
