"""Plots drawn by two processes at once, where the machine has two processors."""

import multiprocessing
import os
from collections.abc import Mapping, Sequence
from contextlib import suppress
from multiprocessing.connection import Connection

from reports.plots.draw import svg
from reports.plots.layout import Say
from reports.plots.model import Plot


def drawn(plots: Sequence[Plot], say: Say) -> Mapping[str, str]:
    """Return the plots as SVG by name; only for a process without threads, for it is forked.

    What the second process does not bring is missing, and left to whoever needs it.
    """
    if len(plots) < 2 or (os.cpu_count() or 1) < 2 or "fork" not in multiprocessing.get_all_start_methods():
        return {}
    # Imported once, before there are two.
    import matplotlib.backends.backend_svg
    import matplotlib.figure  # noqa: F401

    mine, other = _halves(plots)
    forking = multiprocessing.get_context("fork")
    receiving, sending = forking.Pipe(duplex=False)
    process = forking.Process(target=_draw_and_send, args=(other, say, sending))
    process.start()
    sending.close()
    try:
        made = _draw(mine, say)
        with suppress(EOFError):
            made |= receiving.recv()
        return made
    finally:
        process.kill()
        process.join()
        receiving.close()


def _halves(plots: Sequence[Plot]) -> tuple[list[Plot], list[Plot]]:
    """Divide by the number of axes, which is what drawing costs."""
    halves: tuple[list[Plot], list[Plot]] = ([], [])
    loads = [0, 0]
    for plot in sorted(plots, key=_axes, reverse=True):
        lighter = loads.index(min(loads))
        halves[lighter].append(plot)
        loads[lighter] += _axes(plot)
    return halves


def _axes(plot: Plot) -> int:
    return sum(len(row) for row in plot.rows)


def _draw_and_send(plots: Sequence[Plot], say: Say, sending: Connection) -> None:
    sending.send(_draw(plots, say))
    sending.close()


def _draw(plots: Sequence[Plot], say: Say) -> dict[str, str]:
    return {plot.name: svg(plot, say) for plot in plots}
