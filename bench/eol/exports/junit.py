"""JUnit XML: one suite a motor, one test case a parameter; what failed says by which limits."""

import math
from collections.abc import Iterable
from typing import IO
from xml.sax.saxutils import escape, quoteattr

from bench.eol.record import CheckRecord, Measured, MotorRecord
from bench.eol.verdict import Verdict


def write_junit(records: Iterable[MotorRecord], file: IO[bytes]) -> int:
    """Write records; return how many. The elements are those that Jenkins and GitLab read (junit-10.xsd of the xUnit plugin)."""
    count = 0
    file.write(b'<?xml version="1.0" encoding="UTF-8"?>\n<testsuites name="motorbench">\n')
    for record in records:
        file.write(_suite(record).encode("utf-8"))
        count += 1
    file.write(b"</testsuites>\n")
    return count


def _suite(record: MotorRecord) -> str:
    # What the station could not do has a case of its own where no figure tells of it.
    alone = [] if any(m.verdict is not Verdict.PASS for m in record.measured) else _unmeasured(record)
    cases = [_figure(record, figure) for figure in record.measured] + alone
    failures = sum(figure.verdict is Verdict.FAIL for figure in record.measured) + sum(
        "<failure" in case for case in alone
    )
    errors = sum(figure.verdict in (Verdict.ERROR, Verdict.ABORTED) for figure in record.measured)
    errors += sum("<error" in case for case in alone)
    name, time = f"{record.batch} {record.serial_number}", f"{max(0.0, record.bench_time):.6f}"
    properties = {
        "identifier": record.identifier,
        "batch": record.batch,
        "number": str(record.number),
        "serial_number": record.serial_number,
        "plan": record.plan,
        "plan_sha256": record.plan_sha256,
        "verdict": record.verdict.value,
        "first_pass": str(record.first_pass).lower(),
        "person": record.person,
        "socket": record.socket,
        "run": record.run,
        "journal_sha256": record.journal_sha256,
    }
    told = "".join(f"<property name={_quoted(key)} value={_quoted(value)}/>" for key, value in properties.items())
    return (
        f'<testsuite name={_quoted(name)} tests="{len(cases)}" failures="{failures}" errors="{errors}" skipped="0" '
        f'time="{time}" timestamp="{record.started:%Y-%m-%dT%H:%M:%S}" hostname={_quoted(record.station)}>'
        f"<properties>{told}</properties>{''.join(cases)}</testsuite>\n"
    )


def _figure(record: MotorRecord, figure: Measured) -> str:
    said = (
        f"{figure.value:g} {figure.unit} ± {figure.expanded:.3g} (95 %); limits "
        f"{_limit(figure.low)} … {_limit(figure.high)} {figure.unit}"
    )
    return _case(record, figure.parameter, figure.verdict, f"{figure.parameter} {figure.verdict.value}: {said}", said)


def _unmeasured(record: MotorRecord) -> list[str]:
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


def _case(record: MotorRecord, name: str, verdict: Verdict, message: str, said: str) -> str:
    begin = f"<testcase name={_quoted(name)} classname={_quoted(f'{record.plan}.{record.serial_number}')}"
    if verdict is Verdict.PASS:
        return f"{begin}><system-out>{_text(said)}</system-out></testcase>"
    kind = "failure" if verdict is Verdict.FAIL else "error"
    return f'{begin}><{kind} type="{verdict.value}" message={_quoted(message)}>{_text(said)}</{kind}></testcase>'


def _limit(bound: float) -> str:
    return f"{bound:g}" if math.isfinite(bound) else "none"


def _text(words: str) -> str:
    return escape(_allowed(words))


def _quoted(words: str) -> str:
    return quoteattr(_allowed(words))


def _allowed(words: str) -> str:
    """Replace what XML 1.0 has no place for (2.2)."""
    return "".join(
        c if c in "\t\n\r" or " " <= c <= "\ud7ff" or "\ue000" <= c <= "\ufffd" or c >= "\U00010000" else "�"
        for c in words
    )
