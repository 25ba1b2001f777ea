"""`motorbench report`: a run as a page and as a PDF."""

import sys
from pathlib import Path

from bench.cli.options import Runs
from bench.cli.output import print_json
from bench.i18n.errors import UsageError
from drivers.interfaces.text import text

FORMATS = ("html", "pdf", "both")
LANGUAGES = ("en", "zh", "both", "auto")


def report(
    run: str,
    *,
    language: str = "auto",
    format: str = "both",  # noqa: A002  the option's name
    output: Path | None = None,
    json: bool = False,
    runs: Runs = Path("runs"),
) -> int:
    """Write a run's report: identity, parameters with uncertainty, every procedure with its steps, readings, plots and budgets.

    Parameters
    ----------
    run
        The run's folder, its name under `--runs`, or `latest`.
    language
        en, zh, both (side by side), or auto by the locale.
    format
        html, pdf or both.
    output
        Folder to write to. Default: the run's folder.
    json
        Print one JSON object and nothing else: the files.

    """
    if format not in FORMATS:
        raise UsageError(text("--format {format}: allowed are {names}", format=format, names=FORMATS))
    if language not in LANGUAGES:
        raise UsageError(text("--language {language}: allowed are {names}", language=language, names=LANGUAGES))
    from bench.journal.finished_run import read_run
    from bench.report.files import rendered, write_both, write_page, write_paper

    read = read_run(run, runs)
    made = rendered(read, language)
    folder = output or read.folder.path
    written = {}
    if format == "both":
        written["html"], written["pdf"] = write_both(made, folder, language)
    elif format == "html":
        written["html"] = write_page(made, folder, language)
    else:
        written["pdf"] = write_paper(made, folder, language)
    if json:
        print_json({"report": {kind: str(path) for kind, path in written.items()}})
    else:
        for path in written.values():
            print(path)
    sys.stdout.flush()
    return 0
