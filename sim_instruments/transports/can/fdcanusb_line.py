"""An fdcanusb adapter at a pseudo-terminal: what the maker's own tools open, as `moteus_tool --fdcanusb PATH`."""

import asyncio

import can

from sim_instruments.transports.can.buses import open_bus
from sim_instruments.transports.can.fdcanusb import FdcanusbAdapter
from sim_instruments.transports.serial.pty import PseudoTerminal

#: How long (s) the listening thread waits for a frame before it looks whether it should end.
_LISTENING_TIME = 0.05


class FdcanusbLine:
    """Joins who opens the pseudo-terminal to the bus of a channel."""

    def __init__(self, channel: str) -> None:
        self._line = PseudoTerminal()
        self._bus = open_bus(channel)
        self._adapter = FdcanusbAdapter()
        self._notifier: can.Notifier | None = None

    @property
    def address(self) -> str:
        """Path of the serial port."""
        return self._line.path

    async def start(self) -> None:
        """Begin to pass on what comes from either side."""
        loop = asyncio.get_running_loop()
        loop.add_reader(self._line.master, self._read)
        self._notifier = can.Notifier(self._bus, [self._spread], timeout=_LISTENING_TIME, loop=loop)

    async def stop(self) -> None:
        """Leave the bus and close the line; again is allowed."""
        if self._notifier is not None:
            asyncio.get_running_loop().remove_reader(self._line.master)
            self._notifier.stop()
            self._notifier = None
            self._bus.shutdown()
            self._line.close()

    def _read(self) -> None:
        for answer in self._adapter.feed(self._line.receive()):
            # Before the frame's own answer, which another thread may bring at once.
            self._line.send(answer.reply)
            if answer.frame is not None:
                self._bus.send(answer.frame)

    def _spread(self, frame: can.Message) -> None:
        self._line.send(self._adapter.line_of(frame))
