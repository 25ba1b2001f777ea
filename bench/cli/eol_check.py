"""`motorbench eol check`: a plan tried before a motor comes."""

import math
import sys
from pathlib import Path
from typing import TYPE_CHECKING

from bench.cli.options import Seed
from bench.cli.output import print_json
from bench.eol.line.dry_run import DryRun, dry_run
from bench.eol.line.preparation import BatchRequest
from bench.run.console import console_on

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
        _print(console_on(sys.stdout), done)
    return 0 if done.good else 1


def _print(console: "Console", done: DryRun) -> None:
    from rich.table import Table

    times = Table(
        "procedure", "time, s", "floor, s", "overhead", title=f"{done.plan}: {done.motors} motors of the type"
    )
    for each in done.procedures:
        times.add_row(each.procedure, f"{each.time:.2f}", f"{each.floor:.2f}", f"{100.0 * each.overhead:.1f} %")
    console.print(times)
    limits = Table("parameter", "of the type", "± (95 %)", "limits", "tolerance / interval", "")
    for limit in done.limits:
        limits.add_row(
            limit.parameter,
            "–" if math.isnan(limit.value) else f"{limit.value:.5g} {limit.unit}",
            "–" if math.isnan(limit.expanded) else f"{limit.expanded:.2g}",
            f"{limit.low:.5g} … {limit.high:.5g}",
            "–" if math.isnan(limit.ratio) else f"{limit.ratio:.3g}",
            limit.fault or "✓",
        )
    console.print(limits)
    much = " (more than a tenth)" if done.overhead > _MUCH else ""
    console.print(
        f"Cycle {done.cycle:.1f} s a motor ({done.waits:.1f} s of it waiting for other sockets and in the shutdown); "
        f"physical floor {done.floor:.1f} s, overhead {100.0 * done.overhead:.1f} %{much}\n"
        f"Sockets: {done.sockets}; {done.per_hour:.0f} motors an hour",
        markup=False,
    )
    if done.assumed:
        console.print(f"Assumed of the motor, for its file has no [virtual]: {', '.join(done.assumed)}", markup=False)
    for difference in done.differences:
        console.print(f"! {difference}", markup=False)
    for trouble in done.troubles:
        console.print(f"✗ {trouble}", markup=False)
