"""The diagnostic stream of a moteus: configuration in text, telemetry in binary."""

from collections.abc import Callable, Mapping
from typing import Any, TypeVar

from drivers.interfaces import Clock, CommunicationError, ReportedError
from drivers.interfaces.text import text
from drivers.mjbots.controller import MoteusController
from drivers.mjbots.multiplex import parts, stream_poll, stream_write
from drivers.mjbots.telemetry import decoder_of

T = TypeVar("T")

#: How long (s, bench time) an answer may take, and how long to wait where nothing has come yet.
_ANSWER_TIME, _LOOK = 0.3, 0.002
#: So often nothing must come, `_LOOK` apart, before the stream counts as empty.
_EMPTY = 3
#: A stream that never ends is telemetry that somebody has switched on.
_MOST = 1 << 14
_SIZE = 4


class DiagnosticStream:
    """The stream of one controller. What it was left with, half a line or telemetry that comes by itself, is ended at its first use."""

    def __init__(self, controller: MoteusController, clock: Clock) -> None:
        self._controller = controller
        self._clock = clock
        self._decoders: dict[str, Callable[[bytes], Mapping[str, Any]]] = {}
        self._is_clean = False

    def get(self, name: str) -> str:
        """Return a value of the configuration; raises ReportedError where there is none of that name."""
        return self._asked(f"conf get {name}", lambda data: _line(self._checked(data, name)))

    def set(self, name: str, value: str) -> None:
        """Set a value of the configuration, which lasts until the drive is switched off; raises ReportedError where it is refused."""
        self._asked(f"conf set {name} {value}", lambda data: _line(self._checked(data, name)))

    def telemetry(self, channel: str) -> Mapping[str, Any]:
        """Return a channel's values as they are now; raises ReportedError where there is no such channel."""
        if channel not in self._decoders:
            # Somebody may have had it sent as text.
            self._asked(f"tel fmt {channel} 0", lambda data: _line(self._checked(data, channel)))
            schema = self._asked(f"tel schema {channel}", lambda data: _blob(self._checked(data, channel), "schema"))
            try:
                self._decoders[channel] = decoder_of(schema)
            except ValueError as error:
                raise self._unusable(f"tel schema {channel}", error) from error
        command = f"tel get {channel}"
        data = self._asked(command, lambda data: _blob(self._checked(data, channel), "emit"))
        try:
            return self._decoders[channel](data)
        except ValueError as error:
            raise self._unusable(command, error) from error

    def _asked(self, command: str, complete: Callable[[bytes], T | None]) -> T:
        """Return what is made of the answer to a line, which is sent once more where its answer is lost."""
        try:
            return self._answer(command, complete)
        except CommunicationError:
            self._is_clean = False
            return self._answer(command, complete)

    def _answer(self, command: str, complete: Callable[[bytes], T | None]) -> T:
        if not self._is_clean:
            self._clean()
        found = self._sent(command)
        end = self._clock.now() + _ANSWER_TIME
        while (answer := complete(found)) is None:
            late = self._clock.now() >= end
            more = self._polled(command)
            if not more:
                if late:
                    self._is_clean = False
                    raise CommunicationError(
                        self._controller.name, text("no whole answer on its diagnostic stream"), command=command
                    )
                self._clock.sleep(_LOOK)
            found += more
        return answer

    def _clean(self) -> None:
        """End what is on its way: half a line of somebody's, and telemetry that is sent by itself."""
        read = len(self._sent("\ntel stop"))
        empty = 0
        while empty < _EMPTY:
            more = self._polled("tel stop")
            empty = 0 if more else empty + 1
            read += len(more)
            if read > _MOST:
                raise CommunicationError(
                    self._controller.name,
                    text("its diagnostic stream does not end"),
                    remedy=text("End the program that uses it (tview, moteus_tool)"),
                )
            if not more:
                self._clock.sleep(_LOOK)
        self._is_clean = True

    def _sent(self, line: str) -> bytes:
        result = b""
        for part in parts(f"{line}\n".encode("ascii")):
            result += self._controller.exchange(stream_write(part), line.strip()).stream or b""
        return result

    def _polled(self, command: str) -> bytes:
        return self._controller.exchange(stream_poll(), command).stream or b""

    def _checked(self, data: bytes, name: str) -> bytes:
        """Return an answer as it is; raises ReportedError where it says that there is an error."""
        if data.startswith(b"ERR") and data.endswith(b"\n"):
            raise ReportedError(
                self._controller.name,
                text("it has no {name}: {answer}", name=name, answer=data.decode("latin-1").strip()),
                command=name,
                remedy=text("Update its firmware, or take another drive"),
            )
        return data

    def _unusable(self, command: str, error: ValueError) -> CommunicationError:
        return CommunicationError(
            self._controller.name, text("no usable telemetry ({error})", error=error), command=command
        )


def _line(data: bytes) -> str | None:
    """Return the line of an answer of one line, None where it has not come whole."""
    return data.decode("latin-1").strip() if data.endswith(b"\n") and data.strip() else None


def _blob(data: bytes, announced: str) -> bytes | None:
    """Return what follows its announcement and its length, None where it has not come whole."""
    head, end, rest = data.partition(b"\r\n")
    if not end or len(rest) < _SIZE:
        return None
    if not head.startswith(announced.encode()):
        return None
    size = int.from_bytes(rest[:_SIZE], "little")
    return rest[_SIZE : _SIZE + size] if len(rest) >= _SIZE + size else None
