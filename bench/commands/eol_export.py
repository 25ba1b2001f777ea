"""`motorbench eol export` and `motorbench eol labels`: what is kept of a batch, for others to read."""

import sys
from pathlib import Path
from typing import Literal

from bench.errors import UsageError


def export(
    *,
    format: Literal["csv", "parquet", "junit", "jsonl"],  # noqa: A002  as it is typed
    batch: str = "",
    records: str = "records.sqlite",
    output: Path | None = None,
) -> None:
    """Write records in a form that other programs read.

    Parameters
    ----------
    format
        csv and parquet: a row for each figure; junit: a test case for each motor; jsonl: an object for each motor.
    batch
        One batch; all without it.
    records
        Where the records are kept, as for `eol run`.
    output
        The file to write; standard output without it, which parquet cannot do.

    """
    from bench.eol.exports import write
    from bench.eol.line.keeper import own_records

    if output is None and format == "parquet":
        raise UsageError("--format parquet: name the file by --output FILE")
    with own_records(records) as kept:
        write(kept.read(batch or None), format, output, sys.stdout)


def labels(*, batch: str, records: str = "records.sqlite") -> None:
    """Print the label line of each motor of a batch, in the order in which they were done.

    Parameters
    ----------
    batch
        The batch's name.
    records
        Where the records are kept, as for `eol run`.

    """
    from bench.eol.labels import label_of
    from bench.eol.line.keeper import own_records

    with own_records(records) as kept:
        for record in kept.read(batch):
            sys.stdout.write(label_of(record) + "\n")
