"""Other CiA 402 drives than the simulated ones, by their objects: other user units, ratings, identities, watches over the master.

The factor group and 60A9h as CiA 402-2 has them; identity, device name and consumer heartbeat as CiA 301 has them.
"""

import math
from collections.abc import Mapping, Sequence
from typing import Any

from bench.testing.conformance.manual import Model
from drivers.cia402.stated_objects import StatedObject
from drivers.interfaces import Identity, IdentityError, InstrumentError, ReportedError, SetpointError

_TOLD = "measure_frequency.value"
_RPM, _TURNS, _DEGREES, _RADIANS, _COUNTS, _COUNTS_A_MINUTE = (
    0x00B44700, 0x00B40300, 0x00410300, 0x00100300, 0x00B50300, 0x00B54700,
)  # fmt: skip
_ENCODER, _GEAR, _FEED, _FACTOR = 0x608F, 0x6091, 0x6092, 0x6096


def _number(value: int) -> bytes:
    return value.to_bytes(4, "little", signed=value < 0)


def _ratio(index: int, above: int, below: int) -> dict[str, bytes | None]:
    return {f"^read {index:04X}H 1": _number(above), f"^read {index:04X}H 2": _number(below)}


def _unit(code: int | None, counts: int = 1000) -> dict[str, bytes | None]:
    """Return a drive whose 60A9h is `code` and which shows so many counts of velocity."""
    return {"^read 60A9H": None if code is None else _number(code), "^read 606CH": _number(counts)}


def _shows(code: int | None, hertz: float, *ratios: Mapping[str, bytes | None], **options: Any) -> Model:
    answers = _unit(code)
    for one in ratios:
        answers |= one
    return Model(answers, options, {_TOLD: hertz})


def _refuses(code: int | None, says: str, *ratios: Mapping[str, bytes | None], **options: Any) -> Model:
    answers = _unit(code)
    for one in ratios:
        answers |= one
    return Model(answers, options, error=ReportedError, says=says)


