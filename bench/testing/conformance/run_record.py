"""The record of a procedure's run: whole, what the journal comes to, and all that acts on an instrument within a step."""

from collections.abc import Iterator

from bench.journal.events.instruments import Commanding, Energising, SettingDone
from bench.journal.events.run import ProcedureFailed, ProcedureFinished, ProcedureStarted
from bench.journal.journal_file import read_journal
from bench.journal.verify import verify
from bench.testing import MeasuredRun
from bench.testing.conformance.report import Checks
from procedures.core.events import StepFailed, StepFinished, StepStarted

_ACTING = (Commanding, Energising, SettingDone)


def check_record(ran: MeasuredRun, checks: Checks, name: str, when: str) -> None:
    """Check a run's record, as `motorbench results verify` does, and that what the procedure `name` set stands in steps."""
    verification = verify(ran.folder)
    wrong = "; ".join([*map(str, verification.findings), *([verification.unproven] if verification.unproven else [])])
    remedy = "Report nothing but what a record can hold, and leave its folder alone"
    checks.that(f"the record is whole {when}", not wrong, wrong, remedy)
    outside = sorted(set(_outside(ran, name)))
    advice = (
        "Set and switch instruments in methods that are decorated with @step: a record tells what was done, and why"
    )
    checks.that(f"instruments are set and switched in steps {when}", not outside, ", ".join(outside), advice)


def _outside(ran: MeasuredRun, name: str) -> Iterator[str]:
    """Give what a procedure set and switched in none of its steps."""
    running, depth = False, 0
    for recorded in read_journal(ran.folder.journal).events:
        match recorded.event:
            case ProcedureStarted(procedure=started):
                running = started == name
            case ProcedureFinished() | ProcedureFailed():
                running = False
            case StepStarted():
                depth += 1
            case StepFinished() | StepFailed():
                depth -= 1
            case event if isinstance(event, _ACTING) and running and not depth:
                yield f"{event.instrument}.{event.call}"
