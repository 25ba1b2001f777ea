"""`motorbench eol labels`: the label line of each motor."""

import sys

from bench.i18n.errors import UsageError
from drivers.interfaces.text import text


def labels(*, batch: str, records: str = "records.sqlite") -> None:
    """Print the label line of each motor of a batch, in the order in which they were done.

    Parameters
    ----------
    batch
        The batch's name.
    records
        Where the records are kept; the same as for `eol run`.

    """
    from bench.eol.line.record_writer import own_records
    from bench.eol.record import label_of

    with own_records(records) as kept:
        lines = [label_of(record) + "\n" for record in kept.read(batch)]
    if not lines:
        raise UsageError(
            text(
                "{records}: contains no motor of a batch {batch}; motorbench eol stats lists the batches",
                records=records,
                batch=batch,
            )
        )
    sys.stdout.writelines(lines)
