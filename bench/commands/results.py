"""`motorbench results`: a run as its journal tells it."""

import sys
from pathlib import Path

from bench.commands.output import print_end, print_json, print_summary
from bench.journal import read_journal
from bench.language import language_of, translator
from bench.run_folder import existing_run_folder
from bench.run_view import view_of


def results(run: str, *, json: bool = False, language: str = "auto", runs: Path = Path("runs")) -> int:
    """Show a run's parameters and warnings; a run that was cut off shows what it has.

    Parameters
    ----------
    run
        The run's folder, or its name under `--runs`.
    json
        Print one JSON object and nothing else.
    language
        en, zh, or auto by the locale.
    runs
        Folder of the runs.

    """
    folder = existing_run_folder(run, runs)
    translate = translator(language_of(language))
    journal = read_journal(folder.journal)
    view = view_of(journal.events)
    if json:
        print_json({**view.as_dict(translate), "torn": journal.torn})
    else:
        print_summary(view, folder, translate)
        if view.status != "completed":
            print_end(view, folder, translate)
    sys.stdout.flush()
    return 0
