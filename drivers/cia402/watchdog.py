"""A drive's watch over the process that started it: its heartbeat consumer and what it does without a heartbeat.

CiA 301: 0x1016, consumer heartbeat time. CiA 402: 0x6007, abort connection option code.
"""

from typing import Protocol

from drivers.bases.set_points import check_setpoint
from drivers.interfaces import InstrumentError, ReportedError, Watchdog, WhenSilent
from drivers.interfaces.text import text
from drivers.transport.can.objects import NodeObjects

CONSUMER_HEARTBEAT, ABORT_CONNECTION = 0x1016, 0x6007
#: What a drive does when the connection is lost: the command Disable voltage.
DISABLE_VOLTAGE_OPTION = 2
#: Times (s) that are useful and fit the object's 16 bits of ms.
SHORTEST_TIME, LONGEST_TIME = 0.05, 65.535
#: Heartbeats sent within the time after which the drive takes us for dead: two may be lost.
BEATS = 3


class HeartbeatSender(Protocol):
    """Sender of heartbeats on the drive's bus."""

    def start_heartbeat(self, producer: int, period: float) -> None:
        """Send heartbeats of node `producer` every `period` (s)."""


class HeartbeatWatchdog:
    """The two objects of one drive, set by `arm` where it has them and as they were after `disarm`."""

    def __init__(self, objects: NodeObjects) -> None:
        self._objects = objects
        self._entry: tuple[int, int] | None = None
        self._option: int | None = None
        #: What is armed, None where nothing is.
        self.armed: Watchdog | None = None

    def arm(self, time: float, producer: int, sender: HeartbeatSender) -> None:
        """Set the drive to switch its voltage off once the heartbeat of node `producer` stays away for `time` (s).

        A drive without a heartbeat consumer stays as it is; what is set is read back. Raises SetpointError for a time or node
        that cannot be, ReportedError where all the drive's entries are taken, or it does not keep what was written.
        """
        objects = self._objects
        check_setpoint(objects.name, "heartbeat_time", time, "s", SHORTEST_TIME, LONGEST_TIME, "0x1016")
        check_setpoint(objects.name, "heartbeat_node", producer, "", 1, 127, "CANopen")
        entries = objects.read_optional(CONSUMER_HEARTBEAT, 0, 1)
        if entries is None:
            return
        subindex = self._free_entry(entries, producer)
        option = objects.read_optional(ABORT_CONNECTION, 0, 2, signed=True)
        try:
            if option is not None:
                self._option = option
                objects.write(ABORT_CONNECTION, 0, DISABLE_VOLTAGE_OPTION, 2, signed=True)
                self._read_back(ABORT_CONNECTION, 0, DISABLE_VOLTAGE_OPTION, 2)
            self._set_entry(subindex, producer, round(time * 1e3))
        except InstrumentError:
            self.disarm_if_reachable()
            raise
        # A drive watches from the first heartbeat after that: it is sent at once, not a period later.
        sender.start_heartbeat(producer, time / BEATS)
        if option is None:
            self.armed = Watchdog(time, WhenSilent.AS_SET_UP, "0x1016")
        else:
            self.armed = Watchdog(time, WhenSilent.VOLTAGE_OFF, "0x1016, 0x6007")

    def disarm(self) -> None:
        """Put both objects back; raises InstrumentError where the drive does not take them."""
        entry, option = self._entry, self._option
        self._entry = self._option = self.armed = None
        if entry is not None:
            self._objects.write(CONSUMER_HEARTBEAT, entry[0], entry[1], 4)
        if option is not None:
            self._objects.write(ABORT_CONNECTION, 0, option, 2, signed=True)

    def disarm_if_reachable(self) -> None:
        """Put both objects back where the drive still answers; one that does not will switch off by itself."""
        try:
            self.disarm()
        except InstrumentError as error:
            self._objects.trace("error", f"heartbeat: {error}")

    def _set_entry(self, subindex: int, producer: int, milliseconds: int) -> None:
        before = self._objects.read(CONSUMER_HEARTBEAT, subindex, 4)
        if before >> 16 & 0xFF == producer:
            before = 0  # left by a process that died: put back, it would stop the drive
        self._entry = (subindex, before)
        wanted = producer << 16 | milliseconds
        self._objects.write(CONSUMER_HEARTBEAT, subindex, wanted, 4)
        self._read_back(CONSUMER_HEARTBEAT, subindex, wanted, 4)

    def _read_back(self, index: int, subindex: int, wanted: int, size: int) -> None:
        found = self._objects.read(index, subindex, size)
        if found != wanted:
            raise ReportedError(
                self._objects.name,
                text(
                    "0x{index:04X}:{subindex:02X} is {found} after {wanted} was written",
                    index=index,
                    subindex=subindex,
                    found=found,
                    wanted=wanted,
                ),
                command=f"read 0x{index:04X}:{subindex:02X}",
                remedy=text("See whether the drive's objects are locked, or set heartbeat_time = 0"),
            )

    def _free_entry(self, entries: int, producer: int) -> int:
        """Return the subindex of our own entry, else of an unused one (node 0 or time 0)."""
        found = {subindex: self._objects.read(CONSUMER_HEARTBEAT, subindex, 4) for subindex in range(1, entries + 1)}
        own = [subindex for subindex, value in found.items() if value >> 16 & 0xFF == producer]
        unused = [subindex for subindex, value in found.items() if not value & 0xFFFF or not value >> 16 & 0xFF]
        if not own + unused:
            raise ReportedError(
                self._objects.name,
                text("all {entries} entries of the drive's consumer heartbeat are taken", entries=entries),
                command="read 0x1016",
                remedy=text("Free one in the drive's set-up, or set heartbeat_time = 0"),
            )
        return (own + unused)[0]
