"""`motorbench eol migrate`: a database's tables brought up to this program's version."""

import sys

from bench.cli.options import Json, Language, RecordsAddress
from bench.cli.output import print_json
from bench.i18n.language import language_of, translator
from drivers.interfaces.text import text


def migrate(*, records: RecordsAddress = "records.sqlite", language: Language = "auto", json: Json = False) -> None:
    """Bring the tables of records up to this program's version; all of it or nothing, and no other command does it.

    Serial numbers get the one spelling that is kept now.
    """
    from bench.eol.store.database import migrate_database, open_database, using
    from bench.eol.store.respelling import respell
    from bench.eol.store.summing import sum_up

    translate = translator(language_of(language))
    before, after = migrate_database(
        records, lambda words: print(f"motorbench: {words.render(translate)}", file=sys.stderr, flush=True)
    )
    with using(open_database(records, existing=True)) as engine:
        respelled = respell(engine)
        tallied = sum_up(engine)
    if json:
        print_json({"before": before, "after": after, "stretches_summed_up": tallied, "respelled": respelled})
        return
    message = (
        text("the tables already have version {after}", after=after)
        if before == after
        else text("the tables now have version {after}; they had version {before}", before=before, after=after)
    )
    print(message.render(translate))
    if respelled:
        words = text(
            "serial numbers that had another spelling and now have the one that is kept: {count}", count=respelled
        )
        print(words.render(translate))
