"""`motorbench eol forward`: the records that wait for their server, without another batch."""

import sys
from pathlib import Path

from bench.cli.options import Json, Language
from bench.cli.output import print_json
from bench.i18n.errors import UsageError
from bench.i18n.language import language_of, translator
from drivers.interfaces.text import text


def forward(*, records: str, runs: Path = Path("runs"), language: Language = "auto", json: Json = False) -> int:
    """Forward the records of a folder of runs that wait for their server, as the next batch would; exit status 1 if some still wait.

    Parameters
    ----------
    records
        The server: postgresql://USER@HOST/NAME.
    runs
        Folder of the runs; its records.sqlite keeps what waits.

    """
    from bench.eol.line.record_writer import forward_records
    from bench.eol.store.database import database_url

    if database_url(records).get_backend_name() != "postgresql":
        raise UsageError(
            text(
                "--records {records}: this is no server; records are forwarded to postgresql://USER@HOST/NAME",
                records=records,
            )
        )
    waited, left = forward_records(records, runs)
    translate = translator(language_of(language))
    if json:
        print_json(
            {
                "forwarded": waited - left.for_server,
                "waiting_for_server": left.for_server,
                "in_no_database": left.unstored,
            }
        )
    else:
        print(text("records forwarded: {count}", count=waited - left.for_server).render(translate))
    for sentence in left.sentences():
        print(f"motorbench: {sentence.render(translate)}", file=sys.stderr)
    return int(left.anything)
