"""Figures of the E4980A as it replies with them: twelve characters or sixteen, or 64-bit numbers in a block."""

import struct
from collections.abc import Sequence

from sim_instruments.scpi.parameters import choice, choices, exactly, number
from sim_instruments.scpi.settings import ScpiSettings
from sim_instruments.scpi.tree import Call, CommandTree, bare

_FORMS = choices(("ASCii", "REAL"))

#: Primary and secondary parameter and status.
Figures = tuple[float, float, int]


class Replies:
    """Formats figures by FORMat and its sisters."""

    def __init__(self, tree: CommandTree, settings: ScpiSettings) -> None:
        self._settings = settings
        self._form = "ASC"
        tree.add("FORMat[:DATA]", command=self._set_form, query=bare(lambda: self._form))
        settings.add_flag("long", "FORMat:ASCii:LONG", False)
        settings.add_choice("order", "FORMat:BORDer", ("NORMal", "SWAPped"), "NORM")
        settings.add_flag("comparator", "COMParator[:STATe]", False)

    def reset(self) -> None:
        """Return to characters."""
        self._form = "ASC"

    def _set_form(self, call: Call) -> None:
        """Take a form and its length: numbers in a block have 64 bits, those in characters as many as they have."""
        exactly(call.arguments, 1, 2)
        form = choice(call.arguments[0], _FORMS)
        for argument in call.arguments[1:]:
            number(argument, 64.0, 64.0) if form == "REAL" else number(argument, 0.0, 255.0)
        self._form = form

    def values(self, values: Sequence[float]) -> str | bytes:
        """Return numbers without a status."""
        if self._binary:
            return self._block(values)
        return ",".join(self._number(value) for value in values)

    def reading(self, figures: Figures) -> str | bytes:
        """Return one reading, with its bin where the comparator is on."""
        # With no limits entered, every part is sorted into bin 0.
        return self._joined([(*figures, 0) if self._settings.flag("comparator") else figures])

    def sweep(self, points: Sequence[Figures]) -> str | bytes:
        """Return the readings of a list, each with IN or OUT of its limits, of which there are none."""
        return self._joined([(*figures, 0) for figures in points])

    def _joined(self, readings: Sequence[tuple[float, float, int] | tuple[float, float, int, int]]) -> str | bytes:
        if self._binary:
            return self._block([float(value) for figures in readings for value in figures])
        return ",".join(
            f"{self._number(figures[0])},{self._number(figures[1])}" + "".join(f",{entry:+d}" for entry in figures[2:])
            for figures in readings
        )

    @property
    def _binary(self) -> bool:
        return self._form == "REAL"

    def _number(self, value: float) -> str:
        return f"{value:+.9E}" if self._settings.flag("long") else f"{value:+.5E}"

    def _block(self, values: Sequence[float]) -> bytes:
        order = ">" if self._settings.word("order") == "NORM" else "<"
        data = struct.pack(f"{order}{len(values)}d", *values)
        length = str(len(data)).zfill(2)
        return f"#{len(length)}{length}".encode() + data
