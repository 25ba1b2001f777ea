"""A moteus' side of a line of frames: registers, modes and the diagnostic stream, by plain bytes."""

import struct
from collections.abc import Callable, Iterator
from typing import Any

import can
import pytest

NODE = 1
CONFIGURATION = {
    "servo.fw.enable": "0",
    "servo.voltage_mode_control": "0",
    "servo.fixed_voltage_mode": "0",
    "servopos.position_min": "nan",
    "servopos.position_max": "nan",
    "motor.poles": "14",
    "motor_position.rotor_to_output_ratio": "1.000000",
    "motor_position.output.sign": "1",
    "servo.max_current_A": "100.000000",
    "servo.max_voltage": "46.000000",
    "servo.max_power_W": "nan",
    "servo.max_velocity": "500.000000",
    "servo.pid_dq_hz": "100.000000",
    "servo.enable_motor_temperature": "1",
}
#: Fields of two channels of telemetry with their types in a schema (7: float32, 3/1: an int8, 17: an enum of it).
CONTROL = ("d_V", "q_V", "i_d_A", "i_q_A")


def schema(*fields: tuple[str, bytes]) -> bytes:
    """An object's: each field has flags, a name, no other names, a type and no default."""
    each = (b"\0" + bytes((len(name),)) + name.encode() + b"\0" + kind + b"\0" for name, kind in fields)
    return b"\x10\0" + b"".join(each) + b"\0\0\0\0\0"


class Moteus:
    """A controller that takes up its currents at once; `lost` replies never come."""

    def __init__(self) -> None:
        self.configuration = dict(CONFIGURATION)
        self.set: list[tuple[str, str]] = []
        #: What it says of a value that it was set to.
        self.kept: Callable[[str], str] = str
        self.mode, self.fault, self.code = 0, 0, 0
        self.d = self.q = 0.0
        self.steps = 0  # of starting
        self.starting: list[int] = []
        self.lost = 0
        self.deaf: set[int] = set()  # modes that are not taken
        self.map_version = 5
        self.velocity, self.bus, self.board, self.motor = 2.5, 24.0, 31.5, 42.25
        self.voltages = (-1.25, 3.5)
        self.theta, self.position = 1.5, 0.25
        self.shortfall = 0.0
        self.requests: list[tuple[int, str]] = []
        self._line, self._out = b"", b""

    @property
    def modes(self) -> list[int]:
        """The modes that were commanded, in order."""
        return [int(data[4:6], 16) for _, data in self.requests if data.startswith("0100")]

    def take(self, identifier: int, data: bytes) -> tuple[int, bytes] | None:
        """Take a frame; give the reply, None where none is asked for or it is lost."""
        source, node = identifier >> 8 & 0xFF, identifier & 0xFF
        if node not in (NODE, 0x7F):
            return None
        self.requests.append((identifier, data.hex()))
        said = self._said(data)
        if not source & 0x80:
            return None
        if self.lost:
            self.lost -= 1
            return None
        size = next(size for size in (*range(9), 12, 16, 20, 24, 32, 48, 64) if size >= len(said))
        return (identifier & ~0xFFFF) | NODE << 8 | source & 0x7F, said.ljust(size, b"\x50")

    def _said(self, data: bytes) -> bytes:
        rest, said, written = data, b"", dict[int, float]()
        while rest:
            kind, rest = rest[0], rest[1:]
            if kind == 0x50:
                continue
            if kind in (0x40, 0x42):
                return self._stream(kind, rest)
            size, form = {0: (1, "b"), 2: (4, "i"), 3: (4, "f")}[kind >> 2 & 3]
            register, rest = rest[0], rest[1:]
            if register & 0x80:
                register, rest = register & 0x7F | rest[0] << 7, rest[1:]
            head = bytes((register,)) if register < 0x80 else bytes((register & 0x7F | 0x80, register >> 7))
            count = kind & 3
            if kind < 0x10:
                for place in range(count):
                    written[register + place] = struct.unpack(f"<{form}", rest[:size])[0]
                    rest = rest[size:]
            else:
                values = [self._register(register + place) for place in range(count)]
                if None in values:
                    return b"\x31" + head + b"\x01"
                numbers = b"".join(struct.pack(f"<{form}", int(one) if form != "f" else one) for one in values)  # type: ignore[arg-type]
                said += bytes((kind + 0x10,)) + head + numbers
        if 0 in written:
            self._command(int(written[0]), written)
        return said

    def _command(self, mode: int, written: dict[int, float]) -> None:
        if mode in self.deaf or (self.mode == 1 and mode != 0):
            return
        if mode == 0:
            self.mode, self.code, self.d, self.q = 0, 0, 0.0, 0.0
        elif self.mode == 0 and self.starting:
            self._pending = written
            self.mode = self.starting.pop(0)
        else:
            self.mode = mode
            self.d, self.q = written.get(0x1D, 0.0), written.get(0x1C, 0.0)

    def _register(self, register: int) -> float | None:
        if register == 0 and self.mode in (2, 3, 4):
            now = self.mode
            if self.starting:
                self.mode = self.starting.pop(0)
            elif self.mode != 1:
                self.mode, self.d, self.q = 9, self._pending[0x1D], self._pending[0x1C]
            return now
        return {
            0x000: self.mode,
            0x001: self.position,
            0x002: self.velocity,
            0x004: self.q * (1.0 - self.shortfall),
            0x005: self.d,
            0x00A: self.motor,
            0x00D: self.bus,
            0x00E: self.board,
            0x00F: self.code,
            0x101: 0x010304,
            0x102: self.map_version,
            0x120: 0x11223344,
            0x121: -2,
            0x122: 0x55667788,
        }.get(register)

    def _stream(self, kind: int, rest: bytes) -> bytes:
        if kind == 0x40:
            self._line += rest[2 : 2 + rest[1]]
            while b"\n" in self._line:
                line, _, self._line = self._line.partition(b"\n")
                self._out += self._answer(line.decode().strip())
        given, self._out = self._out[:41], self._out[41:]
        return bytes((0x41, 1, len(given))) + given

    def _answer(self, line: str) -> bytes:
        words = line.split()
        match words:
            case ["conf", "get", name]:
                return (
                    f"{self.configuration[name]}\r\n".encode()
                    if name in self.configuration
                    else b"ERR error reading\r\n"
                )
            case ["conf", "set", name, value]:
                self.configuration[name] = self.kept(value)
                self.set.append((name, value))
                return b"OK\r\n"
            case ["tel", "fmt", *_] | ["tel", "stop"]:
                return b"OK\r\n"
            case ["tel", verb, "servo_control"]:
                fields = schema(*((name, b"\x07") for name in CONTROL))
                return blob(verb, "servo_control", fields, struct.pack("<4f", *self.voltages, self.d, self.q))
            case ["tel", verb, "servo_stats"]:
                fields = schema(
                    ("mode", b"\x11\x03\x01\x02\x00\x07stopped\x09\x07current"),
                    ("electrical_theta", b"\x07"),
                    ("control_position_raw", b"\x15\x01\x03\x08\x00"),
                )
                return blob(verb, "servo_stats", fields, struct.pack("<bf", self.mode, self.theta) + b"\x00")
        return b"" if not words else b"ERR unknown command\r\n"


