"""A run as the panel meets it, played: its journal and its line, and whatever is to be shown and asked on them."""

import threading
from collections.abc import Iterator, Mapping
from contextlib import contextmanager
from pathlib import Path
from typing import Any, Self

from bench.journal.journal import Journal
from bench.operators.operator_channel import OperatorLine
from bench.operators.stored_plot import store_plot
from procedures.core.live_plot import LivePlot
from tests.journals import event


class ShownRun:
    """A run of one procedure, at a bench time (s) of its own; `start` is what its beginning holds besides."""

    def __init__(self, folder: Path, procedure: str, step: str, words: str, **start: Any) -> None:
        folder.mkdir(parents=True)
        self.name = folder.name
        self.time = 0.0
        self._asked = 0
        self._line = OperatorLine(self._hear)
        #: What was answered, in its order.
        self.answers: list[object] = []
        self._journal = Journal(folder / "journal.jsonl", lambda: self.time)
        self.record("run_started", procedures=[procedure], settings=[], motor={"name": "M"}, truth={}, **start)
        self.record("procedure_started", procedure=procedure, steps={step: words})
        self.record("step_started", step=step, text=words)
        self._line.announce(folder)

    def __enter__(self) -> Self:
        return self

    def __exit__(self, *_: object) -> None:
        self._line.close()
        self._journal.close()

    def record(self, kind: str, **data: Any) -> None:
        """Have something happen."""
        self._journal.record(event(kind, **data))  # type: ignore[arg-type]  # a kind that there is

    def read(self, instrument: str, call: str, **value: Any) -> None:
        """Have an instrument give a reading."""
        self.record("reading", instrument=instrument, call=call, value={"time": self.time, **value})

    def show(self, plot: LivePlot) -> None:
        """Show a plot."""
        self._line.say({"plot": store_plot(plot)})

    def ask(self, kind: str, **more: Any) -> None:
        """Ask something, until it is answered."""
        self._asked += 1
        self._line.say({"question": {"id": self._asked, "kind": kind, **more}})

    def _hear(self, message: Mapping[str, Any]) -> None:
        if "answer" in message:
            self.answers.append(message["answer"])
            self._line.say({"question": None})

    def tell(self, sources: list[Mapping[str, Any]]) -> None:
        """Say what the sources read back."""
        self._line.tell({"sources": sources})

    @contextmanager
    def reading_back(self, sources: list[Mapping[str, Any]]) -> Iterator[None]:
        """Say it again and again for the length of the block, as a run does; what was said once grows old on a busy machine."""
        ended = threading.Event()

        def tell() -> None:
            while not ended.wait(0.3):
                self.tell(sources)

        thread = threading.Thread(target=tell)
        thread.start()
        try:
            yield
        finally:
            ended.set()
            thread.join()
