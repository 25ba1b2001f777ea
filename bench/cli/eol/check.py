"""`motorbench eol check`: a plan tried before a motor comes."""

import math
import os
import sys
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

from cyclopts import Parameter
from cyclopts.validators import Number

from bench.cli.eol.defects_output import as_json, print_defects, print_proposal, shown_range
from bench.cli.motor_progress import shown_progress
from bench.cli.options import Json, Language, Seed
from bench.cli.output import print_json
from bench.distribution.workforce import Workforce
from bench.eol.defects.check import DefectRequest, check_defects
from bench.eol.defects.proposal import LEAST_SOUND, write_plan
from bench.eol.line.preparation.dry_run import DryRun, dry_run
from bench.eol.line.preparation.prepare import BatchRequest
from bench.i18n.errors import UsageError
from bench.i18n.language import language_of, translator
from bench.run.console import console_on
from drivers.interfaces.text import Text, Translate, text, word

if TYPE_CHECKING:
    from rich.console import Console

#: A cycle that is by more than this above its floor is worth a word.
_MUCH = 0.1


def check(
    plan: Path,
    *,
    station: str = "virtual",
    sockets: int | None = None,
    motors: int | None = None,
    operator: str = "",
    each: Annotated[int, Parameter(validator=Number(gte=0, lte=10_000))] = 4,
    sound: Annotated[int, Parameter(validator=Number(gte=0, lte=1_000_000))] = 100,
    jobs: Annotated[int | None, Parameter(validator=Number(gte=1, lte=1024))] = None,
    cluster: str = "",
    output: Path | None = None,
    seed: Seed = 0,
    json: Json = False,
    language: Language = "auto",
) -> int:
    """Try a plan on virtual benches, twins of a station that is named: time, limits that cannot be decided, defects that get through.

    Parameters
    ----------
    plan
        The plan's file.
    station
        The line's station file, or `virtual`. Its drivers run on simulated instruments; no instrument of the station is opened.
    sockets
        Number of sockets, if the station file does not state it.
    motors
        Number of motors from which the times are found. Default: three for each socket.
    operator
        virtual: simulated hands do the work of the fixture.
    each
        Number of motors with each defect at each severity; 0 for none.
    sound
        Number of motors without a defect, drawn from the type's spread.
    jobs
        Number of processes. Default: one for each core. The figures do not depend on it.
    cluster
        Address of a Dask scheduler whose workers do the work, or local for a cluster started here.
    output
        Write the plan to this file, with limits and an order that follow from the result. The file must not exist yet.
    seed
        Seed of the virtual motors and benches.

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
    translate = translator(language_of(language))
    if output is not None and output.exists():
        raise UsageError(text("{path}: already exists; choose another name, or remove it", path=output))
    if output is not None and (not each or sound < LEAST_SOUND):
        # Told now, and not when all have been measured.
        raise UsageError(
            text(
                "--output: limits are calculated from motors with defects and from the spread of at least "
                "{least} sound motors; give --each 1 and --sound {least} at least",
                least=LEAST_SOUND,
            )
        )
    with shown_progress(text("motors of the type"), translate) as progress:
        done = dry_run(request, progress=progress)
    if not json:
        _print(console_on(sys.stdout, markup=False), done, translate)
    checked, proposal = None, None
    if each or sound:
        workforce = Workforce(jobs or len(os.sched_getaffinity(0)), cluster)
        with shown_progress(text("motors with and without defects"), translate) as progress:
            checked = check_defects(request, DefectRequest(each, sound, workforce, progress))
        if not json:
            print_defects(checked, translate)
        # What was stopped speaks for no limit.
        if output is not None and checked.findings.complete:
            proposal = checked.propose()
            message = f"Limits and order by motorbench eol check of {plan}, seed {seed}."
            write_plan(proposal, checked.plan, output, message)
            if not json:
                print_proposal(proposal, checked, output, translate)
    if json:
        print_json({**done.as_dict(), **({"defect_check": as_json(checked, proposal)} if checked else {})})
    good = checked is None or checked.findings.good
    return 0 if done.good and good else 1


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
        unit = "" if limit.unit == "1" else limit.unit
        limits.add_row(
            say(done.labels[limit.parameter]),
            "–" if math.isnan(limit.value) else f"{limit.value:.5g} {unit}".rstrip(),
            "–" if math.isnan(limit.expanded) else f"{limit.expanded:.2g}",
            shown_range(limit.low, limit.high),
            f"{limit.ratio:.3g}" if math.isfinite(limit.ratio) else "–",
            say(limit.fault) if limit.fault else "✓",
        )
    console.print(limits)
    cycle = text(
        "Cycle time {cycle:.1f} s a motor, {times:.2f} × the physical minimum of {floor:.1f} s: {waits:.1f} s of "
        "waiting for other sockets, software {overhead:.1f} %",
        cycle=done.cycle,
        times=done.over_floor,
        floor=done.floor,
        waits=done.waits,
        overhead=100.0 * done.overhead,
    )
    console.print(say(cycle))
    if done.over_floor > 1.0 + _MUCH:
        console.print(say(text("! The cycle is more than a tenth longer than the physical minimum")))
    rate = text("Sockets: {sockets}; {rate:.0f} motors an hour", sockets=done.sockets, rate=done.per_hour)
    console.print(say(rate))
    if done.assumed:
        assumed = text("Assumed for the motor, because its file has no [virtual]: {names}", names=list(done.assumed))
        console.print(say(assumed))
    for difference in done.differences:
        console.print(f"! {difference}")
    for words in (*done.unverified, *done.notes):
        console.print(f"! {say(words)}")
    for trouble in done.troubles:
        console.print(f"✗ {say(trouble)}")
