"""`motorbench eol motor`: one motor's tests, and what changed from each to the next."""

import math
import sys
from dataclasses import asdict
from itertools import pairwise
from typing import TYPE_CHECKING

from bench.cli.options import Json, Language
from bench.cli.output import print_json
from bench.eol.serial_number import in_other_capitals
from bench.eol.verdict import Verdict
from bench.i18n.errors import UsageError
from bench.i18n.language import language_of, translator
from drivers.interfaces.text import Text, Translate, lines, text
from reports.labels import ParameterLabels
from reports.tables.figures import scale_of

if TYPE_CHECKING:
    from bench.eol.record import MotorRecord
    from bench.eol.retest import ChangedFigure


def motor(
    serial_number: str, *, records: str = "records.sqlite", json: Json = False, language: Language = "auto"
) -> None:
    """Print every test of a motor: when, where, verdict, rework code and the part at fault, and what changed since the one before.

    Parameters
    ----------
    serial_number
        The motor's serial number.
    records
        Where the records are kept; the same as for `eol run`.

    """
    from bench.eol.line.record_writer import own_records
    from bench.eol.retest import changed_figures

    translate = translator(language_of(language))
    with own_records(records) as kept:
        tests = kept.of_motor(serial_number)
        there = "" if tests else next((one for one in in_other_capitals(serial_number) if kept.of_motor(one)), "")
    if there:
        raise UsageError(
            text(
                "{records}: contains no test of a motor {serial!r}, but of {there!r}, which differs in capitals only: type it so",
                records=records,
                serial=serial_number,
                there=there,
            )
        )
    if not tests:
        raise UsageError(
            text("{records}: contains no test of a motor {serial!r}", records=records, serial=serial_number)
        )
    changes = [(), *(tuple(changed_figures(before, after)) for before, after in pairwise(tests))]
    if json:
        print_json(
            {
                "serial_number": serial_number,
                "tests": [
                    {**_about(test), "changed": [asdict(change) for change in changed]}
                    for test, changed in zip(tests, changes, strict=True)
                ],
            }
        )
        return
    for test, changed in zip(tests, changes, strict=True):
        _print(test, changed, translate)


def _about(test: "MotorRecord") -> dict[str, object]:
    from bench.eol.told_causes import cause_of, diagnosis_of

    english = translator("en")
    return {
        "batch": test.batch,
        "number": test.number,
        "station": test.station,
        "socket": test.socket,
        "ended": test.ended.isoformat(),
        "verdict": test.verdict.value,
        "rework": test.rework,
        "diagnosis": lines(diagnosis_of(test), "; ").render(english),
        "cause": cause_of(test).render(english),
    }


def _print(test: "MotorRecord", changed: "tuple[ChangedFigure, ...]", translate: Translate) -> None:
    from bench.eol.record import label_of
    from bench.eol.told_causes import cause_of, diagnosis_of

    printed = [label_of(test)]
    if words := (lines(diagnosis_of(test), "; ") if test.diagnosis else cause_of(test)).render(translate):
        printed.append(f"    {words}")
    printed += [f"    {_said(change).render(translate)}" for change in changed]
    sys.stdout.write("\n".join(printed) + "\n")


def _said(change: "ChangedFigure") -> Text:
    from bench.eol.statistics_messages import VERDICTS

    # A figure that was withheld has no value to take the scale of.
    scale = scale_of(change.before if math.isnan(change.after) else change.after, change.unit)
    before, after = (
        "–" if math.isnan(value) else f"{value / scale.factor:.4g}" for value in (change.before, change.after)
    )
    was, now = (VERDICTS[Verdict(verdict)] for verdict in (change.verdict_before, change.verdict_after))
    return text(
        "{name}: {before} → {after}{unit}, {verdicts}",
        name=ParameterLabels({change.parameter: change.label})[change.parameter],
        before=before,
        after=after,
        unit=f" {scale.unit}" if scale.unit else "",
        verdicts=now if was == now else Text("{was} → {now}", {"was": was, "now": now}),
    )
