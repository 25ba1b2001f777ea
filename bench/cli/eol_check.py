"""`motorbench eol check`: a plan tried before a motor comes."""

import math
import sys
from pathlib import Path
from typing import TYPE_CHECKING

from bench.cli.options import Seed
from bench.cli.output import print_json
from bench.eol.line.dry_run import DryRun, dry_run
from bench.eol.line.preparation import BatchRequest
from bench.i18n.language import language_of, translator
from bench.run.console import console_on
from drivers.interfaces.text import Text, Translate, text, word
from reports.labels import ParameterLabels

if TYPE_CHECKING:
    from rich.console import Console

#: Software that adds more than this to a cycle is worth a word.
_MUCH = 0.1


def check(
    plan: Path,
    *,
    station: str = "virtual",
    sockets: int | None = None,
    motors: int | None = None,
    operator: str = "",
    seed: Seed = 0,
    json: bool = False,
    language: str = "auto",
) -> int:
    """Try a plan on virtual benches, twins of a station that is named: time against the physical floor, limits that cannot be decided.

    Parameters
    ----------
    plan
        The plan's file.
    station
        The line's station file, whose drivers are tried on simulated instruments and of which nothing is opened, or `virtual`.
    sockets
        How many sockets, where the station file does not say.
    motors
        How many motors are tried; as many as there are sockets, and two at least.
    operator
        virtual: hands do what a fixture does otherwise.
    seed
        Seed of the virtual benches.
    json
        Print one JSON object and nothing else.
    language
        en, zh, or auto by the locale.

    """
    request = BatchRequest(
        plan=plan,
        station=station,
        runs=Path(),
        sockets=sockets,
        motors=motors,
        operator=operator,
        seed=seed,
    )
    done = dry_run(request)
    if json:
        print_json(done.as_dict())
    else:
        _print(console_on(sys.stdout), done, translator(language_of(language)))
    return 0 if done.good else 1


def _print(console: "Console", done: DryRun, translate: Translate) -> None:
    from rich.table import Table

    def say(said: Text) -> str:
        return said.render(translate)

    headings = text("Procedure"), text("time, s"), text("floor, s"), text("overhead")
    title = text("{plan}: {count} motors of the type", plan=done.plan, count=done.motors)
    times = Table(*map(say, headings), title=say(title))
    for each in done.procedures:
        times.add_row(
            say(word(each.procedure)), f"{each.time:.2f}", f"{each.floor:.2f}", f"{100.0 * each.overhead:.1f} %"
        )
    console.print(times)
    columns = text("Parameter"), text("of the type"), Text("± (95 %)"), text("limits"), text("tolerance / interval")
    limits = Table(*map(say, columns), "")
    for limit in done.limits:
        limits.add_row(
            say(ParameterLabels({})[limit.parameter]),
            "–" if math.isnan(limit.value) else f"{limit.value:.5g} {limit.unit}",
            "–" if math.isnan(limit.expanded) else f"{limit.expanded:.2g}",
            f"{limit.low:.5g} … {limit.high:.5g}",
            "–" if math.isnan(limit.ratio) else f"{limit.ratio:.3g}",
            limit.fault or "✓",
        )
    console.print(limits)
    cycle = text(
        "Cycle {cycle:.1f} s a motor ({waits:.1f} s of it waiting for other sockets and in the shutdown); physical floor {floor:.1f} s, "
        "overhead {overhead:.1f} %",
        cycle=done.cycle,
        waits=done.waits,
        floor=done.floor,
        overhead=100.0 * done.overhead,
    )
    much = say(text(" (more than a tenth)")) if done.overhead > _MUCH else ""
    console.print(say(cycle) + much, markup=False)
    rate = text("Sockets: {sockets}; {rate:.0f} motors an hour", sockets=done.sockets, rate=done.per_hour)
    console.print(say(rate), markup=False)
    if done.assumed:
        assumed = text("Assumed of the motor, for its file has no [virtual]: {names}", names=list(done.assumed))
        console.print(say(assumed), markup=False)
    for difference in done.differences:
        console.print(f"! {difference}", markup=False)
    for trouble in done.troubles:
        console.print(f"✗ {trouble}", markup=False)
