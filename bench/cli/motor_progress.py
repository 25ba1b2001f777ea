"""Progress of a check or a study of many motors: a bar on a terminal, a line now and then elsewhere."""

import sys
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from time import monotonic

from bench.run.console import console_on
from drivers.interfaces.text import Text, Translate, text

#: Where nobody looks at a terminal, a line comes at most so often (s).
_OFTEN = 60.0


@contextmanager
def shown_progress(what: Text, translate: Translate) -> Iterator[Callable[[int, int], None]]:
    """Give what shows on standard error how many motors are done and the time left; `what` says what is done with them."""
    from rich.progress import BarColumn, MofNCompleteColumn, Progress, TextColumn, TimeRemainingColumn

    console = console_on(sys.stderr)
    if not console.is_terminal:
        yield _Lines(what, translate)
        return
    columns = TextColumn("{task.description}"), BarColumn(), MofNCompleteColumn(), TimeRemainingColumn()
    with Progress(*columns, console=console, transient=True) as progress:
        task = progress.add_task(what.render(translate), total=None)
        yield lambda done, every: progress.update(task, completed=done, total=every)


class _Lines:
    def __init__(self, what: Text, translate: Translate) -> None:
        self._what, self._translate = what, translate
        self._began = self._told = monotonic()

    def __call__(self, done: int, every: int) -> None:
        now = monotonic()
        if now - self._told < _OFTEN or done == every:
            return
        self._told = now
        said = text(
            "{what}: {done} of {every}, about {minutes:.0f} min left",
            what=self._what,
            done=done,
            every=every,
            minutes=(now - self._began) / done * (every - done) / 60.0,
        )
        print(said.render(self._translate), file=sys.stderr, flush=True)
