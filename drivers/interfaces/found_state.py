"""Settings left by the last user of an instrument, if they would change a figure."""

from dataclasses import dataclass

from drivers.interfaces.text import Text


@dataclass(frozen=True)
class FoundSetting:
    """One setting as it was `found`, by its `query`; `wanted` is empty for one that is only reported.

    `effect` says what another value does to a figure. One that was `changed` is put back when the instrument is let go of.
    """

    query: str
    found: str
    wanted: str
    effect: Text
    changed: bool = False
