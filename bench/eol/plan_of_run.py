"""A plan made from a measured motor: what the run measured, within limits about what it found."""

import math
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from tomli_w import dumps as toml_text

from bench.eol.line.preparation.declared_order import in_declared_order
from bench.eol.line.preparation.procedure_order import as_listed
from bench.eol.plan import Plan, PlannedCheck, load_plan
from bench.files.new_file import write_new
from bench.files.toml_file import parse
from bench.i18n.errors import FileError
from bench.journal.journal_file import read_journal
from bench.journal.run_folder import RunFolder
from bench.journal.run_view import view_of
from bench.motor.shipped_motors import shipped_motors
from bench.plugins.files import catalogues_of_run
from bench.run.plan import make_plan
from drivers.interfaces.text import text
from procedures.core.parameters import PARAMETERS
from procedures.core.result import Parameter

#: Limits are no narrower than this many expanded uncertainties of the figure that they stand about.
_LEAST_RATIO = 2.0


@dataclass(frozen=True)
class MadePlan:
    """A plan that was written, with the parameters that it limits and those that it does not."""

    plan: Plan
    limited: tuple[str, ...]
    unlimited: tuple[str, ...]


def plan_of_run(folder: RunFolder, path: Path, percent: float) -> MadePlan:
    """Write a plan with those procedures of a run that knew a figure best, their settings, and limits of ± `percent` about it.

    They come in the run's order, but for safety tests and what corrects an instrument: these come first.
    A limit that the run's own uncertainty could not decide is as much wider; a count must be met. The motor's file is written
    beside the plan where it is none that comes with the program.
    Raises InputError where the run measured nothing, a file is there already, or cannot be written.
    """
    view = view_of(read_journal(folder.journal).events)
    start = view.start
    figures = {name: each for name, each in view.parameters().parameters.items() if each.source == "measured"}
    if start is None or not figures:
        raise FileError(
            text("{run}: no parameter was measured, but a plan needs figures to set its limits", run=folder.path)
        )
    restated = {name for name in figures if name in PARAMETERS and PARAMETERS[name].restates in figures}
    limits = {name: _limit(each, percent) for name, each in figures.items() if name not in restated}
    limited = {name: limit for name, limit in limits.items() if limit is not None}
    best = {each.procedure for each in figures.values()}
    given = make_plan(view.planned, start.settings, catalogues_of_run(start.software).procedures)
    done = [each for each in given if each.name in best]
    checks = [
        PlannedCheck(each.name, each.settings.model_dump(mode="json", exclude_unset=True), 1, "stop", 1)
        for each in done
    ]
    shipped = start.motor.source in shipped_motors()
    motor = start.motor.source if shipped else f"{path.stem}-motor.toml"
    data = {
        "plan": {"name": path.stem, "motor": motor},
        "procedure": [
            {"name": check.name, **({"settings": dict(check.settings)} if check.settings else {})}
            for check in as_listed(in_declared_order(checks, done))
        ],
        "limit": list(limited.values()),
        "golden": {name: figures[name].value for name, limit in limited.items() if "percent" in limit},
    }
    said = f"# Limits about one motor, {start.motor.name} {start.motor.serial_number}, run {folder.path.name}.".replace(
        " ,", ","
    )
    content = said + "\n# motorbench eol check tells what they catch, and how long a motor takes.\n" + toml_text(data)
    parse(content.encode(), str(path))
    write_new(path, content)
    if not shipped:
        write_new(path.with_name(motor), start.motor_file)
    return MadePlan(load_plan(path), tuple(limited), tuple(name for name, limit in limits.items() if limit is None))


def _limit(figure: Parameter, percent: float) -> dict[str, Any] | None:
    low, high = figure.coverage_interval
    if figure.unit == "1" and low == high:
        return {"parameter": figure.name, "low": figure.value, "high": figure.value}
    # A share of what is a deviation itself, or nothing, says nothing.
    if figure.unit in ("%", "°", "1") or not figure.value:
        return None
    own = 100.0 * _LEAST_RATIO * (high - low) / 2.0 / abs(figure.value)
    return {"parameter": figure.name, "percent": float(max(percent, math.ceil(own))), "of": "golden"}
