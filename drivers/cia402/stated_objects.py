"""Objects that no profile has and the station states: index, type and scale as the drive's manual has them."""

import re
from dataclasses import dataclass
from typing import TYPE_CHECKING, Literal

from drivers.interfaces.text import text

if TYPE_CHECKING:
    from drivers.transport.can.objects import NodeObjects

_FORM = re.compile(r"0x([0-9A-Fa-f]{4}):(?:0x)?([0-9A-Fa-f]{1,2})")


@dataclass(frozen=True)
class StatedObject:
    """One object, `0x2010:00`, with its type, and the SI value of one count (`scale`)."""

    object: str
    type: Literal["i8", "u8", "i16", "u16", "i32", "u32"]
    scale: float = 1.0

    def check(self, key: str) -> None:
        """Raise ValueError, beginning with its key in a station file, where it names no object or has no scale."""
        if _FORM.fullmatch(self.object) is None:
            raise ValueError(
                text("{key}.object = {object!r} is no object; write 0x2010:00", key=key, object=self.object)
            )
        if not 0.0 < self.scale < float("inf"):
            raise ValueError(text("{key}.scale = {scale} must be above 0", key=key, scale=self.scale))

    @property
    def index(self) -> int:
        """The object's index."""
        return int(self.object[2:6], 16)

    def read(self, objects: "NodeObjects") -> float:
        """Return its value, scaled; errors as for `NodeObjects.read`."""
        return objects.read(self.index, self._subindex, self._size, signed=self.type[0] == "i") * self.scale

    def write(self, objects: "NodeObjects", value: float) -> None:
        """Write a scaled value; errors as for `NodeObjects.write`."""
        counts = round(value / self.scale)
        objects.write(self.index, self._subindex, counts, self._size, signed=self.type[0] == "i")

    @property
    def _size(self) -> int:
        return int(self.type[1:]) // 8

    @property
    def _subindex(self) -> int:
        return int(self.object.rsplit(":", 1)[1], 16)
