"""Settings that the last user of a drive may have left: objects of CiA 402-2 that change what a command or a reading means."""

from collections.abc import Sequence
from dataclasses import dataclass

from drivers.bases.found_state import FoundState, WantedSetting
from drivers.interfaces import CommunicationError
from drivers.interfaces.found_state import FoundSetting
from drivers.interfaces.text import Text, text
from drivers.transport.can.network_management import NmtState
from drivers.transport.can.objects import NodeObjects

_WRITE = "{value}"


@dataclass(frozen=True)
class _Row:
    """One object; one with a `wanted` number is set to it, another told only."""

    index: int
    name: str
    effect: Text
    signed: bool = False
    wanted: str = ""

    @property
    def setting(self) -> WantedSetting:
        """The row as a table of found settings has it; a drive need not have any of these objects."""
        wanted, command = ((self.wanted,), _WRITE) if self.wanted else ((), "")
        return WantedSetting(f"0x{self.index:04X} {self.name}", wanted, self.effect, command, optional=True)


_SLOW = text("a slow ramp takes longer than settle_timeout allows")
_LIMIT = text("commands above it are not reached")
_ROWS = (
    _Row(0x607E, "polarity", text("speed, position or torque have the wrong sign"), wanted="0"),
    _Row(0x60B1, "velocity offset", text("it is added to every velocity that is commanded"), True, "0"),
    _Row(0x60B2, "torque offset", text("it is added to every torque that is commanded"), True, "0"),
    _Row(0x6072, "max torque", _LIMIT),
    _Row(0x6073, "max current", _LIMIT),
    _Row(0x607F, "max profile velocity", _LIMIT),
    _Row(0x6080, "max motor speed", _LIMIT),
    _Row(0x6083, "profile acceleration", _SLOW),
    _Row(0x6084, "profile deceleration", _SLOW),
    _Row(0x6087, "torque slope", _SLOW),
    _Row(0x605A, "quick stop option code", text("what its own quick stop does; switching off does not use it"), True),
)


class FoundObjects:
    """The objects of one drive as they were found; what was changed is put back at the end."""

    def __init__(self, objects: NodeObjects) -> None:
        self._objects = objects
        self._rows = {row.setting.query: row for row in _ROWS}
        # Makers' types differ; an object is written as it is read.
        self._sizes: dict[int, int] = {}
        self._state = FoundState(objects.name, self._ask, self._put)

    @property
    def settings(self) -> tuple[FoundSetting, ...]:
        """The objects as they were found, in the order of the table; objects that the drive lacks are left out."""
        return self._state.settings

    def take_over(self) -> None:
        """Read everything and set what may be set; raises ReportedError where something does not stay as it was set."""
        self._state.take_over(row.setting for row in _ROWS)

    def give_back(self) -> None:
        """Put back what was changed; may be called twice."""
        self._state.give_back()

    def _ask(self, setting: WantedSetting) -> str:
        row = self._rows[setting.query]
        data = self._objects.read_bytes(row.index, 0)
        if not data:
            raise CommunicationError(self._objects.name, text("no bytes"), command=f"read {setting.query}")
        self._sizes[row.index] = len(data)
        return str(int.from_bytes(data, "little", signed=row.signed))

    def _put(self, setting: WantedSetting, value: str) -> None:
        row = self._rows[setting.query]
        self._objects.write(row.index, 0, int(value), self._sizes[row.index], signed=row.signed)


def polled_by(mapped: Sequence[int]) -> FoundSetting:
    """Return how measured objects are read, as a setting that is only reported: by process data, else by SDO."""
    by = "PDO: " + ", ".join(f"0x{index:04X}" for index in mapped) if mapped else "SDO"
    return FoundSetting(
        "0x1800 process data", by, "", text("by SDO, quantities that belong together are read one after the other")
    )


def found_nmt_state(found: NmtState | None) -> FoundSetting:
    """Return the node's NMT state as a found setting; if the node does not report it, only that is reported."""
    effect = text("a node that is not operational may refuse to be enabled")
    if found is None:
        return FoundSetting("NMT state", "unknown", "", effect)
    wanted = NmtState.OPERATIONAL
    return FoundSetting("NMT state", found.words, wanted.words, effect, changed=found is not wanted)
