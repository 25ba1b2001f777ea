"""What instruments answer: numbers, blocks, registers, frames and objects, through the drivers that read them."""

import contextlib
import struct
from collections.abc import Callable, Iterator
from functools import cache, partial
from typing import Any, ClassVar

import can
import numpy as np
from canopen.sdo.exceptions import SdoAbortedError, SdoCommunicationError
from pyvisa.constants import StatusCode
from pyvisa.errors import VisaIOError

from drivers.bases.oscilloscope_data import OscilloscopeOptions, Probe
from drivers.bases.waveform import parse_preamble, to_time, to_values
from drivers.cia402.inverter import Cia402Inverter
from drivers.cia402.node import Cia402Node
from drivers.cia402.options import Cia402Options, Cia402SixStepOptions
from drivers.cia402.six_step import Cia402SixStep
from drivers.cia402.stated_objects import StatedObject
from drivers.delta.dynamometer import DeltaDyn200
from drivers.delta.options import DeltaDyn200Options
from drivers.interfaces import ChannelSettings, InstrumentError, ProbeKind, Trigger
from drivers.keysight.dmm_34461a import Keysight34461A
from drivers.keysight.e4980a import KeysightE4980A
from drivers.keysight.e36300 import KeysightE36300
from drivers.keysight.infiniivision import KeysightInfiniiVision
from drivers.keysight.options import E4980AOptions, E36300Options, Keysight34461AOptions
from drivers.lutron.frame import parse_frame
from drivers.lutron.options import LutronTachometerOptions
from drivers.lutron.tachometer import LutronTachometer
from drivers.transport.can.buses import CanBuses
from drivers.transport.can.objects import NodeObjects
from drivers.transport.modbus.line import open_line
from drivers.transport.serial.ports import StreamPort
from drivers.transport.visa.replies import parse_error, parse_number, parse_numbers
from drivers.transport.visa.session import ScpiSession
from tests.studies.fuzz.target import Target, each, pieces

ERRORS = (InstrumentError,)
NODE = 5


class Clock:
    """Counts what is waited for."""

    def __init__(self) -> None:
        self._now = 0.0

    def now(self) -> float:
        return self._now

    def sleep(self, seconds: float) -> None:
        self._now += max(0.0, seconds)


class Wire:
    """A VISA resource: identity and empty error queue are right, every other reply is the next piece of the input."""

    read_termination: str | None = None
    write_termination = "\n"
    timeout = 0.0
    session = 1

    def __init__(self, data: bytes, identity: str = "") -> None:
        self._pieces = pieces(data)
        self._identity = identity
        self._left = b""

    @property
    def visalib(self) -> "Wire":
        return self

    def ignore_warning(self, *codes: Any) -> Any:
        return contextlib.nullcontext()

    def write(self, message: str) -> int:
        if message == "*IDN?" and self._identity:
            self._left = self._identity.encode() + b"\n"
        elif message == "SYST:ERR?" and self._identity:
            self._left = b'+0,"No error"\n'
        elif "?" in message:
            piece = next(self._pieces, None)
            self._left = b"" if piece is None else piece + b"\n"
        return len(message)

    def read(self, session: int, count: int) -> tuple[bytes, int]:
        if not self._left:
            raise VisaIOError(StatusCode.error_timeout)
        chunk, self._left = self._left[:count], self._left[count:]
        return chunk, 0

    def read_raw(self, size: int | None = None) -> bytes:
        if not self._left:
            raise VisaIOError(StatusCode.error_timeout)
        line, separator, self._left = self._left.partition(b"\n")
        return line + separator

    def clear(self) -> None:
        self._left = b""

    def open(self) -> None:
        pass

    def close(self) -> None:
        pass


def scpi_parsers(data: bytes) -> None:
    text = data.decode("latin-1")
    each(
        [
            lambda: parse_number(text),
            lambda: parse_numbers(text, 1, 4),
            lambda: parse_error(text),
            lambda: waveform(text),
        ],
        (ValueError,),
    )


def waveform(text: str) -> None:
    head, _, rest = text.partition("|")
    preamble = parse_preamble(head, 1, "WORD")
    codes = np.frombuffer(rest.encode("latin-1"), dtype="<u2")
    to_values(codes, preamble)
    to_time(codes.size, preamble)


