"""The result of a run from its journal, with the hash of the journal's end."""

from collections.abc import Mapping
from typing import Any

from bench.i18n.errors import InputError
from bench.journal.disk import write_file
from bench.journal.events.run import TELLS_WITHHELD, RunFinished
from bench.journal.journal_file import JournalFile, read_journal
from bench.journal.run_folder import RunFolder
from bench.journal.run_tables import tables_of
from bench.journal.run_view import SHOWN, RunView, view_of
from drivers.interfaces.text import Translate, english


def result_of(journal: JournalFile, translate: Translate = english) -> dict[str, Any]:
    """Return a journal's view as it stands in `result.json`; under `journal` the number and the hash of its last event.

    Raises InputError for events that are not as a run writes them.
    """
    view = view_of(journal.events)
    made = view.as_dict(translate)
    if view.start is not None and view.start.schema < TELLS_WITHHELD:
        made = _without_withheld(made)
    return {**made, "journal": end_of(journal)}


def _without_withheld(made: Mapping[str, Any]) -> dict[str, Any]:
    """Return a result as versions wrote it that withheld nothing."""
    kept = {key: value for key, value in made.items() if key not in ("withheld", "misfit")}
    kept["procedures"] = {
        name: {key: value for key, value in procedure.items() if key != "withheld"}
        for name, procedure in made["procedures"].items()
    }
    return kept


def end_of(journal: JournalFile) -> dict[str, Any]:
    """Return what a journal's end is recognised by."""
    return {"events": len(journal.events), "sha256": journal.last_hash}


def conclude(folder: RunFolder, view: RunView, translate: Translate) -> dict[str, Any]:
    """Write `result.json`, and the tables that belong to it, from the journal as it lies on the disk, and return it.

    Where either cannot be done `view` is told why, its status is no longer `completed`, and its own figures are returned.
    """
    try:
        journal = read_journal(folder.journal, {each.kind for each in SHOWN})
        if journal.events and isinstance(journal.events[-1].event, RunFinished):
            result = result_of(journal, translate)
            folder.write_result(result)
            for name, content in tables_of(result):
                write_file(folder.path / name, content)
            return result
        why = f"{folder.journal} has no end, so there is no result.json"
    except (InputError, OSError) as error:
        why = f"{folder.result} was not made: {error}"
    view.apply(
        RunFinished(
            status="aborted" if view.status == "aborted" else "failed",
            cause="\n".join(part for part in (view.cause, why) if part),
            bench_time=0.0,
            wall_time=0.0,
        )
    )
    return view.as_dict(translate)
