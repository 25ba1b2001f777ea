"""One line that says which step is under way."""

from collections.abc import Mapping
from typing import TYPE_CHECKING

from bench.journal.events.run import KnownBefore, ProcedureStarted, RunFinished
from procedures.core.events import Event, StepStarted

if TYPE_CHECKING:
    from rich.console import Console


class Progress:
    """Listens to a journal's events and shows the present step: one changing line on a live terminal, else a line a step.

    `titles` are what the procedures, by their names, are called there, in the run's order.
    """

    def __init__(self, console: "Console", titles: Mapping[str, str], *, live: bool) -> None:
        self._console = console
        self._titles = titles
        self._names = list(titles)
        self._live = live and console.is_terminal
        self._procedure = ""
        self._sentences: Mapping[str, str] = {}

    def hear(self, event: Event) -> None:
        """Take an event; those that begin no step are passed over."""
        match event:
            case ProcedureStarted():
                self._procedure, self._sentences = event.procedure, event.steps
                if self._live:
                    self._show(self._place())
            case StepStarted():
                sentence = self._sentences.get(event.step, event.text)
                self._show(f"{self._place()}  §{event.step}  {sentence}")
            case KnownBefore():
                self._say(f"{event.warning.identifier}: {event.message}")
            case RunFinished():
                self.end()

    def end(self) -> None:
        """Clear the changing line."""
        if self._live:
            self._console.file.write("\r\x1b[2K")
            self._console.file.flush()

    def _say(self, line: str) -> None:
        """Print a line that stays."""
        self.end()
        self._console.print(line, markup=False)

    def _place(self) -> str:
        number = self._names.index(self._procedure) + 1 if self._procedure in self._names else 0
        return f"[{number}/{len(self._names)}] {self._titles.get(self._procedure, self._procedure)}"

    def _show(self, line: str) -> None:
        from rich.cells import set_cell_size

        if self._live:
            line = "\r\x1b[2K" + set_cell_size(line, self._console.width - 1).rstrip()
        else:
            line += "\n"
        self._console.file.write(line)
        self._console.file.flush()
