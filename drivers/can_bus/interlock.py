"""An interlock contact as a bit of a cyclic CAN frame."""

from contextlib import suppress
from time import monotonic

from drivers.can_bus.addresses import parse_bus
from drivers.can_bus.buses import keep_to_own_group
from drivers.can_bus.options import CanInterlockOptions
from drivers.interfaces import CommunicationError
from drivers.limits import check_setpoint


class CanInterlock:
    """One bit of one frame on a bus of its own connection, `can://interface/channel?bitrate=500000`.

    Raises CommunicationError where the bus cannot be opened, SetpointError for a bit that cannot be.
    """

    def __init__(self, address: str, options: CanInterlockOptions, *, name: str) -> None:
        import can

        highest = (1 << 29 if options.extended else 1 << 11) - 1
        check_setpoint(name, "frame", options.frame, "", 0, highest, "CAN")
        check_setpoint(name, "byte", options.byte, "", 0, 63, "CAN")
        check_setpoint(name, "bit", options.bit, "", 0, 7, "CAN")
        wanted = parse_bus(address, name)
        mask = {"can_id": options.frame, "can_mask": highest, "extended": options.extended}
        try:
            self._bus: can.BusABC | None = can.Bus(
                interface=wanted.interface,
                channel=wanted.channel,
                bitrate=wanted.bitrate,
                can_filters=[mask],
            )
        except (can.CanError, OSError, ValueError, ImportError) as error:
            raise CommunicationError(
                name, f"cannot be opened at {address} ({error})", remedy="Check interface, channel and bit rate"
            ) from error
        if wanted.interface == "udp_multicast":
            keep_to_own_group(self._bus)
        self._options = options
        self._name = name

    def closed(self) -> bool:
        """Return whether the contact is closed by the latest frame, waiting for the next one where there is none.

        Raises CommunicationError where none comes in time, or one that is too short.
        """
        data = self._latest()
        if len(data) <= self._options.byte:
            raise CommunicationError(
                self._name, f"frame 0x{self._options.frame:X} has {len(data)} bytes, no byte {self._options.byte}"
            )
        return bool(data[self._options.byte] >> self._options.bit & 1) is self._options.closed

    def close(self) -> None:
        """Leave the bus; may be called twice."""
        import can

        if self._bus is not None:
            with suppress(can.CanError, OSError):
                self._bus.shutdown()
        self._bus = None

    def _latest(self) -> bytes:
        import can

        if self._bus is None:
            raise CommunicationError(self._name, "the bus is closed")
        end = monotonic() + self._options.timeout
        found: bytes | None = None
        try:
            while True:
                message = self._bus.recv(0.0 if found is not None else max(0.0, end - monotonic()))
                if message is not None and not message.is_error_frame and not message.is_remote_frame:
                    found = bytes(message.data)
                elif found is not None:
                    return found
                elif monotonic() >= end:
                    break
        except (can.CanError, OSError) as error:
            raise CommunicationError(self._name, f"the bus fails ({error})", remedy="Check the cable") from error
        raise CommunicationError(
            self._name,
            f"no frame 0x{self._options.frame:X} for {self._options.timeout:g} s",
            remedy="Check the sender's power and the bus",
        )
