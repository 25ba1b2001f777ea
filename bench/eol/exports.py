"""Records for other programs: CSV and Parquet with a row for each figure, JUnit XML, JSON lines."""

import csv
import json
from collections.abc import Callable, Iterable, Iterator, Mapping
from dataclasses import asdict
from itertools import groupby, islice
from pathlib import Path
from typing import IO, Any
from xml.sax.saxutils import quoteattr

from bench.eol.record import Measured, MotorRecord
from bench.eol.verdict import Verdict
from bench.errors import InputError
from bench.record.encoding import plain

_MOTOR = (
    "batch", "number", "serial_number", "model", "plan", "plan_sha256", "station", "socket", "person", "started", "ended",
    "verdict", "first_pass", "bench_time", "cause", "run", "journal_sha256", "identifier",
)  # fmt: skip
_FIGURE = ("parameter", "value", "unit", "standard_uncertainty", "expanded", "low", "high", "figure_verdict")
#: Rows that Parquet groups together.
_ROWS = 10_000
#: What XML 1.0 has no form for.
_NOT_XML = dict.fromkeys((*range(9), 11, 12, *range(14, 32)), "�")


def write(records: Iterable[MotorRecord], form: str, path: Path | None, stream: IO[str]) -> None:
    """Write records as csv, parquet, junit or jsonl into a file, or on `stream` where none is named.

    Raises InputError where the file cannot be written.
    """
    try:
        if form == "parquet" and path is not None:
            _parquet(records, path)
        elif path is None:
            _TEXT[form](records, stream)
        else:
            with path.open("w", encoding="utf-8", newline="") as file:
                _TEXT[form](records, file)
    except OSError as error:
        raise InputError(f"{path}: cannot be written: {error.strerror or error}") from None


def _rows(records: Iterable[MotorRecord]) -> Iterator[dict[str, Any]]:
    """Give a row for each figure, and one for a motor without any."""
    for record in records:
        motor = {name: getattr(record, name) for name in _MOTOR} | {"verdict": record.verdict.value}
        for figure in record.measured:
            yield motor | _figure(figure)
        if not record.measured:
            yield motor | dict.fromkeys(_FIGURE)


def _figure(figure: Measured) -> dict[str, Any]:
    return {name: getattr(figure, name) for name in _FIGURE[:-1]} | {"figure_verdict": figure.verdict.value}


def _csv(records: Iterable[MotorRecord], file: IO[str]) -> None:
    writer = csv.DictWriter(file, [*_MOTOR, *_FIGURE])
    writer.writeheader()
    for row in _rows(records):
        writer.writerow({**row, "started": row["started"].isoformat(), "ended": row["ended"].isoformat()})


def _jsonl(records: Iterable[MotorRecord], file: IO[str]) -> None:
    for record in records:
        told = asdict(record) | {"started": record.started.isoformat(), "ended": record.ended.isoformat()}
        file.write(json.dumps(plain(told), ensure_ascii=False, allow_nan=False) + "\n")


def _junit(records: Iterable[MotorRecord], file: IO[str]) -> None:
    """Write one suite a batch, as JUnit's own reader takes it; its counts come last in a batch but first in the file."""
    file.write('<?xml version="1.0" encoding="UTF-8"?>\n<testsuites>\n')
    for batch, motors in groupby(records, key=lambda record: record.batch):
        # A suite's head counts its cases: they are held as text, a few hundred bytes each.
        cases, counts = list[str](), dict.fromkeys(Verdict, 0)
        for record in motors:
            counts[record.verdict] += 1
            cases.append(_case(record))
        file.write(
            f'  <testsuite name={_quoted(batch)} tests="{len(cases)}" failures="{counts[Verdict.FAIL]}" '
            f'errors="{counts[Verdict.ERROR]}" skipped="{counts[Verdict.ABORTED]}">\n'
        )
        file.writelines(cases)
        file.write("  </testsuite>\n")
    file.write("</testsuites>\n")


def _case(record: MotorRecord) -> str:
    head = (
        f"    <testcase classname={_quoted(record.plan)} name={_quoted(record.serial_number)} "
        f'time="{record.bench_time:.3f}" timestamp="{record.started.isoformat(timespec="seconds")}"'
    )
    tag = {Verdict.FAIL: "failure", Verdict.ERROR: "error", Verdict.ABORTED: "skipped"}.get(record.verdict)
    if tag is None:
        return head + "/>\n"
    return f"{head}>\n      <{tag} message={_quoted(record.cause)}/>\n    </testcase>\n"


def _quoted(words: str) -> str:
    return quoteattr(words.translate(_NOT_XML))


def _parquet(records: Iterable[MotorRecord], path: Path) -> None:
    # Slow to import, and no other form needs it.
    import pyarrow as pa
    import pyarrow.parquet as pq

    schema = pa.schema([(name, _kind(pa, name)) for name in (*_MOTOR, *_FIGURE)])
    with pq.ParquetWriter(path, schema) as writer:
        rows = _rows(records)
        while some := list(islice(rows, _ROWS)):
            writer.write_table(pa.Table.from_pylist(some, schema))


def _kind(pa: Any, name: str) -> Any:
    if name in ("started", "ended"):
        return pa.timestamp("us", tz="UTC")
    if name in ("bench_time", "value", "standard_uncertainty", "expanded", "low", "high"):
        return pa.float64()
    return {"number": pa.int64(), "first_pass": pa.bool_()}.get(name, pa.string())


_TEXT: Mapping[str, Callable[[Iterable[MotorRecord], IO[str]], None]] = {"csv": _csv, "jsonl": _jsonl, "junit": _junit}