_THOUSAND = _ratio(_ENCODER, 1000, 1)
#: Of a thousand counts.
_UNITS: Sequence[Model] = (
    _shows(_RPM, 1000.0 / 60.0),
    _shows(_RPM | 0x01 << 24, 10_000.0 / 60.0),
    _shows(_RPM | 0xFF << 24, 100.0 / 60.0),
    _shows(_TURNS, 1000.0),
    _shows(_DEGREES, 1000.0 / 360.0),
    _shows(_RADIANS, 1000.0 / (2.0 * math.pi)),
    _shows(_COUNTS, 1.0, _THOUSAND),
    _shows(_COUNTS, 2.0, _ratio(_ENCODER, 1000, 2)),
    _shows(_COUNTS_A_MINUTE, 1.0 / 60.0, _THOUSAND),
    _shows(_COUNTS, 0.5, increments_per_turn=2000),
    _shows(_COUNTS, 1000.0 / 60.0, velocity_unit="rpm"),
    _shows(_RPM, 4000.0 / 60.0, pole_pairs=4),
    _refuses(_RPM, "State pole_pairs", pole_pairs=None),
    _refuses(_COUNTS, "0x608F"),
    _refuses(_COUNTS, "0x608F", _ratio(_ENCODER, 1, 1)),
    _refuses(None, "0x608F", velocity_unit="counts/s"),
    _refuses(0x00B40000, "velocity_unit"),
    # As the station states it, where the drive says nothing.
    *(
        _shows(None, hertz, velocity_unit=stated)
        for stated, hertz in (
            ("rpm", 1000.0 / 60.0), ("0.1 rpm", 100.0 / 60.0), ("rps", 1000.0), ("1e-2 rps", 10.0), ("deg/s", 1000.0 / 360.0),
            ("rad/s", 1000.0 / (2.0 * math.pi)), (" 2 Hz ", 2000.0),
        )
    ),
    _shows(None, 1.0, _THOUSAND, velocity_unit="counts/s"),
    _shows(None, 10.0, _THOUSAND, velocity_unit="10 counts/s"),
    # Electrical: whatever the pole pairs.
    _shows(None, 1000.0, velocity_unit="Hz", pole_pairs=4),
    _refuses(_RPM, "contradicts", velocity_unit="0.1 rpm"),
    _refuses(_RPM, "contradicts", velocity_unit="Hz"),
    *(
        Model(options={"velocity_unit": stated}, error=ValueError, says="velocity_unit")
        for stated in ("mph", "0 rpm", "-1 rpm", "1e999 rpm", "rpm, about")
    ),
    Model(options={"increments_per_turn": 0}, error=ValueError, says="increments_per_turn"),
    # A gear between motor and what the drive calls a turn.
    _refuses(_RPM, "0x6091", _ratio(_GEAR, 2, 1)),
    _shows(_RPM, 1000.0 / 60.0, _ratio(_GEAR, 3, 3)),
    _shows(_RPM, 1000.0 / 60.0, _ratio(_GEAR, 2, 1), velocity_unit="rpm"),
    # The velocity factor fits the unit in one of makers' ways, or contradicts it.
    _shows(_RPM, 1000.0 / 60.0, _ratio(_FACTOR, 2, 2)),
    _shows(_RPM, 1000.0 / 60.0, _ratio(_FACTOR, 60, 1)),
    _shows(_RPM, 1000.0 / 60.0, _ratio(_FACTOR, 1, 60)),
    _shows(_RPM, 1000.0 / 60.0, _ratio(_FACTOR, 1000, 60), _THOUSAND),
    _shows(_RPM, 1000.0 / 60.0, _ratio(_FACTOR, 60, 1000), _THOUSAND),
    _shows(_RPM, 1000.0 / 60.0, _ratio(_FACTOR, 60, 500), _THOUSAND, _ratio(_FEED, 500, 1)),
    _shows(None, 1000.0, _ratio(_FACTOR, 7, 1), velocity_unit="Hz"),
    _refuses(_RPM, "0x6096", _ratio(_FACTOR, 7, 1)),
    _refuses(_RPM, "0x6096", _ratio(_FACTOR, 60_007, 1000)),
    # By units of position a second, where the factor is 1:1.
    _shows(None, 1.0, _THOUSAND, _ratio(_FACTOR, 1, 1)),
    _shows(None, 2.0, _THOUSAND, _ratio(_FACTOR, 1, 1), _ratio(_FEED, 500, 1)),
    _shows(None, 4.0, _THOUSAND, _ratio(_FACTOR, 1, 1), _ratio(_FEED, 500, 1), _ratio(_GEAR, 2, 1)),
    _refuses(None, "velocity_unit", _THOUSAND),
    _refuses(None, "velocity_unit", _THOUSAND, _ratio(_FACTOR, 2, 1)),
    _refuses(None, "velocity_unit", _ratio(_FACTOR, 1, 1), _ratio(_FEED, 500, 1)),
)  # fmt: skip
#: A drive that turns in velocity mode alone, by its objects of 16 bits in rpm.
_VELOCITY_MODE: dict[str, bytes | None] = {
    "^read 6502H": _number(1 << 1 | 1 << 3),
    "^read 6044H": (-600).to_bytes(2, "little", signed=True),
}
_VELOCITY: Sequence[Model] = (
    Model(_VELOCITY_MODE, states={_TOLD: -10.0}),
    Model(_VELOCITY_MODE, {"pole_pairs": 4}, {_TOLD: -40.0}),
    Model(_VELOCITY_MODE | _ratio(0x604C, 1, 60), error=ReportedError, says="0x604C"),
    # Of both modes, the profile's is the one that is taken.
    Model({"^read 6502H": _number(1 << 1 | 1 << 2 | 1 << 3), **_unit(_RPM)}, states={_TOLD: 1000.0 / 60.0}),
)  # fmt: skip
#: A drive whose unit is so fine that 32 bits hold 21.47 turns a second, and that has no limit of its own below.
_FINE = {**_unit(_TURNS | 0xF8 << 24), "^read 607FH": None}
TOO_FINE: Sequence[Model] = tuple(
    Model(_FINE, {"pole_pairs": 1}, refuses={("driving_frequency", frequency, 1.0): ReportedError}, says="0x60FF")
    for frequency in (22.0, -22.0)
)
_RATED: Sequence[Model] = (
    Model(options={"current_scale": None}, error=ReportedError, says="current_scale"),
    Model({"^read 6075H": None}, error=ReportedError, says="State rated_current"),
    Model({"^read 6075H": None, "^read 6077H": b"\x0a\0"}, {"rated_current": 5.0}, {"measure_current.value": 0.05}),
    Model({"^read 6077H": b"\x0a\0"}, {"rated_current": 10.05}, {"measure_current.value": 0.1}),
    Model(options={"rated_current": 10.2}, error=ReportedError, says="10 A, the station file says 10.2 A"),
    Model({"^read 6076H": None, "^read 6077H": b"\x0a\0"}, {"current_scale": 2.0}, {"measure_current.value": 0.2}),
    *(Model(options={"current_scale": scale}, error=ValueError) for scale in (0.0, -1.0, math.inf)),
    *(Model(options={"rated_current": stated}, error=ValueError) for stated in (0.0, math.inf)),
)
_NAMELESS: Mapping[str, bytes | None] = {"^read 1008H": None}
_IDENTITIES: Sequence[Model] = (
    Model(
        {**_NAMELESS, "^read 1018H 2": _number(0x00ABCDEF)},
        states={"identity": Identity("vendor 0x000002FF", "product 0x00ABCDEF", "1", "10000")},
    ),
    Model(
        {**_NAMELESS, "^read 1018H 2": None, "^read 1018H 3": None, "^read 1018H 4": None},
        states={"identity": Identity("vendor 0x000002FF", "")},
    ),
    Model({"^read 1018H 3": _number(0x01020304)}, states={"identity.firmware": "1020304"}),
    Model({"^read 1018H 4": _number(0x01020304)}, states={"identity.serial_number": "16909060"}),
    Model({"^read 1018H 1": None}, error=ReportedError),
    Model({"^read 1018H 4": _number(7)}, {"serial_number": "7"}),
    Model({"^read 1018H 4": _number(7)}, {"serial_number": "8"}, error=IdentityError, says="serial number 7"),
)
#: Node 5 watches node 10, or nobody: by a node of 0, or a time of 0.
_TAKEN, _NOBODY, _TIMELESS, _OURS = _number(0x000A0064), _number(0x00000064), _number(0x000A0000), _number(0x007F0032)
_BEAT = _number(0x007F03E8)


