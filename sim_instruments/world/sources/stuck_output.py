"""An output that no longer switches off: welded contacts, a gate driver that has failed."""

from dataclasses import dataclass
from typing import Literal

#: What an instrument says of an output that stays on after OFF: the actual state, or the last command.
Reports = Literal["on", "off"]


@dataclass
class OutputSwitch:
    """An output that may be stuck, and the state that is reported of it; `wanted` is the last command."""

    stuck: Reports | None = None
    wanted: bool = False

    def follows(self, wanted: bool, now: bool) -> bool:
        """Return whether the output is on after the command; `now` says whether it was before."""
        self.wanted = wanted
        return wanted or (self.stuck is not None and now)

    def shown(self, own_state: bool, now: bool) -> bool:
        """Return whether the instrument says that the output is on, `own_state` being what it would say if the output obeyed."""
        return own_state or (self.stuck == "on" and now)
