"""`motorbench results`: a run as its journal tells it, and which runs there are."""

import sys
from dataclasses import asdict
from pathlib import Path
from typing import Annotated

from cyclopts import App, Parameter

from bench.cli.options import Json, Language, Runs
from bench.cli.output import padded, print_end, print_json, print_summary
from bench.files.toml_file import nearest
from bench.i18n.errors import FileError, UsageError
from bench.i18n.language import language_of, translator
from bench.journal.events.safety import GuardianTakesOver
from bench.journal.guardian_record import read_guardian
from bench.journal.journal_file import read_journal
from bench.journal.overview import overview
from bench.journal.run_folder import RunFolder, existing_run_folder, run_folders
from bench.journal.run_result import end_of
from bench.journal.run_view import RunView, view_of
from bench.run.console import console_on
from drivers.interfaces.text import Translate, lines, text, word
from procedures.core.result import Parameter as Measured

#: Procedures that a list names one by one.
_NAMED = 3
_RUNS = Path("runs")


def results(
    run: str = "",
    *,
    budget: Annotated[tuple[str, ...] | None, Parameter(consume_multiple=True)] = None,
    json: bool = False,
    language: Language = "auto",
    runs: Runs = _RUNS,
) -> int:
    """Show a run's parameters and warnings; a run that was cut off shows what it has.

    Parameters
    ----------
    run
        The run's folder, its name under `--runs`, or `latest`. Without it, the runs are listed.
    budget
        Print the uncertainty budgets of these parameters; without a name, of all parameters.
    json
        Print one JSON object and nothing else; the budgets are in it.

    """
    if not run:
        return list_runs(json=json, runs=runs)
    folder = existing_run_folder(run, runs)
    translate = translator(language_of(language))
    journal = read_journal(folder.journal)
    view = view_of(journal.events)
    if json:
        acts = [{"wall": at, "cause": cause} for at, cause in _acts(folder)]
        print_json({**view.as_dict(translate), "journal": end_of(journal), "torn": journal.torn, "guardian": acts})
    elif budget is not None:
        _print_budgets(view, budget, translate)
    else:
        print_summary(view, folder, translate)
        if view.status != "completed":
            print_end(view, folder, translate)
        for at, cause in _acts(folder):
            message = text("The guardian carried out the shutdown at {time}: {cause}", time=at, cause=cause)
            console_on(sys.stdout).print(message.render(translate), markup=False)
    sys.stdout.flush()
    return 0


def list_runs(*, json: Json = False, language: Language = "auto", runs: Runs = _RUNS) -> int:
    """List the runs of a folder in the order they began."""
    translate = translator(language_of(language))
    # Before the first run the usual folder is not there yet.
    if runs != _RUNS and not runs.is_dir():
        raise FileError(text("{runs}: there is no such folder of runs", runs=runs))
    found = [overview(folder) for folder in run_folders(runs)]
    if json:
        print_json({"runs": [asdict(each) for each in found]})
    elif not found:
        print(text("there are no runs in {runs}", runs=runs).render(translate))
    else:
        widest = max(len(each.name) for each in found)
        for each in found:
            many = len(each.procedures) > _NAMED
            what = (
                text("{count} procedures", count=len(each.procedures))
                if many
                else lines(map(word, each.procedures), ", ")
            )
            status = padded(translate(each.status), 11)
            print(f"{each.name:{widest}}  {status}  {each.motor}: {what.render(translate)}")
    return 0


def _acts(folder: RunFolder) -> list[tuple[str, str]]:
    """Return when (ISO 8601, UTC) and why the guardian carried out the shutdown; empty where it never had to."""
    found = read_guardian(folder.path)
    return [
        (recorded.wall, recorded.event.cause) for recorded in found if isinstance(recorded.event, GuardianTakesOver)
    ]


def _print_budgets(view: RunView, names: tuple[str, ...], translate: Translate) -> None:
    from reports.tables.budget import budgets

    parameters = view.parameters()
    for name in names:
        if name not in parameters.parameters:
            raise UsageError(
                text(
                    "--budget {name}: the run has no such parameter; {hint}",
                    name=name,
                    hint=nearest(name, list(parameters.parameters)),
                )
            )
    wanted: list[Measured] = []
    for name in names or parameters.parameters:
        wanted += [parameters.parameters[name], *parameters.alternatives[name]]
    console = console_on(sys.stdout)
    console.print(budgets(wanted, translate, console.width))


def schema() -> None:
    """Print the JSON schema (draft 2020-12) of a line of a run's journal."""
    # The validators of all kinds take a while to build.
    from bench.journal.schema import journal_schema

    print_json(journal_schema())


#: `motorbench results RUN`, `results list`, `results schema`, `results unpack RUN` and `results verify RUN`.
command = App(
    name="results",
    help="Show a run, whole or cut off.",
    default_parameter=Parameter(negative=()),
    result_action="return_value",
)
command.default(results)
command.command(list_runs, name="list", help="List the runs of a folder.")
command.command(schema, name="schema", help="Print the JSON schema of the journal.")
command.command("bench.cli.unpack:unpack", name="unpack", help="Unpack a journal into lines of text.")
command.command("bench.cli.verify:verify", name="verify", help="Verify that a run is unchanged.")
