"""A run's page, drawn in a process of its own while the run goes on: when the run ends, little is left to do.

A page takes a second that the run does not wait for where there is a second processor. The process hears of each finished procedure
by a line on its standard input, the run's folder; at the input's end it writes the page and says where it is.
"""

import os
import subprocess
import sys
from collections.abc import Iterable
from pathlib import Path
from types import TracebackType
from typing import Self

from bench.journal.events.run import ProcedureFinished, RunStarted
from bench.report.files import rendered, speech, write_page
from procedures.core.events import Event


class ReportAhead:
    """The process, as the run sees it: hears the journal, gives the page's path. Leaving it ends the process, whatever happened."""

    def __init__(self, language: str) -> None:
        self._folder = ""
        # Ctrl-C is the run's to answer: the page follows it.
        self._process = subprocess.Popen(  # noqa: S603  ourselves, with nothing of the user's but a language
            [sys.executable, "-P", "-m", "bench.report.ahead", language],
            stdin=subprocess.PIPE,
            stdout=subprocess.PIPE,
            stderr=subprocess.DEVNULL,
            text=True,
            env={**os.environ, "PYTHONPATH": str(Path(__file__).parents[2])},
            start_new_session=True,
        )

    def hear(self, event: Event) -> None:
        """Take the run's folder from its first event, and pass on that a procedure is done."""
        if isinstance(event, RunStarted):
            self._folder = str(Path(event.run).resolve())
        elif isinstance(event, ProcedureFinished):
            self._tell()

    def page(self) -> str:
        """Return the path of the page, once it is written; empty where that went wrong."""
        self._tell()
        # What is said below is the end of it: the process sees the end of its input.
        said, _ = self._process.communicate()
        return said.strip()

    def _tell(self) -> None:
        stdin = self._process.stdin
        if stdin is None or not self._folder or self._process.poll() is not None:
            return
        try:
            stdin.write(self._folder + "\n")
            stdin.flush()
        except BrokenPipeError:
            # It has gone between the question and the line; `page` will say nothing.
            return

    def __enter__(self) -> Self:
        """Return itself."""
        return self

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
    ) -> None:
        """End the process where it still runs."""
        if self._process.poll() is None:
            self._process.kill()
        self._process.communicate()


def follow(language: str, told: Iterable[str]) -> Path | None:
    """Draw what is finished whenever a line tells of a run's folder, and write its page at the end; None without a run."""
    from bench.journal.finished_run import read_run
    from bench.report.evidence import record_of
    from reports.plots.draw import svg
    from reports.plots.of_procedures import plots

    say, drawn = speech(language).say, dict[str, str]()
    done: set[str] = set()
    folder = ""
    for line in told:
        folder = line.strip()
        for procedure in record_of(read_run(folder, Path())).procedures:
            if procedure.result is None or procedure.name in done:
                continue
            done.add(procedure.name)
            drawn.update((plot.name, svg(plot, say)) for plot in plots(procedure))
    if not folder:
        return None
    return write_page(rendered(read_run(folder, Path()), language, drawn), Path(folder), language)


if __name__ == "__main__":
    page = follow(sys.argv[1], sys.stdin)
    print(page or "")