def _entries(*found: bytes) -> dict[str, bytes | None]:
    return {
        "^read 1016H 0": bytes([len(found)]),
        **{f"^read 1016H {number}": one for number, one in enumerate(found, 1)},
    }


_OPTION = {"^read 6007H": b"\2\0", "^write 6007H": b""}
_WATCHES: Sequence[Model] = (
    Model(_entries(_TAKEN, _TAKEN), {"heartbeat_time": 1.0}, error=ReportedError, says="all 2 entries"),
    # What is written is not kept.
    *(
        Model(_entries(*found) | {"^write 1016H": b""}, {"heartbeat_time": 1.0}, error=ReportedError, says=f"0x1016:{entry:02X} is")
        for found, entry in (
            ((_TAKEN, _NOBODY), 2), ((_TIMELESS, _NOBODY), 1), ((_NOBODY, _TAKEN), 1), ((_NOBODY, _OURS), 2), ((_TAKEN, _OURS, _NOBODY), 2),
        )
    ),
    Model(
        _entries(_NOBODY) | {"^read 6007H": b"\1\0", "^write": b""},
        {"heartbeat_time": 1.0},
        error=ReportedError,
        says="0x6007:00 is 1 after 2",
    ),
    Model(_entries(_BEAT) | {"^write 1016H": b""}, {"heartbeat_time": 1.0}, {"watchdog.time": 1.0, "watchdog.setting": "0x1016"}),
    Model(_entries(_BEAT) | {"^write 1016H": b""} | _OPTION, {"heartbeat_time": 1.0}, {"watchdog.setting": "0x1016, 0x6007"}),
    Model({"^read 1016H": None}, {"heartbeat_time": 1.0}, {"watchdog": None}),
    *(
        Model(_entries(_NOBODY), {"heartbeat_time": time}, error=SetpointError, says="heartbeat_time") for time in (0.049, 65.536)
    ),
    *(
        Model(_entries(_NOBODY), {"heartbeat_time": 1.0, "heartbeat_node": node}, error=SetpointError, says="heartbeat_node")
        for node in (0, 128)
    ),
    Model(_entries(_number(0x007FFFFF)) | {"^write 1016H": b""}, {"heartbeat_time": 65.535}, {"watchdog.time": 65.535}),
    Model(_entries(_number(0x007F0032)) | {"^write 1016H": b""}, {"heartbeat_time": 0.05}, {"watchdog.time": 0.05}),
    Model(_entries(_number(0x000103E8)) | {"^write 1016H": b""}, {"heartbeat_time": 1.0, "heartbeat_node": 1}, {"watchdog.time": 1.0}),
)  # fmt: skip
_STATED: Sequence[Model] = tuple(
    Model(options={"field_current": one}, error=ValueError, says="field_current.")
    for one in (
        StatedObject("2000:00", "u32"),
        StatedObject("0x200:00", "u32"),
        StatedObject("0x2000", "u32"),
        StatedObject("0x2000:00", "u32", 0.0),
        StatedObject("0x2000:00", "u32", math.inf),
    )
)
#: Modes that it does not tell are those of the profile: after a current, it is profile torque.
_MODES: Sequence[Model] = (Model({"^read 6502H": None}, holds={"read 6060H 0": 4}),)
#: One that turns by velocity alone has no current to command.
_UNABLE: Sequence[Model] = (
    Model({"^read 6502H": _number(1 << 2)}, refuses={("driving_current", 1.0): InstrumentError}, says="0x6502"),
    Model({"^read 6502H": _number(1 << 3)}, refuses={("driving_frequency", 20.0, 1.0): InstrumentError}, says="0x6502"),
    Model(options={"field_current": None}, refuses={("driving_frequency", 20.0, 1.0): InstrumentError}, says="field_current"),
)  # fmt: skip
#: Life guarding that was set up would begin with the first question for the state, and must then go on: it is not asked.
_GUARDED: Sequence[Model] = tuple(
    Model({"^read 100CH": b"\xf4\1", "^read 100DH": factor}, states={"found_state.0.found": state})
    for factor, state in ((b"\3", "unknown"), (b"\0", "pre-operational"))
)
INVERTER_MODELS: Sequence[Model] = (
    *_MODES,
    *_UNABLE,
    *_GUARDED,
    *_UNITS,
    *_VELOCITY,
    *TOO_FINE,
    *_RATED,
    *_IDENTITIES,
    *_WATCHES,
    *_STATED,
)
#: The maker's objects as others have them: subindex, width, sign.
SIX_STEP_MODELS: Sequence[Model] = (
    # A fault is told at rest, too.
    *(
        Model({"^read 6041H": b"\x18\x02"}, refuses={reading: ReportedError}, says="in fault")
        for reading in ("measure_bus_voltage", "measure_bus_current", "measure_frequency")
    ),
    *(Model(options={name: None}, error=ReportedError, says=name) for name in ("mode", "bus_current", "hall_state")),
    *(
        Model({f"^read {index}H {sub}$": data}, {"bus_current": stated}, {"measure_bus_current.value": value})
        for index, sub, data, stated, value in (
            ("2123", 5, b"\xff", StatedObject("0x2123:05", "i8", 0.5), -0.5),
            ("2123", 5, b"\xff", StatedObject("0x2123:5", "u8", 0.5), 127.5),
            ("2123", 16, b"\0\x80", StatedObject("0x2123:0x10", "i16", 1e-3), -32.768),
            ("2123", 16, b"\0\x80", StatedObject("0x2123:10", "u16", 1e-3), 32.768),
            ("2ABC", 0, b"\1\0\0\0", StatedObject("0x2aBC:00", "u32", 2.0), 2.0),
        )
    ),
)
