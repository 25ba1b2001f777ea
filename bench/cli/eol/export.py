"""`motorbench eol export`: a batch's records for other programs."""

import os
import sys
import tempfile
from collections.abc import Callable, Iterable
from pathlib import Path
from typing import IO, Annotated, Literal

from cyclopts import Parameter

from bench.cli.eol.narrowing_options import ALL_RECORDS, NarrowingOptions, tell_joined
from bench.cli.options import Json, RecordsAddress
from bench.cli.output import print_json
from bench.cli.standard_streams import standard_bytes
from bench.eol.record import MotorRecord
from bench.i18n.errors import InputError, UsageError, at
from bench.i18n.language import language_of, translator
from drivers.interfaces.text import reason_of, text

Format = Literal["csv", "parquet", "junit", "jsonl"]


def export(
    *batches: str,
    format_: Annotated[Format, Parameter(name="--format")],
    out: Annotated[Path | None, Parameter(name=("--out", "--output"))] = None,
    records: RecordsAddress = "records.sqlite",
    only: NarrowingOptions = ALL_RECORDS,
    json: Json = False,
) -> int:
    """Write the records of batches, of all where none is named; a file is there whole, or not at all.

    Parameters
    ----------
    batches
        The batches' names.
    format_
        csv (one row a figure), parquet (the same, with types), junit (one test case a parameter), jsonl (one record a line).
    out
        File to write. An existing file is replaced. Without it, the records go to standard output.

    """
    from bench.eol.narrowing import records_of
    from bench.eol.store.database import open_for_reading, using
    from bench.eol.store.records import Records

    if out is None and (json or format_ == "parquet"):
        raise UsageError(text("--json and --format parquet go with --out FILE"))
    with using(open_for_reading(records)) as engine:
        there = Records(engine).batches()
        for name in batches:
            if name not in there:
                raise UsageError(
                    text(
                        "no batch is named {name!r}; the batches are: {names}",
                        name=name,
                        names=there[:20] or text("none"),
                    )
                )
        found, joined = records_of(engine, batches, only.read())
        tell_joined(joined, translator(language_of("auto")))
        if out is None:
            with standard_bytes() as output:
                _writer(format_)(found, output)
            sys.stdout.flush()
            return 0
        count = _whole(out, _writer(format_), found)
    if json:
        print_json({"file": str(out), "format": format_, "motors": count})
    else:
        message = at(out, text("motors: {count}", count=count))
        print(message.render(translator(language_of("auto"))))
    return 0


def _writer(format_: Format) -> Callable[[Iterable[MotorRecord], IO[bytes]], int]:
    match format_:
        case "csv":
            from bench.eol.exports.csv_file import write_csv

            return write_csv
        case "parquet":
            from bench.eol.exports.parquet import write_parquet

            return write_parquet
        case "junit":
            from bench.eol.exports.junit import write_junit

            return write_junit
        case "jsonl":
            from bench.eol.exports.json_lines import write_json_lines

            return write_json_lines


def _whole(out: Path, write: Callable[[Iterable[MotorRecord], IO[bytes]], int], found: Iterable[MotorRecord]) -> int:
    """Write beside the file, and put it in its place when it is whole."""
    made: Path | None = None
    try:
        with tempfile.NamedTemporaryFile(dir=out.parent, prefix=f".{out.name}.", delete=False) as file:
            made = Path(file.name)
            count = write(found, file)
            file.flush()
            os.fsync(file.fileno())
        umask = os.umask(0)
        os.umask(umask)
        made.chmod(0o666 & ~umask)
        made.replace(out)
    except OSError as error:
        raise InputError(text("{out} cannot be written: {error}", out=out, error=reason_of(error))) from error
    finally:
        if made is not None:
            made.unlink(missing_ok=True)
    return count
