"""What the reference of the moteus states, or what is assumed where it does not, by the registers that a frame asks for."""

import struct
from base64 import b64encode
from collections.abc import Sequence
from typing import Any

from bench.motor.motor_file import load_motor
from bench.testing.conformance.manual import Manual, Model, NotYet, ProtectionTrip, Reply, StatedLimits
from drivers.interfaces import (
    Accuracy,
    CommunicationError,
    Identity,
    IdentityError,
    MeasurementError,
    ReportedError,
)
from tests.bench.testing.conformance import own_moteus_frames as frames

_CURRENT = Accuracy(gain=0.05, offset=0.1, resolution=0.1)
_VOLTAGE = Accuracy(gain=0.05, offset=0.01, resolution=0.01)
#: Mode and fault code: as read, and as the answer to a stop; what is measured; currents alone.
_STATE, _MEASURED, _CURRENTS = "^read 000H read 00FH$", "^read 000H read 002H", "^read 004H 005H$"
_BEGINS = "driving_dq_current begins"
_POLES = load_motor("lg-400w").virtual_motor().pole_pairs

#: Firmware 1.3.4, register map 5, a serial number.
_IDENTITY = bytes.fromhex("2a8102 04030100 05000000 2ba002 11111111 22222222 33333333")
_NUMBER, _EXTREME = bytes.fromhex("111111112222222233333333"), bytes.fromhex("00000080")
_SERIAL = b64encode(_NUMBER).decode()
_WHO = "^read 101H"
#: The same by a count of its own, and with a subframe that says nothing.
_COUNTED = b"\x50" + bytes.fromhex("28 02 8102 04030100 05000000 2ba002 11111111 22222222 33333333")
_OLD, _NEW = (_IDENTITY.replace(b"\x05", version, 1) for version in (b"\x03", b"\x06"))


def _asks(*said: Any) -> str:
    return "^stream 1 " + " ".join(said)


_KINDS = frames.schema(
    ("flag", frames.BOOLEAN),
    ("none", frames.NULL),
    ("far", frames.VARUINT),
    *((f"i{size}", frames.whole(size)) for size in (1, 2, 4, 8)),
    *((f"u{size}", frames.whole(size, signed=False)) for size in (1, 2, 4, 8)),
    ("wide", frames.DOUBLE),
    ("word", frames.enumeration("a", "b")),
    ("row", frames.array(3, frames.whole(2))),
    ("one", frames.union(frames.NULL, frames.whole(4))),
    ("part", frames.schema(("x", frames.FLOAT))),
    ("d_V", frames.FLOAT),
    ("q_V", frames.FLOAT),
    default=(b"\1", b"", b"\5"),
)
_VALUES = (
    b"\1" + b"\x80\x01" + bytes(15) + bytes(15) + bytes(8) + b"\1" + bytes(6) + b"\1" + bytes(4) + bytes(4)
    + struct.pack("<2f", -1.5, 2.5)
)  # fmt: skip
_SCHEMA, _GET = _asks("tel schema servo_control"), _asks("tel get servo_control")


def _telemetry(schema: bytes, values: bytes = _VALUES, **told: Any) -> Reply:
    """Return a reply to the question for a schema, with the telemetry that comes by it."""
    beside = {_GET: frames.blob("emit servo_control", values)}
    return Reply(_SCHEMA, frames.blob("schema servo_control", schema), call="measure_dq", beside=beside, **told)


def _said(what: str, frame: bytes, *says: str) -> Sequence[Reply]:
    """Return replies of the configuration's that are told when it is opened."""
    return tuple(
        Reply(_asks(f"conf get {what}$"), frame, ReportedError, call="open", says=one, times=1) for one in says
    )