def scpi_session(data: bytes) -> None:
    calls: list[Callable[[ScpiSession], object]] = [
        ScpiSession.identity_line,
        lambda session: session.query_block("D?"),
        lambda session: session.query_number("N?"),
        lambda session: session.query_numbers("N?", 2, 3),
        ScpiSession.check_errors,
        lambda session: session.complete("TRIG"),
        ScpiSession.reopen,
    ]
    for number in range(len(calls)):
        session = ScpiSession(Wire(data), "thing")
        each([partial(call, session) for call in calls[number:]], ERRORS)


def supply(data: bytes) -> None:
    session = ScpiSession(Wire(data, "Keysight Technologies,E36313A,MY1,1.0"), "supply")
    driver = KeysightE36300(session, Clock(), E36300Options())

    def on() -> None:
        with driver.energised(1.0, 1.0):
            driver.measure_current()

    each(
        [
            driver.output_mode,
            driver.measure_voltage,
            driver.measure_current,
            lambda: driver.configure(1.0, 1.0),
            on,
            driver._clear_protection,
            driver.make_safe,
        ],
        ERRORS,
    )


def bridge(data: bytes) -> None:
    session = ScpiSession(Wire(data, "Keysight Technologies,E4980AL,MY1,1.0"), "lcr_meter")
    driver = KeysightE4980A(session, Clock(), E4980AOptions())
    each(
        [
            driver.measure,
            lambda: driver.configure(100.0),
            driver.measure,
            driver.correct_short,
            lambda: driver.source_impedance,
            driver.make_safe,
        ],
        ERRORS,
    )


def voltmeter(data: bytes) -> None:
    session = ScpiSession(Wire(data, "Keysight Technologies,34461A,MY1,1.0"), "voltmeter")
    driver = Keysight34461A(session, Clock(), Keysight34461AOptions())
    each([driver.measure_voltage, lambda: driver.configure(1.0), driver.measure_voltage, driver.make_safe], ERRORS)


def oscilloscope(data: bytes) -> None:
    session = ScpiSession(Wire(data, "KEYSIGHT TECHNOLOGIES,DSO-X 3024T,MY1,1.0"), "oscilloscope")
    options = OscilloscopeOptions({1: Probe(ProbeKind.VOLTAGE, 10.0), 4: Probe(ProbeKind.CURRENT, 10.0)})
    driver = KeysightInfiniiVision(session, Clock(), options)
    each(
        [
            lambda: driver.fetch([1], 1.0),
            lambda: driver.configure_channel(1, ChannelSettings(8.0)),
            lambda: driver.configure_acquisition(1e-3, 1000),
            lambda: driver.configure_trigger(Trigger(None)),
            driver.initiate,
            lambda: driver.fetch([1, 4], 1.0),
            lambda: driver.measure_frequency(1),
            lambda: driver.measure_amplitude(1),
            driver.make_safe,
        ],
        ERRORS,
    )


class Stream:
    """A byte stream in process that answers each request with the next piece, as it stands or as a Modbus TCP frame's content."""

    def __init__(self, data: bytes, *, framed: bool = False) -> None:
        self._pieces = pieces(data)
        self._framed = framed
        self._left = b""

    def write(self, data: bytes) -> int:
        piece = next(self._pieces, b"")
        if self._framed and piece:
            piece = struct.pack("!HHHB", *struct.unpack("!HH", data[:4]), len(piece) + 1, data[6]) + piece
        self._left = piece
        return len(data)

    def read(self, count: int, timeout: float) -> bytes:
        chunk, self._left = self._left[:count], self._left[count:]
        return chunk

    def reset_input_buffer(self) -> None:
        self._left = next(self._pieces, b"")

    def close(self) -> None:
        pass


class Opener:
    """Opens streams and buses in process on the input."""

    def __init__(self, data: bytes, *, framed: bool = False) -> None:
        self._data = data
        self._framed = framed

    def stream(self, address: str) -> Stream:
        return Stream(self._data, framed=self._framed)

    def can_bus(self, channel: str) -> "Bus":
        return Bus(self._data)