def blob(verb: str, name: str, schema: bytes, data: bytes) -> bytes:
    word, content = ("schema", schema) if verb == "schema" else ("emit", data)
    return f"{word} {name}\r\n".encode() + struct.pack("<I", len(content)) + content


class Bus:
    """A moteus on a virtual bus of python-can's."""

    def __init__(self, moteus: Moteus, channel: str) -> None:
        self.frames: list[can.Message] = []
        self._moteus = moteus
        self._bus = can.Bus(interface="virtual", channel=channel)
        self._notifier = can.Notifier(self._bus, [self._take], timeout=0.02)

    def _take(self, message: can.Message) -> None:
        self.frames.append(message)
        reply = self._moteus.take(message.arbitration_id, bytes(message.data))
        if reply is not None:
            identifier, data = reply
            self._bus.send(
                can.Message(
                    arbitration_id=identifier,
                    is_extended_id=identifier > 0x7FF,
                    is_fd=True,
                    bitrate_switch=True,
                    data=data,
                )
            )

    def close(self) -> None:
        self._notifier.stop()
        self._bus.shutdown()


@pytest.fixture(autouse=True)
def quickly_left(monkeypatch: pytest.MonkeyPatch) -> None:
    """Every test leaves a bus, which otherwise takes as long as its thread listens."""
    monkeypatch.setattr("drivers.transport.can.buses.LISTENING_TIME", 0.01)


@pytest.fixture
def moteus() -> Moteus:
    return Moteus()


@pytest.fixture
def bus(moteus: Moteus) -> Iterator[Bus]:
    made = Bus(moteus, "moteus")
    yield made
    made.close()


@pytest.fixture
def opened(bus: Bus, clock: Any) -> Iterator[Callable[..., Any]]:
    from drivers.catalogue import Surroundings
    from drivers.mjbots.inverter import MjbotsMoteus
    from drivers.mjbots.options import MoteusOptions
    from drivers.transport.can.buses import CanBuses

    made: list[MjbotsMoteus] = []

    def open_it(address: str = f"can://virtual/moteus?node={NODE}", **given: Any) -> MjbotsMoteus:
        known = {key: given.pop(key) for key in ("guarding", "traffic", "wire", "calls") if key in given}
        surroundings = Surroundings(clock, can_buses=CanBuses(), **known)
        options = MoteusOptions(**{"maximum_current": 20.0, **given})
        made.append(MjbotsMoteus.open(address, options, surroundings, "inverter"))
        return made[-1]

    yield open_it
    for one in made:
        one.close()