_UNUSABLE = {"error": CommunicationError, "says": "no usable telemetry"}
_NUMBERS = frames.registers(speed=2.0, q=3.0, d=-1.0, bus=21.0, board=42.0)
_STREAM: Sequence[Reply] = (
    _telemetry(_KINDS, reads={"d_voltage": -1.5, "q_voltage": 2.5}),
    _telemetry(_KINDS, _VALUES[:-1], **_UNUSABLE),
    _telemetry(b"\x07", **_UNUSABLE),
    _telemetry(frames.schema(("x", b"\x09"), ("d_V", frames.FLOAT)), **_UNUSABLE),
    _telemetry(frames.schema(("x", frames.whole(3))), **_UNUSABLE),
    _telemetry(frames.schema(("x", frames.array(2, b"\0"))), **_UNUSABLE),
    _telemetry(frames.schema(("x", frames.union(frames.NULL))), b"\1", **_UNUSABLE),
    _telemetry(frames.schema(("q_V", frames.FLOAT)), bytes(4), error=CommunicationError, says="no number d_V"),
    _telemetry(
        frames.schema(("d_V", frames.FLOAT), ("q_V", frames.FLOAT)),
        struct.pack("<2f", 1.0, float("nan")),
        error=CommunicationError,
        says="no number q_V",
    ),
    Reply(_SCHEMA, frames.stream(b"ERR unknown name\r\n"), ReportedError, call="measure_dq", says="it has no"),
    Reply(_GET, frames.stream(b"emit servo_sta"), CommunicationError, call="measure_dq", says="no whole answer", within=1.2),
    Reply(_GET, frames.blob("emitted", b""), CommunicationError, call="measure_dq", within=1.2),
    *_said("motor.poles", frames.stream(b"many\r\n"), "motor.poles is many"),
    *_said("motor.poles", frames.stream(b"ERR error reading\r\n"), "it has no motor.poles"),
    Reply(_asks("conf set servo.max_current_A"), frames.stream(b"ERR\r\n"), ReportedError, call="open", says="it has no"),
    Reply("^poll 1$", frames.stream(bytes(41)), CommunicationError, call="open", says="does not end", within=3.0),
    # Telemetry that somebody had switched on is thrown away until it ends.
    Reply("^poll 1$", frames.stream(b"emit x\r\n" + bytes(20)), None, call="open", times=20),
    # Another channel's bytes are none of ours.
    Reply("^poll 1$", b"\x41\x02\x03abc", None, call="open", times=2),
    # What is lost once is asked again.
    Reply(_asks("conf get motor.poles"), None, None, call="open", times=1),
    Reply(_MEASURED, None, None, times=2),
    Reply(_MEASURED, None, CommunicationError, call="measure_frequency", says="no reply", times=3),
)  # fmt: skip
_READINGS: Sequence[Reply] = (
    Reply(_MEASURED, _NUMBERS, reads={"value": 2.0 * _POLES, "unit": "Hz"}, call="measure_frequency"),
    Reply(_MEASURED, _NUMBERS, reads={"value": 3.0, "unit": "A"}, call="measure_current"),
    Reply(
        _MEASURED,
        _NUMBERS,
        reads={"d_current": -1.0, "q_current": 3.0, "bus_voltage": 21.0, "board_temperature": 42.0, "duration": 0.05},
        call="measure_dq",
    ),
    # Numbers of another type say the same; the most negative one is none.
    Reply(_MEASURED, _NUMBERS.replace(b"\x21\x00\x09", b"\x25\x00\x09\x00", 1), reads={"value": 3.0}, call="measure_current"),
    Reply(_MEASURED, _NUMBERS.replace(b"\x21\x00\x09", b"\x21\x00\x80", 1), CommunicationError, says="0x000 has no number"),
    Reply(_MEASURED, frames.registers(q=float("nan")), CommunicationError, says="0x004 has no number"),
    Reply(_MEASURED, _NUMBERS[:-3], CommunicationError, says="0x00F has no number"),
    Reply(_MEASURED, b"\x2e\x04\x00", CommunicationError, says="no usable reply"),
    Reply(_MEASURED, b"\x21\xff\xff\xff\xff\xff\x01\x00", CommunicationError, says="more than five bytes"),
    Reply(_MEASURED, b"\x30\x0a\x02", ReportedError, says="0x00A (2)"),
    *(
        Reply(_MEASURED, frames.registers(code=code), MeasurementError, call=call, says=says, within=within)
        for call, within in (("measure_dq", 0.05), (_BEGINS, 2.2))
        for code, says in ((96, "servo.max_velocity"), (99, "servo.max_current_A"), (110, "code 110"))
    ),
    Reply(_MEASURED, frames.registers(11), ReportedError, call="measure_dq", says="its mode is 11"),
    Reply(_MEASURED, frames.registers(1, 38), ReportedError, call="measure_dq", says="it is too hot"),
    Reply(_MEASURED, frames.registers(11), ReportedError, call=_BEGINS, says="its mode is 11"),
    # Two hundredths of the 20 A: settled, and not.
    Reply(_MEASURED, frames.registers(d=-1.2, q=1.99), None, call=_BEGINS, within=0.2),
    Reply(_MEASURED, frames.registers(d=-0.81, q=1.6), None, call=_BEGINS, within=0.2),
    Reply(_MEASURED, frames.registers(d=-1.2, q=2.01), MeasurementError, call=_BEGINS, says="after mode 9", within=2.2),
    Reply(_MEASURED, frames.registers(d=-0.79, q=1.6), MeasurementError, call=_BEGINS, within=2.2),
)  # fmt: skip
_STAGE: Sequence[Reply] = (
    Reply(_STATE, frames.state(10), ReportedError, call=_BEGINS, says="its mode is 10", after="01CH"),
    Reply(_STATE, frames.state(1, 33), ReportedError, call=_BEGINS, says="fault 33", after="01CH"),
    Reply(_STATE, frames.state(2), None, call=_BEGINS, after="01CH", times=5),
    Reply(_STATE, frames.state(4), ReportedError, call=_BEGINS, says="its mode is 4", after="01CH", within=2.2),
    Reply(_STATE, frames.state(11), ReportedError, call="set_dq_current", says="its mode is 11"),
    Reply(_STATE, frames.state(9), ReportedError, call="make_safe", says="stays in mode 9"),
    Reply("^write 000H read", frames.state(1, 38), ReportedError, call="make_safe", says="it is too hot", times=1),
    Reply(_STATE, frames.state(1, 38), ReportedError, call="make_safe", says="it is too hot", times=1),
    Reply("^write 000H read", frames.state(1, 38), ReportedError, call=_BEGINS, says="it is too hot", times=1),
    # A twentieth of the 20 A may be what a sensor shows without a current.
    Reply(_CURRENTS, frames.floats(0x04, 0.7, -0.7), None, call="make_safe", within=0.1),
    Reply(_CURRENTS, frames.floats(0x04, 0.8, -0.8), ReportedError, call="make_safe", says="1.13 A still flow", within=1.2),
    Reply(_CURRENTS, frames.floats(0x04, 0.0, 1.1), ReportedError, call="make_safe", says="1.1 A still flow"),
)  # fmt: skip
_IDENTITIES: Sequence[Model] = (
    *(
        Model({_WHO: said}, states={"identity": Identity("mjbots", "moteus", _SERIAL, "1.3.4")})
        for said in (_IDENTITY, _COUNTED, _IDENTITY.replace(b"\x05", b"\x04", 1))
    ),
    # The most negative word is one of a serial number like any other.
    *(
        Model(
            {_WHO: _IDENTITY.replace(word, _EXTREME)},
            states={"identity.serial_number": b64encode(_NUMBER.replace(word, _EXTREME[::-1])).decode()},
        )
        for word in (b"\x11" * 4, b"\x33" * 4)
    ),
    Model({_WHO: _OLD}, error=ReportedError, says="version 3"),
    Model({_WHO: _NEW}, error=ReportedError, says="version 6"),
    Model({_WHO: _IDENTITY}, {"serial_number": _SERIAL}),
    Model({_WHO: _IDENTITY}, {"serial_number": "another"}, error=IdentityError, says="expected another"),
    Model(options={"can_prefix": 1}, error=CommunicationError, says="no reply"),
)
_STROKES = {"d_current": 1.0, "q_current": 0.0, "other_d_current": 0.0, "other_q_current": 1.0}
MOTEUS = Manual(
    defaults={"can_prefix": 0, "settle_timeout": 2.0, "transition_timeout": 1.0, "sample_interval": 0.005},
    accuracies={
        "with both currents: current reading": _CURRENT,
        "with both currents: frequency reading": Accuracy(gain=1e-3, offset=0.05),
        **{f"current reading, {axis}": _CURRENT for axis in ("d axis", "q axis")},
        **{f"voltage reading, {axis}": _VOLTAGE for axis in ("d axis", "q axis")},
    },
    limits=(
        StatedLimits("driving_dq_current", "d_current", -20.0, 20.0, {"q_current": 0.0}),
        StatedLimits("driving_dq_current", "q_current", -20.0, 20.0, {"d_current": 0.0}),
        # Six eighths and the rest of a circle of 20 A.
        StatedLimits("driving_dq_current", "q_current", -16.0, 16.0, {"d_current": -12.0}, beyond=0.01),
        StatedLimits("alternate_dq_current", "duration", 1e-3, 0.5, {**_STROKES, "strokes": 3}),
        StatedLimits("alternate_dq_current", "strokes", 3, 99, {**_STROKES, "duration": 0.01}, beyond=1),
    ),
    models=_IDENTITIES,
    others=(_OLD, _NEW, _IDENTITY[:11], bytes.fromhex("7f"), _IDENTITY[:13] + _IDENTITY[13:-5]),
    replies=(
        Reply(_WHO, _OLD, ReportedError, says="register map has version 3"),
        Reply(_WHO, bytes.fromhex("31820201"), ReportedError, says="0x102 (1)"),
        Reply(_WHO, _IDENTITY[:11], CommunicationError, says="no number in its reply"),
        Reply(_WHO, bytes.fromhex("7f"), CommunicationError, says="subframe 0x7F"),
        *_STAGE,
        *_READINGS,
        *_STREAM,
    ),
    not_yet=(
        NotYet(_STATE, frames.state(9), 1.0, call="make_safe", between="^write 000H read"),
        NotYet(_CURRENTS, frames.floats(0x04, 5.0, 0.0), 1.0, call="make_safe"),
    ),
    trip=ProtectionTrip(lambda simulated: simulated.servo._trip(34), says="fault 34", within=0.5),
)
