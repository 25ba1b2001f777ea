"""Decision whether a run needs a guardian, and the run's context with one."""

from collections.abc import Collection, Iterator, Sequence
from contextlib import contextmanager
from dataclasses import replace
from pathlib import Path
from uuid import uuid4

from bench.run.context import RunContext
from bench.safety.calls import CallWatches
from bench.safety.guardian.guarded_instruments import needs_guardian
from bench.safety.guardian.link import Guard, GuardianLink, Unguarded
from bench.safety.guardian.protocol import GuardianTask
from bench.safety.guardian.scope import guardian_scope
from bench.safety.interrupts import Interrupts
from bench.safety.liveness import ProgressStamps, Waits, WatchedClock, WatchedOperator, WatchedSharing, watched_prompts
from bench.station.station_file import VIRTUAL
from procedures.core.bench import Role


@contextmanager
def guarded(
    context: RunContext,
    roles: Collection[Role],
    folder: Path,
    interrupts: Interrupts,
    calls: CallWatches,
    *,
    wanted: bool = True,
    lifelines: Sequence[int] = (),
) -> Iterator[tuple[RunContext, Guard]]:
    """Start a guardian for the length of the block where the roles of a run can feed energy that would outlive its process.

    Gives the context, in which every wait looks at requests to stop and is no sign of death, and the guardian, which
    is told of calls that nobody answers. The virtual bench in process ends
    with the process, and what a person sets is the person's to switch off. `lifelines` are file descriptors that it keeps open.
    """
    station, operator = context.station, context.operator
    life = ProgressStamps()
    waits = Waits(interrupts, life, interruptible=context.simulation.in_process is None)
    watched = replace(
        context,
        clock=WatchedClock(context.clock, waits),
        operator=replace(
            operator,
            hands=WatchedOperator(operator.hands, waits),
            prompts=watched_prompts(operator.prompts, waits),
        ),
        sharing=WatchedSharing(context.sharing, waits),
    )
    if not wanted or station.source == VIRTUAL or not needs_guardian(station, roles):
        yield watched, Unguarded()
        return
    charge = GuardianTask(
        str(Path(station.source).resolve()),
        station.content,
        tuple(sorted(role.value for role in roles)),
        str(folder.resolve()),
        station.guardian.heartbeat,
        station.guardian.stalled,
        uuid4().hex,
    )
    guard = GuardianLink(charge, life, interrupts, calls, guardian_scope(), lifelines)
    try:
        yield watched, guard
    finally:
        guard.dismiss(journal_lost=False)
