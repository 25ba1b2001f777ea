"""Figures of the E4980A as it replies with them: twelve characters or sixteen, or 64-bit numbers in a block."""

import struct
from collections.abc import Sequence

from sim_instruments.scpi.settings import ScpiSettings

#: Primary and secondary parameter and status.
Figures = tuple[float, float, int]


class Replies:
    """Formats figures by FORMat and its sisters."""

    def __init__(self, settings: ScpiSettings) -> None:
        self._settings = settings
        settings.add_choice("format", "FORMat[:DATA]", ("ASCii", "REAL"), "ASC")
        settings.add_flag("long", "FORMat:ASCii:LONG", False)
        settings.add_choice("order", "FORMat:BORDer", ("NORMal", "SWAPped"), "NORM")
        settings.add_flag("comparator", "COMParator[:STATe]", False)

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
        return self._settings.word("format") == "REAL"

    def _number(self, value: float) -> str:
        return f"{value:+.9E}" if self._settings.flag("long") else f"{value:+.5E}"

    def _block(self, values: Sequence[float]) -> bytes:
        order = ">" if self._settings.word("order") == "NORM" else "<"
        data = struct.pack(f"{order}{len(values)}d", *values)
        length = str(len(data)).zfill(2)
        return f"#{len(length)}{length}".encode() + data
