"""`motorbench study`: what a station will know of a type."""

import math
import os
import sys
from typing import Annotated

from cyclopts import Parameter
from cyclopts.validators import Number

from bench.cli.motor_progress import shown_progress
from bench.cli.options import Json, Language, Seed
from bench.cli.output import print_json
from bench.distribution.workforce import Workforce
from bench.eol.defects.findings import restated
from bench.i18n.language import language_of, translator
from bench.run.console import console_on
from bench.study.ask import Studied, StudyRequest
from bench.study.ask import study as studied
from drivers.interfaces.text import Text, Translate, text, word
from reports.labels import ParameterLabels

#: An interval holds the truth this often, or it is worth a word.
_WANTED = 0.95
_WIDTH = 110


def study(
    *procedures: str,
    motor: str,
    station: str = "virtual",
    motors: Annotated[int, Parameter(validator=Number(gte=1, lte=1_000_000))] = 100,
    set_: Annotated[tuple[str, ...], Parameter(name="--set")] = (),
    spread: tuple[str, ...] = (),
    operator: str = "",
    jobs: Annotated[int | None, Parameter(validator=Number(gte=1, lte=1024))] = None,
    cluster: str = "",
    seed: Seed = 0,
    json: Json = False,
    language: Language = "auto",
) -> int:
    """Tell what a station will know of a type of motor: motors drawn from it, measured on the station's virtual twin.

    Nothing of the station is opened. Each motor meets instruments of its own, whose errors are drawn within their data sheets.

    Parameters
    ----------
    procedures
        Names as `motorbench procedures` lists them, or `all`.
    motor
        The type: a motor file, or the name of a shipped motor.
    station
        A station file, or `virtual`. Its drivers run on simulated instruments.
    motors
        How many motors are drawn.
    set_
        A setting, `name=value` or `procedure.name=value`; may be given several times.
    spread
        Spread of the motors, as a standard deviation in per cent: resistance=1.5; also inductance, flux, inertia, friction.
    operator
        fixture or virtual (simulated hands). Default: the station's usual operator.
    jobs
        Number of processes. Default: one for each core. The figures do not depend on it.
    cluster
        Address of a Dask scheduler whose workers do the work, or local for a cluster started here.
    seed
        Seed of the motors and benches.

    """
    translate = translator(language_of(language))
    with shown_progress(text("motors"), translate) as progress:
        done = studied(
            StudyRequest(
                procedures or ("all",),
                motor,
                station,
                motors,
                seed,
                Workforce(jobs or len(os.sched_getaffinity(0)), cluster),
                set_,
                spread,
                operator,
                progress,
            )
        )
    if json:
        print_json(
            {
                **done.worth.as_dict(),
                "spread": done.spread.model_dump(include={"resistance", "inductance", "flux", "inertia", "friction"}),
                "assumed": list(done.assumed),
                "differences": [each.render() for each in done.differences],
            }
        )
    else:
        _print(done, translate)
    return 0 if done.worth.complete else 1


def _print(done: Studied, translate: Translate) -> None:
    from rich.box import SIMPLE
    from rich.table import Table

    console, worth = console_on(sys.stdout), done.worth

    def say(said: Text) -> None:
        console.print(said.render(translate), markup=False, width=_WIDTH)

    if not worth.complete:
        say(text("Partial: stopped after {done} motors", done=worth.motors))
    headings = (
        text("Parameter"), text("Procedure"), Text("U (95 %)"), text("interval holds"), text("bias"), text("farthest / U"),
        text("withheld"),
    )  # fmt: skip
    title = text("{motors} motors of the type", motors=worth.motors)
    table = Table(
        *(each.render(translate) for each in headings), title=title.render(translate), box=SIMPLE, pad_edge=False
    )
    table.columns[1].no_wrap = True
    names = {each.parameter for each in worth.figures}
    for each in worth.figures:
        if restated(each.parameter, names):
            continue
        low, high = each.held.interval
        share = "" if math.isnan(low) else f" ({100.0 * low:.0f} … {100.0 * high:.0f} %)"
        table.add_row(
            ParameterLabels({})[each.parameter].render(translate),
            word(each.procedure).render(translate),
            _per_cent(each.expanded),
            f"{each.held.hits}/{each.held.count}{share}" + (" !" if high < _WANTED else ""),
            _per_cent(each.bias, "+"),
            "–" if math.isnan(each.farthest) else f"{each.farthest:.2f}",
            str(each.withheld) if each.withheld else "",
        )
    console.print(table, width=_WIDTH)
    for procedure, why, count in worth.refused:
        say(text("{procedure} refused {count} motors: {why}", procedure=word(procedure), count=count, why=why))
    if done.assumed:
        say(text("Assumed for the motor, because its file has no [virtual]: {names}", names=list(done.assumed)))
    for difference in done.differences:
        say(Text("! {difference}", {"difference": difference}))


def _per_cent(share: float, sign: str = "") -> str:
    return "–" if math.isnan(share) else f"{100.0 * share:{sign}.3g} %"
