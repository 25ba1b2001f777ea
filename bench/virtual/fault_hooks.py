"""What ties a run to the faults of its virtual bench: steps told as they begin, faults put into the record."""

from collections.abc import Callable, Mapping
from contextlib import suppress
from typing import Any

from procedures.core.bench import Recorder

#: Takes a step's identifier and its procedure's name.
StepStarted = Callable[[str, str], None]
#: Takes "fault_began" or "fault_mended" and the fault as it was given.
FaultHeard = Callable[[str, dict[str, Any]], None]


class StepTeller:
    """Hears a journal's events and tells the bench which step of which procedure begins."""

    def __init__(self, told: StepStarted) -> None:
        self._told = told
        self._procedure = ""

    def hear(self, kind: str, data: Mapping[str, Any]) -> None:
        """Take an event; those that begin nothing are passed over."""
        if kind == "procedure_started":
            self._procedure = data["procedure"]
        elif kind == "step_started":
            self._told(data["step"], self._procedure)


def recording(recorder: Recorder) -> FaultHeard:
    """Return what puts a fault that begins or mends into the record."""

    def heard(kind: str, fault: dict[str, Any]) -> None:
        # It happens in the middle of whoever waits on the bench: a full disk is for the run's own next event to find.
        with suppress(OSError):
            recorder.event(kind, fault=fault)

    return heard
