"""JUnit XML: one suite a motor, one test case a parameter; what failed says by which limits."""

import math
import re
from collections.abc import Iterable
from typing import IO

from junitparser import Error, Failure, TestCase, TestSuite

from bench.eol.record import CheckRecord, MeasuredFigure, MotorRecord
from bench.eol.verdict import Verdict
from bench.i18n.language import LANGUAGES, translator
from reports.labels import ParameterLabels

#: What XML 1.0 has no place for (2.2).
_FORBIDDEN = re.compile("[^\t\n\r -\ud7ff\ue000-\ufffd\U00010000-\U0010ffff]")


def write_junit(records: Iterable[MotorRecord], file: IO[bytes]) -> int:
    """Write records, each before the next is read; return how many. Jenkins and GitLab read these elements."""
    count = 0
    file.write(b'<?xml version="1.0" encoding="UTF-8"?>\n<testsuites name="motorbench">\n')
    for record in records:
        file.write(_suite(record))
        count += 1
    file.write(b"</testsuites>\n")
    return count


def _suite(record: MotorRecord) -> bytes:
    suite = TestSuite(_allowed(f"{record.batch} {record.serial_number}"))
    suite.timestamp = f"{record.started:%Y-%m-%dT%H:%M:%S}"
    suite.hostname = _allowed(record.station)
    for name in ("identifier", "batch", "number", "serial_number", "plan", "plan_sha256", "person", "socket", "run"):
        suite.add_property(name, _allowed(str(getattr(record, name))))
    suite.add_property("verdict", record.verdict.value)
    suite.add_property("first_pass", str(record.first_pass).lower())
    suite.add_property("test_number", str(record.test_number))
    suite.add_property("again_by", _allowed(record.again_by))
    suite.add_property("golden", str(record.golden).lower())
    suite.add_property("journal_sha256", _allowed(record.journal_sha256))
    # What the station could not do has a case of its own where no figure tells of it.
    alone = [] if any(m.verdict is not Verdict.PASS for m in record.measured) else _unmeasured(record)
    suite.add_testcases([_figure(record, figure) for figure in record.measured] + alone)
    suite.time = max(0.0, record.bench_time)
    text: bytes = suite.tostring()  # type: ignore[no-untyped-call]
    return text + b"\n"


def _figure(record: MotorRecord, figure: MeasuredFigure) -> TestCase:
    if figure.verdict is Verdict.NOT_JUDGED:
        names = _names(figure)
        told = (check.cause for check in reversed(record.checks) if any(name in check.cause for name in names))
        why = next(told, f"{figure.parameter} is not judged: no figure is given")
        return _case(record, figure.parameter, figure.verdict, why, why)
    finding = (
        f"{figure.value:g} {figure.unit} ± {figure.expanded:.3g} (95 %); limits "
        f"{_limit(figure.low)} … {_limit(figure.high)} {figure.unit}"
    )
    message = f"{figure.parameter} {figure.verdict.value}: {finding}"
    return _case(record, figure.parameter, figure.verdict, message, finding)


def _names(figure: MeasuredFigure) -> set[str]:
    """Return what a cause may call a parameter: its name, as older records have it, and its label in every language."""
    label = ParameterLabels({figure.parameter: figure.label})[figure.parameter]
    return {figure.parameter, *(label.render(translator(language)) for language in LANGUAGES)}


def _unmeasured(record: MotorRecord) -> list[TestCase]:
    """Return a case for each procedure whose last attempt did not pass, and one for a motor that did not for another reason."""
    last: dict[str, CheckRecord] = {check.procedure: check for check in record.checks}
    bad = [check for check in last.values() if check.verdict is not Verdict.PASS]
    if bad:
        return [
            _case(record, check.procedure, check.verdict, check.cause or check.verdict.value, check.cause)
            for check in bad
        ]
    if record.verdict is Verdict.PASS:
        return []
    return [_case(record, "motor", record.verdict, record.cause or record.verdict.value, record.cause)]


def _case(record: MotorRecord, name: str, verdict: Verdict, message: str, finding: str) -> TestCase:
    case = TestCase(_allowed(name), _allowed(f"{record.plan}.{record.serial_number}"))
    if verdict is Verdict.PASS:
        case.system_out = _allowed(finding)
        return case
    result = (Failure if verdict is Verdict.FAIL else Error)(_allowed(message), verdict.value)
    result.text = _allowed(finding)
    case.result = [result]
    return case


def _limit(bound: float) -> str:
    return f"{bound:g}" if math.isfinite(bound) else "none"


def _allowed(words: str) -> str:
    return _FORBIDDEN.sub("\ufffd", words)
