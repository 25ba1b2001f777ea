"""An output that no longer switches off: welded contacts, a gate driver that has failed."""

from dataclasses import dataclass
from typing import Literal

#: What an instrument says of an output that stays on after OFF: the truth, or what it was told.
Reports = Literal["on", "off"]


@dataclass
class Sticky:
    """Whether an output is stuck and what is said of it; `wanted` is what it was told last."""

    stuck: Reports | None = None
    wanted: bool = False

    def follows(self, wanted: bool, now: bool) -> bool:
        """Return whether the output is on after it was told so; `now` says whether it is before."""
        self.wanted = wanted
        return wanted or (self.stuck is not None and now)

    def shown(self, told: bool, now: bool) -> bool:
        """Return whether the instrument says that the output is on, `told` being what it would say itself."""
        return told or (self.stuck == "on" and now)
