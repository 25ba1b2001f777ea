"""The LIST page of the E4980A: measurements at several frequencies or levels (user's guide, :LIST)."""

from dataclasses import replace

from sim_instruments.instruments.keysight.e4980a.measurement import SOURCE_RESISTANCE, Conditions
from sim_instruments.instruments.keysight.e4980a.parameters import OVERFLOW
from sim_instruments.scpi.parameters import exactly, number
from sim_instruments.scpi.settings import ScpiSettings
from sim_instruments.scpi.tree import Call, CommandTree, bare

_MOST_POINTS = 201
#: By header: the unit and the limits of a point; frequencies have the bridge's own.
_LEVELS = {"VOLTage": ("V", 0.0, 2.0), "CURRent": ("A", 0.0, 0.02)}


class SweepList:
    """At most 201 points, of one kind; the last header that was sent says of which. A trigger takes all, or the next one."""

    def __init__(self, tree: CommandTree, settings: ScpiSettings, lowest: float, highest: float) -> None:
        self._settings = settings
        self._kind = "FREQuency"
        self._points: tuple[float, ...] = ()
        self._next = 0
        settings.add_choice("list", "LIST:MODE", ("SEQuence", "STEPped"), "SEQ", changed=lambda _: self.rewind())
        for kind, (unit, low, high) in {"FREQuency": ("HZ", lowest, highest), **_LEVELS}.items():
            self._add(tree, kind, unit, low, high)
        tree.add("LIST:CLEar[:ALL]", command=bare(self.reset))

    def reset(self) -> None:
        """Forget the points."""
        self._kind, self._points, self._next = "FREQuency", (), 0

    def rewind(self) -> None:
        """Make the next trigger begin at the first point."""
        self._next = 0

    def queries(self) -> tuple[str, ...]:
        """Return the query of the points that there are."""
        return (f":LIST:{self._kind}?",) if self._points else ()

    def triggered(self, conditions: Conditions) -> list[Conditions]:
        """Return what a trigger measures: at all points, or stepped at the next one."""
        every = [self._at(conditions, point) for point in self._points]
        if self._settings.word("list") != "STEP" or not every:
            return every
        chosen = every[self._next % len(every)]
        self._next += 1
        return [chosen]

    def waiting(self, conditions: Conditions) -> list[Conditions]:
        """Return what a trigger would measure, or the bridge's own setting where there are no points."""
        every = [self._at(conditions, point) for point in self._points] or [conditions]
        return every[:1] if self._settings.word("list") == "STEP" else every

    def _at(self, conditions: Conditions, point: float) -> Conditions:
        if self._kind == "FREQuency":
            return replace(conditions, frequency=point)
        level = point * (SOURCE_RESISTANCE if self._kind == "CURRent" else 1.0)
        return replace(conditions, level_rms=level)

    def _add(self, tree: CommandTree, kind: str, unit: str, low: float, high: float) -> None:
        def set_points(call: Call) -> None:
            exactly(call.arguments, 1, _MOST_POINTS)
            points = tuple(number(argument, low, high, unit=unit) for argument in call.arguments)
            self._kind, self._points, self._next = kind, points, 0

        def get_points(call: Call) -> str:
            exactly(call.arguments, 0)
            points = self._points if self._kind == kind else ()
            return ",".join(f"{point:+.5E}" for point in points or (OVERFLOW,))

        tree.add(f"LIST:{kind}", command=set_points, query=get_points)
