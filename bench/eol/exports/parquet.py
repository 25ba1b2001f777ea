"""Parquet: one row a figure, with types, in row groups of some thousand motors."""

from collections.abc import Iterable
from typing import IO, Any

import pyarrow as pa
import pyarrow.parquet as pq

from bench.eol.exports.rows import rows
from bench.eol.record import MotorRecord

_WORDS = pa.dictionary(pa.int32(), pa.string())
_TIME = pa.timestamp("us", tz="UTC")
SCHEMA = pa.schema(
    [
        pa.field("identifier", pa.string(), nullable=False),
        pa.field("batch", _WORDS, nullable=False),
        pa.field("number", pa.int64(), nullable=False),
        pa.field("serial_number", pa.string(), nullable=False),
        *(
            pa.field(name, _WORDS, nullable=False)
            for name in ("model", "plan", "plan_sha256", "station", "socket", "person")
        ),
        pa.field("started", _TIME, nullable=False),
        pa.field("ended", _TIME, nullable=False),
        pa.field("motor_verdict", _WORDS, nullable=False),
        pa.field("first_pass", pa.bool_(), nullable=False),
        pa.field("bench_time", pa.float64(), nullable=False),
        *(pa.field(name, pa.string(), nullable=False) for name in ("cause", "run", "journal_sha256", "diagnosis")),
        pa.field("rework", _WORDS, nullable=False),
        pa.field("test_number", pa.int64(), nullable=False),
        pa.field("again_by", _WORDS, nullable=False),
        pa.field("golden", pa.bool_(), nullable=False),
        pa.field("parameter", _WORDS),
        pa.field("value", pa.float64()),
        pa.field("unit", _WORDS),
        *(pa.field(name, pa.float64()) for name in ("standard_uncertainty", "expanded", "low", "high")),
        pa.field("verdict", _WORDS),
    ]
)
_GROUP = 20_000


def write_parquet(records: Iterable[MotorRecord], file: IO[bytes]) -> int:
    """Write records; return how many."""
    count = 0
    waiting: list[dict[str, Any]] = []
    with pq.ParquetWriter(file, SCHEMA, compression="zstd") as writer:
        for record in records:
            waiting.extend(rows(record))
            count += 1
            if len(waiting) >= _GROUP:
                writer.write_table(pa.Table.from_pylist(waiting, schema=SCHEMA))
                waiting.clear()
        if waiting:
            writer.write_table(pa.Table.from_pylist(waiting, schema=SCHEMA))
    return count
