"""`motorbench eol retain`: what of old motors' runs is removed, by a rule."""

import sys
from datetime import UTC, datetime, timedelta
from pathlib import Path

from bench.cli.options import Json, Language, RecordsAddress
from bench.cli.output import print_json
from bench.i18n.errors import FileError
from bench.i18n.language import language_of, translator
from drivers.interfaces.text import text


def retain(
    rule: Path,
    *,
    records: RecordsAddress = "records.sqlite",
    runs: Path = Path("runs"),
    person: str = "",
    dry_run: bool = False,
    clock_is_right: bool = False,
    language: Language = "auto",
    json: Json = False,
) -> None:
    """Remove waveforms and runs of motors that are older than a rule keeps them; records stay. Each removal is logged first.

    Parameters
    ----------
    rule
        The file of the rule: tables [waveforms] and [runs] with the number of days to keep them, by verdict (passed, failed,
        error, aborted). What the rule does not name is kept.
    runs
        Folder of the batches' folders; the log is its retention.jsonl.
    person
        Name of the person who orders it, for the log.
    dry_run
        Only tell what would be removed.
    clock_is_right
        Count the days by this computer's clock, also those of a standstill: of more than four days without a motor, or of more than
        the line's usual pause if that is longer.

    """
    from bench.eol.archive.retention import LOG, due, load_rule, longest_pause, remove
    from bench.eol.store.database import open_for_reading, using
    from bench.eol.store.records import Records

    read, now = load_rule(rule), datetime.now(UTC)
    translate = translator(language_of(language))
    if not runs.is_dir():
        raise FileError(text("{runs}: there is no such folder of runs", runs=runs))
    counts, size, held_back = {"runs": 0, "waveforms": 0}, 0, set[Path]()
    with using(open_for_reading(records)) as engine:
        counted = longest_pause(Records(engine), now)
        for removal in due(Records(engine), read, runs, now, clock_is_right=clock_is_right):
            if removal.held_back:
                held_back.add(removal.folder)
                continue
            if not dry_run:
                remove(removal, runs / LOG, person)
            counts[removal.what] += 1
            size += removal.size
    if read.removes_nothing:
        words = text(
            "{rule}: this rule removes nothing, because it names no days. Write for example [runs] and below it passed = 730; allowed are "
            "the tables [waveforms] and [runs], and in them passed, failed, error, aborted",
            rule=rule,
        )
        print(f"motorbench: {words.render(translate)}", file=sys.stderr)
    if json:
        print_json({**counts, "size": size, "held_back": len(held_back), "removed": not dry_run})
        return
    if read.removes_nothing:
        return
    words = (
        text(
            "without --dry-run this would remove: runs: {runs}, waveforms of other runs: {waveforms}; {size:.1f} MB",
            size=size / 1e6,
            **counts,
        )
        if dry_run
        else text(
            "removed: runs: {runs}, waveforms of other runs: {waveforms}; {size:.1f} MB", size=size / 1e6, **counts
        )
    )
    print(words.render(translate))
    if held_back:
        words = text(
            "kept, although old by this computer's clock, because the line stood still meanwhile or the clock was set: {count}. Of "
            "each pause between two tests {days:.3g} days count at most; if the line stood still, --clock-is-right counts all and removes "
            "them too",
            count=len(held_back),
            days=counted / timedelta(days=1),
        )
        print(words.render(translate))
