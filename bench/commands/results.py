"""`motorbench results`: a run as its journal tells it."""

import sys
from pathlib import Path
from typing import Annotated

from cyclopts import Parameter

from bench.commands.output import console_on, print_end, print_json, print_summary
from bench.errors import UsageError
from bench.files.toml_file import nearest
from bench.language import language_of, translator
from bench.record.journal import read_journal
from bench.record.run_folder import existing_run_folder
from bench.record.run_view import RunView, view_of
from procedures.result import Parameter as Measured
from procedures.text import Translate


def results(
    run: str,
    *,
    budget: Annotated[tuple[str, ...] | None, Parameter(consume_multiple=True)] = None,
    json: bool = False,
    language: str = "auto",
    runs: Path = Path("runs"),
) -> int:
    """Show a run's parameters and warnings; a run that was cut off shows what it has.

    Parameters
    ----------
    run
        The run's folder, or its name under `--runs`.
    budget
        Print the uncertainty budgets of these parameters, of all where none is named.
    json
        Print one JSON object and nothing else; the budgets are in it.
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
    elif budget is not None:
        _print_budgets(view, budget, translate)
    else:
        print_summary(view, folder, translate)
        if view.status != "completed":
            print_end(view, folder, translate)
    sys.stdout.flush()
    return 0


def _print_budgets(view: RunView, names: tuple[str, ...], translate: Translate) -> None:
    from reports.budget import budgets

    found = view.parameters()
    for name in names:
        if name not in found.parameters:
            raise UsageError(f"--budget {name}: the run has no such parameter; {nearest(name, list(found.parameters))}")
    wanted: list[Measured] = []
    for name in names or found.parameters:
        wanted += [found.parameters[name], *found.alternatives[name]]
    console_on(sys.stdout).print(budgets(wanted, translate))
