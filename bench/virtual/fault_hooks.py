"""Connects a run with the faults of its virtual bench: announces steps as they begin, and records faults."""

from collections.abc import Callable, Sequence
from contextlib import suppress
from typing import TYPE_CHECKING, Any

from bench.i18n.errors import FileError, at
from bench.journal.events.run import FaultBegan, FaultMended, ProcedureStarted
from drivers.interfaces.text import text_of
from procedures.core.bench import Recorder
from procedures.core.events import Event, StepStarted

if TYPE_CHECKING:
    from bench.virtual.fault_file import GivenFault
    from sim_instruments.faults.description import Description

#: Takes a step's identifier and its procedure's name.
StepListener = Callable[[str, str], None]
#: Takes "fault_began" or "fault_mended" and the fault as it was given.
FaultListener = Callable[[str, dict[str, Any]], None]


def inject(faults: "Sequence[GivenFault]", add: "Callable[[Description], object]") -> None:
    """Add each to a bench. Raises InputError where the bench cannot have it."""
    for fault in faults:
        try:
            add(fault.described)
        except (ValueError, RuntimeError) as error:
            raise FileError(at(fault.source, text_of(error))) from None


class StepReporter:
    """Listens to a journal's events and tells the bench which step of which procedure begins."""

    def __init__(self, listener: StepListener) -> None:
        self._listener = listener
        self._procedure = ""

    def hear(self, event: Event) -> None:
        """Take an event; those that begin nothing are passed over."""
        if isinstance(event, ProcedureStarted):
            self._procedure = event.procedure
        elif isinstance(event, StepStarted):
            self._listener(event.step, self._procedure)


def recording(recorder: Recorder) -> FaultListener:
    """Return what puts a fault that begins or mends into the record."""

    def heard(kind: str, fault: dict[str, Any]) -> None:
        # It happens in the middle of whoever waits on the bench: a full disk is for the run's own next event to find.
        with suppress(OSError):
            recorder.record(FaultBegan(fault=fault) if kind == FaultBegan.kind else FaultMended(fault=fault))

    return heard
