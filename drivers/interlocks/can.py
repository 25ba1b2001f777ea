"""An interlock contact as a bit of a cyclic CAN frame."""

from drivers.bases.set_points import check_setpoint
from drivers.cia402.options import CanInterlockOptions
from drivers.interfaces import CommunicationError
from drivers.interfaces.text import text
from drivers.transport.can.addresses import parse_bus
from drivers.transport.can.buses import LISTENING_TIME
from drivers.transport.can.sockets import keep_to_own_group, leaving
from drivers.transport.serial.port_errors import not_opened


class CanInterlock:
    """One bit of one frame on a bus of its own connection, `can://interface/channel?bitrate=500000`.

    Raises CommunicationError where the bus cannot be opened, SetpointError for a bit that cannot be.
    """

    def __init__(self, address: str, options: CanInterlockOptions, *, name: str) -> None:
        import can

        from drivers.transport.can.listening import LatestFrame

        highest = (1 << 29 if options.extended else 1 << 11) - 1
        check_setpoint(name, "frame", options.frame, "", 0, highest, "CAN")
        check_setpoint(name, "byte", options.byte, "", 0, 63, "CAN")
        check_setpoint(name, "bit", options.bit, "", 0, 7, "CAN")
        wanted = parse_bus(address, name)
        mask = {"can_id": options.frame, "can_mask": highest, "extended": options.extended}
        try:
            self._bus: can.BusABC | None = can.Bus(
                **wanted.arguments(LISTENING_TIME),
                can_filters=[mask],
            )
        except (can.CanError, OSError, ValueError, ImportError) as error:
            if wanted.channel.startswith("/") and not isinstance(error, (ValueError, ImportError)):
                raise not_opened(name, address, error) from error
            raise CommunicationError(
                name,
                text("cannot be opened at {address} ({error})", address=address, error=error),
                remedy=text("Check interface, channel and bit rate"),
            ) from error
        if wanted.interface == "udp_multicast":
            keep_to_own_group(self._bus)
        self._frames = LatestFrame()
        self._notifier = can.Notifier(self._bus, [self._frames], LISTENING_TIME)
        self._options = options
        self._name = name

    def closed(self) -> bool:
        """Return whether the contact is closed by the latest frame, waiting for the next one where there is none.

        Raises CommunicationError where none comes in time, or one that is too short.
        """
        data = self._latest()
        if len(data) <= self._options.byte:
            raise CommunicationError(
                self._name,
                text(
                    "frame 0x{frame:X} has {count} bytes, no byte {byte}",
                    frame=self._options.frame,
                    count=len(data),
                    byte=self._options.byte,
                ),
            )
        return bool(data[self._options.byte] >> self._options.bit & 1) is self._options.closed

    def close(self) -> None:
        """Leave the bus; may be called twice."""
        if self._bus is not None:
            self._frames.leave()
            self._notifier.stop()
            with leaving(self._bus):
                self._bus.shutdown()
        self._bus = None

    def _latest(self) -> bytes:
        import can

        if self._bus is None:
            raise CommunicationError(self._name, text("the bus is closed"))
        try:
            result = self._frames.take(self._options.timeout)
        except (can.CanError, OSError) as error:
            raise CommunicationError(
                self._name, text("the bus fails ({error})", error=error), remedy=text("Check the cable")
            ) from error
        if result is None:
            raise CommunicationError(
                self._name,
                text(
                    "no frame 0x{frame:X} for {timeout:g} s", frame=self._options.frame, timeout=self._options.timeout
                ),
                remedy=text("Check the sender's power and the bus"),
            )
        return result
