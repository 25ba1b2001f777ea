"""Outputs that a finished motor's record is handed to, besides where motorbench keeps it itself."""

import queue
import threading
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from pkgutil import resolve_name
from time import monotonic
from typing import Any

from drivers.interfaces.text import Text, text, text_of

#: How long (s) an output may take over what is left when a run or a batch ends.
PATIENCE = 10.0
#: For how long (s) an output may have one record before it is said while the batch goes on.
HANGS = 60.0
#: Takes a record in JSON's types, and the folder of the runs or of the batch that it belongs to.
Store = Callable[[Mapping[str, Any], Path], None]


@dataclass(frozen=True)
class RecordOutput:
    """Something that takes finished records; `store`, written as `module:object`, is imported when it is first needed.

    A record has `kind`: `motor` with the fields of `bench.eol.record.MotorRecord`, or `run` with those of `result.json`.
    """

    name: str
    store: str | Store


class RecordOutputs:
    """Hands records to outputs, each on a thread of its own: one that fails or hangs holds up neither the line nor the others.

    `failed` is told, on the caller's thread, which output did not take which record and why. The record itself is kept elsewhere.
    """

    def __init__(self, outputs: Sequence[RecordOutput], folder: Path, failed: Callable[[Text], None]) -> None:
        self._failed = failed
        self._faults: queue.SimpleQueue[Text] = queue.SimpleQueue()
        self._outputs = [_Handing(output, folder, self._faults.put) for output in outputs]

    @property
    def wanted(self) -> bool:
        """True if there is an output."""
        return bool(self._outputs)

    def hand(self, record: Mapping[str, Any]) -> None:
        """Hand a record to every output."""
        for output in self._outputs:
            output.records.put(record)
            if (hanging := output.hanging()) is not None:
                self._failed(hanging)
        self._tell()

    def close(self, patience: float = PATIENCE) -> None:
        """Wait until all is handed over, for `patience` (s) at most, and tell what was not."""
        for output in self._outputs:
            output.records.put(None)
        for output in self._outputs:
            output.thread.join(patience)
        self._tell()
        for output in self._outputs:
            if output.thread.is_alive():
                self._failed(
                    text(
                        "output {name}: records that were not taken in time: {left}", name=output.name, left=output.left
                    )
                )

    def _tell(self) -> None:
        while not self._faults.empty():
            self._failed(self._faults.get())


class _Handing:
    def __init__(self, output: RecordOutput, folder: Path, failed: Callable[[Text], None]) -> None:
        self.name = output.name
        self.records: queue.SimpleQueue[Mapping[str, Any] | None] = queue.SimpleQueue()
        self._output, self._folder, self._failed = output, folder, failed
        self._busy = False
        #: Since when (s, monotonic) it has the present record, whose motor it is, and whether it was said that it hangs.
        self._since, self._motor, self._told = 0.0, "", False
        self.thread = threading.Thread(target=self._run, name=f"records {output.name}", daemon=True)
        self.thread.start()

    @property
    def left(self) -> int:
        """The number of records that have not been taken."""
        return max(0, self.records.qsize() - 1) + self._busy

    def hanging(self) -> Text | None:
        """Return, once for each record, what says that it has had one for very long."""
        if not self._busy or self._told or monotonic() - self._since < HANGS:
            return None
        self._told = True
        return text(
            "output {name} has not taken the record of {motor} for {time:.0f} s; records that wait for it: {left}. The line goes on, and "
            "no record is lost: motorbench eol export gives them again",
            name=self.name,
            motor=self._motor,
            time=monotonic() - self._since,
            left=self.records.qsize(),
        )

    def _run(self) -> None:
        while (record := self.records.get()) is not None:
            self._since, self._told = monotonic(), False
            self._motor = str(record.get("serial_number") or record.get("run") or "?")
            self._busy = True
            try:
                store = self._output.store
                (resolve_name(store) if isinstance(store, str) else store)(record, self._folder)
            except BaseException as error:  # noqa: BLE001  a stranger's code may raise anything, sys.exit() too
                self._failed(
                    text(
                        "output {name} did not take the record of {motor}: {kind}: {error}",
                        name=self.name,
                        motor=self._motor,
                        kind=type(error).__name__,
                        error=text_of(error),
                    )
                )
            self._busy = False
