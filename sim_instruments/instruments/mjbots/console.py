"""The diagnostic stream of a moteus: lines of text in, `OK`, values or telemetry out.

Sources: mjlib `micro/command_manager.cc`, `micro/telemetry_manager.cc` and `micro/persistent_config.cc`; the documentation's page of the
diagnostic protocol.
"""

import math
import struct
from collections import deque
from collections.abc import Callable, Mapping

from sim_instruments.instruments.mjbots import telemetry
from sim_instruments.instruments.mjbots.configuration import MoteusSettings, UnknownGroupError, UnknownItemError

#: Gives a channel's present content.
Channel = Callable[[], telemetry.Structure]
#: Does a `d` command with its words; gives the reply.
Directly = Callable[[list[str]], str]
_LONGEST = 100
#: A channel that is asked for oftener than this (ms) is sent whenever there is something new.
_LEAST_PERIOD = 10


class MoteusConsole:
    """One stream, of all clients together: whoever polls gets what comes next.

    `channels` by name, `directly` does what begins with `d`, `configured` is told of every change of the configuration, `now` is
    the time (s).
    """

    def __init__(
        self,
        configuration: MoteusSettings,
        channels: Mapping[str, Channel],
        directly: Directly,
        configured: Callable[[], None],
        now: Callable[[], float],
    ) -> None:
        self._configuration = configuration
        self._channels = channels
        self._directly = directly
        self._configured = configured
        self._now = now
        self._line = b""
        # Writes one after the other: an answer never holds parts of two.
        self._writes: deque[bytes] = deque()
        self._as_text: set[str] = set()
        self._periods: dict[str, float] = {}
        self._due: dict[str, float] = {}

    def take(self, data: bytes) -> None:
        """Take what a client has sent; whole lines are done at once, one that is too long is dropped."""
        *whole, self._line = (self._line + data).replace(b"\r", b"\n").split(b"\n")
        for line in whole:
            if line and len(line) < _LONGEST:
                self._command(line.decode("latin-1"))
        self._line = self._line[:_LONGEST]

    def give(self, most: int) -> bytes:
        """Return up to so many bytes of what is to be sent."""
        if not self._writes:
            self._send_periodic()
        if not self._writes:
            return b""
        first = self._writes.popleft()
        if len(first) > most:
            self._writes.appendleft(first[most:])
        return first[:most]

    def _say(self, *lines: str) -> None:
        self._writes.extend(f"{line}\r\n".encode("latin-1") for line in lines)

    def _command(self, line: str) -> None:
        group, _, rest = line.strip(" ").partition(" ")
        match group:
            case "":
                return
            case "tel":
                self._telemetry(*_two(rest))
            case "conf":
                self._configure(*_two(rest))
            case "d":
                self._say(self._directly(rest.split()))
            case _:
                self._say("ERR unknown command")

    def _telemetry(self, command: str, rest: str) -> None:
        name, _, given = rest.partition(" ")
        match command:
            case "list":
                self._say(*self._channels, "OK")
            case "text":
                self._as_text = set(self._channels)
                self._say("OK")
            case "stop":
                self._periods.clear()
                self._say("OK")
            case "get" | "schema" | "fmt" | "rate" if name not in self._channels:
                self._say("ERR unknown name")
            case "get":
                self._emit(name)
            case "schema":
                self._binary("schema", name, telemetry.schema(self._channels[name]()))
            case "fmt":
                (self._as_text.add if _whole(given) else self._as_text.discard)(name)
                self._say("OK")
            case "rate":
                period = _whole(given)
                self._periods[name] = max(period, _LEAST_PERIOD) * 1e-3 if period > 0 else math.inf
                self._due[name] = self._now() + self._periods[name]
                self._say("OK")
            case _:
                self._say("ERR unknown subcommand")

    def _emit(self, name: str) -> None:
        structure = self._channels[name]()
        if name in self._as_text:
            self._say(*telemetry.lines(name, structure), "OK")
        else:
            self._binary("emit", name, telemetry.data(structure))

    def _binary(self, word: str, name: str, content: bytes) -> None:
        self._writes.append(f"{word} {name}\r\n".encode() + struct.pack("<I", len(content)) + content)

    def _send_periodic(self) -> None:
        now = self._now()
        for name, period in self._periods.items():
            if math.isfinite(period) and now >= self._due[name]:
                self._due[name] = now + period
                self._emit(name)

    def _configure(self, command: str, rest: str) -> None:
        configuration = self._configuration
        try:
            match command:
                case "get":
                    self._say(configuration.text(rest))
                    return
                case "enumerate":
                    self._say(*configuration.lines(rest))
                case "list":
                    self._say(*configuration.groups())
                case "set":
                    name, _, value = rest.partition(" ")
                    configuration.set(name, value)
                case "load" | "default":
                    getattr(configuration, command)()
                case "write":
                    configuration.write()
                case _:
                    self._say("ERR unknown subcommand")
                    return
        except UnknownGroupError:
            self._say("ERR unknown group")
            return
        except UnknownItemError:
            self._say("ERR error setting" if command == "set" else "ERR error reading")
            return
        if command in ("set", "load", "default"):
            self._configured()
        self._say("OK")


def _two(text: str) -> tuple[str, str]:
    first, _, rest = text.partition(" ")
    return first, rest


def _whole(text: str) -> int:
    digits = text.strip()
    return int(digits) if digits.lstrip("+-").isdigit() else 0
