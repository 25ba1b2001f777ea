"""`motorbench eol labels`: the label line of each motor."""

import sys

from bench.cli.eol.narrowing_options import ALL_RECORDS, NarrowingOptions, tell_joined
from bench.cli.options import Language
from bench.i18n.errors import UsageError
from bench.i18n.language import language_of, translator
from drivers.interfaces.text import text


def labels(
    *, batch: str, records: str = "records.sqlite", only: NarrowingOptions = ALL_RECORDS, language: Language = "auto"
) -> None:
    """Print the label line of each motor of a batch, in the order in which they were done.

    Parameters
    ----------
    batch
        The batch's name.
    records
        Where the records are kept; the same as for `eol run`.

    """
    from bench.eol.narrowing import records_of
    from bench.eol.record import label_of
    from bench.eol.store.database import open_for_reading, using

    with using(open_for_reading(records)) as engine:
        found, joined = records_of(engine, [batch], only.read())
        lines = [label_of(record) + "\n" for record in found]
    if not lines:
        raise UsageError(
            text(
                "{records}: contains no motor of a batch {batch}; motorbench eol stats lists the batches",
                records=records,
                batch=batch,
            )
        )
    tell_joined(joined, translator(language_of(language)))
    sys.stdout.writelines(lines)