def modbus(data: bytes, *, framed: bool) -> None:
    line = open_line("in-process://thing", "dynamometer", in_process=Opener(data, framed=framed))
    each([lambda: line.read(1, 0, 6, "registers"), lambda: line.write(1, 0, 1, "one")], ERRORS)
    driver = DeltaDyn200(line, Clock(), DeltaDyn200Options(maximum_speed=100.0, watchdog_time=0.0))
    each([driver.measure, driver.zero_torque, lambda: driver.set_speed(1.0), driver.stop, driver.make_safe], ERRORS)


def lutron(data: bytes) -> None:
    each([lambda: parse_frame(data)], (ValueError,))
    driver = LutronTachometer(StreamPort(Stream(data), 1.0), Clock(), LutronTachometerOptions())
    each([driver.measure_speed, driver.measure_speed, driver.make_safe], ERRORS)


class Objects:
    """A node's objects: it says who it is, and every other object is the next piece; the last byte may make it an error."""

    KNOWN: ClassVar = {(0x1000, 0): 0x00020192, (0x1018, 1): 1, (0x1018, 2): 2, (0x1018, 3): 3, (0x1018, 4): 4}
    #: What decides whether it can be opened at all: ratings, unit of velocity, and nothing that contradicts them.
    KNOWN |= {(0x6075, 0): 10_000, (0x6076, 0): 1_000, (0x60A9, 0): 0x00B44700}
    ABSENT: ClassVar = {0x608F, 0x6091, 0x6092, 0x6096, 0x6502, 0x6060, 0x607E, 0x60B1, 0x60B2}

    def __init__(self, data: bytes) -> None:
        self._pieces = pieces(data)

    def upload(self, index: int, subindex: int) -> bytes:
        known = self.KNOWN.get((index, subindex))
        if known is not None:
            return known.to_bytes(4, "little")
        if index in self.ABSENT:
            raise SdoAbortedError(0x06020000)
        piece = next(self._pieces, None)
        if piece is None:
            raise SdoCommunicationError("No SDO response received")
        if piece[-1:] == b"\xfe":
            raise SdoAbortedError(int.from_bytes(piece[:4], "little"))
        return piece

    def download(self, index: int, subindex: int, data: bytes, force_segment: bool = False) -> None:
        pass


def canopen_objects(data: bytes) -> None:
    each(
        [
            lambda: NodeObjects(Objects(data), "node").read_text(0x1008, 0),
            lambda: NodeObjects(Objects(data), "node").read_optional(0x6041, 0, 2),
        ],
        ERRORS,
    )
    limits = Cia402Options(
        maximum_current=10.0,
        maximum_frequency=100.0,
        current_scale=1.0,
        pole_pairs=1,
        field_current=StatedObject("0x2000:00", "u32", 1e-3),
    )
    inverter = Cia402Inverter(Cia402Node(Objects(data), Clock(), limits, name="inverter"), Clock(), limits)

    def driving() -> None:
        with inverter.driving_frequency(10.0, 1.0):
            inverter.measure_current()

    each([inverter.measure_frequency, inverter.measure_current, driving, inverter.make_safe], ERRORS)
    own = StatedObject("0x2010:00", "i32", 1e-3)
    options = Cia402SixStepOptions(mode=-1, pole_pairs=1, bus_current=own, hall_state=StatedObject("0x2011:00", "u8"))
    drive = Cia402SixStep(Cia402Node(Objects(data), Clock(), options, name="drive"), Clock(), options)

    def running() -> None:
        with drive.running():
            drive.hall_state()

    each([drive.measure_bus_voltage, drive.measure_frequency, drive.hall_state, running, drive.make_safe], ERRORS)


class Bus(can.BusABC):
    """A CAN bus on which each frame that is sent is answered by the frames of the next piece, from the node that is asked."""

    def __init__(self, data: bytes) -> None:
        self.channel_info = "fuzz"
        self._pieces = pieces(data)
        self._listener: Callable[[can.Message], None] | None = None

    def hand_over(self, listener: Callable[[can.Message], None]) -> None:
        self._listener = listener

    def send(self, msg: can.Message, timeout: float | None = None) -> None:
        piece = next(self._pieces, b"")
        for start in range(0, min(len(piece), 160), 8):
            answer = can.Message(
                arbitration_id=0x580 + NODE, data=piece[start : start + 8], is_extended_id=False, check=True
            )
            if self._listener is not None:
                self._listener(answer)

    def _recv_internal(self, timeout: float | None) -> tuple[can.Message | None, bool]:
        return None, False

    def shutdown(self) -> None:
        self._is_shutdown = True


