"""`motorbench eol plan`: a plan from a measured motor."""

import sys
from pathlib import Path
from shlex import quote

from bench.cli.options import Json
from bench.cli.output import print_json
from bench.i18n.errors import UsageError
from bench.i18n.language import language_of, translator
from drivers.interfaces.text import text


def plan(
    run: str = "latest",
    *,
    output: Path,
    percent: float = 10.0,
    runs: Path = Path("runs"),
    json: Json = False,
    language: str = "auto",
) -> int:
    """Write a plan from a measured motor: the run's procedures and settings, limits about what it found.

    Parameters
    ----------
    run
        The run's folder, its name under `--runs`, or latest.
    output
        The plan file to create. It must not exist yet.
    percent
        Half the width of the limits, in per cent of the motor's figure. The limits are wider if the run measured the figure
        with a larger uncertainty.
    runs
        The folder of the runs.
    language
        en, zh, or auto (by the locale). Default for JSON: en.

    """
    from bench.eol.plan_of_run import plan_of_run
    from bench.journal.run_folder import existing_run_folder

    translate = translator(language_of(language))
    if not 0.0 < percent <= 100.0:
        raise UsageError(text("--percent {percent:g}: allowed is a number above 0, up to 100", percent=percent))
    made = plan_of_run(existing_run_folder(run, runs), output, percent)
    if json:
        print_json({"plan": str(output), "limited": list(made.limited), "unlimited": list(made.unlimited)})
        return 0
    messages = [text("{path}: {count} limits", path=output, count=len(made.limited))]
    if made.unlimited:
        messages.append(text("Measured without a limit: {names}", names=list(made.unlimited)))
    messages.append(text("Next: motorbench eol check {path}", path=quote(str(output))))
    sys.stdout.writelines(line.render(translate) + "\n" for line in messages)
    return 0
