"""Curves that a procedure shows of a measurement while it goes on, as data for the display."""

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Protocol

from drivers.interfaces.text import Text
from procedures.core.axes import Axes


@dataclass(frozen=True)
class ComingReadings:
    """Readings that are points of the plot's upper axes as they come, from a bench time `since` (s) on.

    x is `rate` times the time since then, y is the reading divided by `scale`. `quantity` is the reading's, in English. `until_x` and
    `until_y` are where it ends, where that is known.
    """

    instrument: str
    quantity: str
    since: float
    rate: float = 1.0
    scale: float = 1.0
    until_x: float | None = None
    until_y: float | None = None


@dataclass(frozen=True)
class Gauge:
    """A value (in `unit`) that a hand is to bring within `low` … `high`, None where nothing has been read yet."""

    quantity: Text
    unit: str
    low: float
    high: float
    value: float | None = None


@dataclass(frozen=True)
class LivePlot:
    """A plot of what is being read, or has just been captured: in `lower` what the fit leaves, or what else belongs to it.

    `said` are sentences that stand below it, `gauge` is what the hand that makes the record is to keep.
    """

    title: Text
    upper: Axes
    lower: Axes | None = None
    said: Sequence[Text] = ()
    coming: ComingReadings | None = None
    gauge: Gauge | None = None


class RunObserver(Protocol):
    """The people who may be watching a run."""

    @property
    def looks(self) -> bool:
        """Return whether anybody watches now."""

    def show(self, plot: LivePlot) -> None:
        """Show a plot in place of the one before."""


class NoObserver:
    """A run that nobody watches."""

    looks = False

    def show(self, plot: LivePlot) -> None:
        """Do nothing: nobody watches."""