def can_frames(data: bytes) -> None:
    node = CanBuses(Opener(data)).node(f"can://in-process/bench?node={NODE}", "inverter")
    try:
        objects = NodeObjects(node.client, "inverter")
        each(
            [
                lambda: objects.read(0x6041, 0, 2),
                lambda: objects.read_text(0x1008, 0),
                lambda: objects.write(0x6040, 0, 6, 2),
                lambda: objects.read_bytes(0x1008, 0),
            ],
            ERRORS,
        )
    finally:
        node.disconnect()


def joined(*replies: bytes) -> bytes:
    return b"\x1e".join(replies)


def _registers(*values: int) -> bytes:
    return bytes([3, 2 * len(values)]) + struct.pack(f"!{len(values)}H", *values)


@cache
def targets() -> tuple[Target, ...]:
    """Return the targets of this file."""
    return tuple(_targets())


def _targets() -> Iterator[Target]:
    preamble = b"1,0,4,1,1E-6,0,0,1E-3,0,32768"
    block = b"#800000008" + struct.pack("<4H", 32768, 40000, 20000, 32768)
    numbers = (b"+1.5000E+00", b"1,2,3", b'-222,"Data out of range"', b"9.9E37", preamble + b"|" + b"ab" * 4)
    yield Target("scpi-numbers", "numbers, errors and preambles of SCPI replies", scpi_parsers, (ValueError,), numbers)
    seeds = (joined(b"a,b,c,d", block, b"1.5", b"1,2", b'+0,"No error"', b"1"), block, b"#12ab")
    yield Target(
        "scpi-session", "any bytes at any point of a SCPI dialogue, blocks included", scpi_session, ERRORS, seeds
    )
    seeds = (joined(b"1", b"+1.0E+00", b"2.0", b"0,0", b"1", b"0"), b"9.91E37")
    yield Target("e36300-replies", "replies of an E36313A to its driver", supply, ERRORS, seeds)
    seeds = (joined(b"1", b"+1.6E-02,+1.0E-04,+0", b"0", b"100"), joined(b"+9.9E+37,+9.9E+37,-1"))
    yield Target("e4980a-replies", "replies of an E4980AL to its driver", bridge, ERRORS, seeds)
    yield Target("34461a-replies", "replies of a 34461A to its driver", voltmeter, ERRORS, (b"+1.0E-3", b"9.9E37"))
    seeds = (joined(b"1", b"1", preamble, block, b"0.1", b"1.5"), joined(b"4", preamble, block))
    yield Target("infiniivision-replies", "replies of a DSOX3024T to its driver", oscilloscope, ERRORS, seeds)
    read = joined(_registers(0, 0), _registers(0, 3), _registers(0, 1), _registers(1, 2, 3, 4, 5, 6))
    seeds = (read, joined(b"\x83\x02", b"\x06\x00\x00\x00\x01", read))
    yield Target(
        "modbus-registers", "what stands in Modbus frames", lambda data: modbus(data, framed=True), ERRORS, seeds
    )
    frame = struct.pack("!HHHB", 1, 0, 15, 1) + _registers(1, 2, 3, 4, 5, 6)
    yield Target(
        "modbus-frames",
        "any bytes where a Modbus TCP frame is due",
        lambda data: modbus(data, framed=False),
        ERRORS,
        (frame, frame[:8]),
    )
    yield Target("lutron-frames", "frames of a tachometer", lutron, ERRORS, (b"\x02412200" + b"00001600" + b"\r",))
    seeds = (
        joined(b"drive", b"\x40\x02", b"\x37\x02", b"\x00\x00\x00\x00"),
        joined(b"\x18\x02", b"\x00\x00\x02\x06\xfe"),
    )
    yield Target("canopen-objects", "objects of a CiA 402 drive", canopen_objects, ERRORS, seeds)
    upload = bytes.fromhex("4b 41 60 00 37 02 00 00")
    segmented = bytes.fromhex("41 08 10 00 0b 00 00 00") + b"\x1e" + bytes.fromhex("00 42 65 6e 63 68 20 64")
    yield Target("can-frames", "any frames from a node that is asked", can_frames, ERRORS, (upload, segmented))
