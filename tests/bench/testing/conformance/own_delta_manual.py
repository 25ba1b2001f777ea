"""What is stated of the C2000 and the DYN-200, and assumed where they state nothing, written without looking at the drivers."""

import math
from collections.abc import Sequence

from bench.testing.conformance.manual import Manual, Model, NotYet, ProtectionTrip, Reply
from drivers.interfaces import Accuracy, CommunicationError, Identity, MeasurementError, ReportedError, SetpointError

_RPM = 2.0 * math.pi / 60.0
_ENTER = "typical of its class; enter the transducer's calibration"
_TORQUE = Accuracy(offset=5e-3, resolution=1e-4, source=f"0.1 % of full scale, {_ENTER}")
_SPEED = Accuracy(offset=0.01 * _RPM, resolution=0.01 * _RPM, source=f"one digit, {_ENTER}")
_BEGINS = "driving_speed begins"
#: 1.2345 N·m at the 15 rad/s that are commanded, 18.5 W, in counts of 0.1 mN·m and 0.01 rpm.
_SHOWN = 12345, 14324


def _sensor(power: int) -> bytes:
    """Return torque, speed, and so many counts of power."""
    return b"".join(one.to_bytes(4, "big", signed=True) for one in (*_SHOWN, power))


#: The same at a tenth of the speed.
_TENTH = b"".join(one.to_bytes(4, "big") for one in (_SHOWN[0], _SHOWN[1] // 10, 18))


def _speed(frequency: int, says: str = "") -> Reply:
    error = MeasurementError if says else None
    return Reply("read 1 2103H 1", frequency.to_bytes(2, "big"), error, call=_BEGINS, says=says)


def _power(counts: int, says: str = "") -> Reply:
    return Reply("read 2 0000H 6", _sensor(counts), MeasurementError if says else None, call=_BEGINS, says=says)


#: 15 rad/s of two pole pairs are 4.77 Hz: a third more or less may be slip, a power of ten is another number of decimals.
_SCALES: Sequence[Reply] = (
    *(_speed(frequency) for frequency in (477, 620, 366)),
    *(_speed(frequency, "Check pole_pairs") for frequency in (655, 350, 1500)),
    _speed(4775, "Set speed_decimals = 1"),
    _speed(48, "Set speed_decimals = 3"),
    # 0.1, 1 and 10 W a count, within a factor of two; too few counts settle nothing.
    *(_power(counts) for counts in (185, -185, 2, 100, 360)),
    *(_power(counts, "its decimals (08H, 20H)") for counts in (80, 400, 1000)),
)
#: A shaft that is pushed to 30 rad/s: a power of ten may be a filter that lags, but not three readings of it.
_PUSHED: Sequence[NotYet] = tuple(
    NotYet("read 1 2103H 1", frequency.to_bytes(2, "big"), call="measure", between="read 2 0000H")
    for frequency in (9550, 95)
)
#: The station says what a count is.
POWER_STATED = {
    "power_step": 1.0,
    "manual": Manual(replies=(_power(185, "Set power_step = 0.1"), _power(2, "Set power_step = 10"))),
}
DELTA = Manual(
    identity=Identity("Delta Electronics", "C2000 with DYN-200"),
    # A transducer has six decimals at the most, a double word each, and turns one way or the other; a drive has a code of one byte.
    others=(
        {8: (0, 7), 18: (0, 0)},
        {8: (1, 2), 18: (0, 0)},
        {8: (0, 2), 18: (0, 2)},
        {0: (256,), 0x2100: (0, 0)},
        {0: (0,), 0x2100: (0, 0)},
    ),
    accuracies={
        f"{when}: {what} reading": stated
        for when in ("at rest", "at a torque", "at speed", "forwards", "backwards")
        for what, stated in (("torque", _TORQUE), ("speed", _SPEED))
    },
    replies=(
        *(
            Reply(f"read 2 {register} 2", bytes.fromhex(value), CommunicationError)
            for register in ("0008H", "0020H")
            for value in ("00000007", "ffffffff")
        ),
        Reply("read 2 0012H 2", bytes.fromhex("00000001"), ReportedError, call="open", says="12H"),
        Reply("read 1 2100H 1", bytes.fromhex("0031"), ReportedError, call="open", says="49"),
        # A new drive is silent: its framing is another one.
        Reply("read 1 2100H 1", None, CommunicationError, call="open", says="set-framing"),
        Reply("read 1 2100H 1", bytes.fromhex("0001"), ReportedError, call="driving_speed begins"),
        Reply("read 2 0000H 6", bytes.fromhex("000000000000002800000000"), None, call="zero_torque"),
        *(
            Reply(
                "read 2 0000H 6",
                bytes.fromhex(shown),
                reads={"torque": torque, "speed": rpm * _RPM, "power": torque * rpm * _RPM},
                call="measure",
                times=2,
            )
            # The sensor tells no direction, and two readings do not settle the scale of its power.
            for shown, torque, rpm in (
                ("00003039 00001770 0000004e", 1.2345, 60.0),
                ("ffffcfc7 00001770 0000004e", -1.2345, 60.0),
                ("ffffcfc7 00001770 ffffffb2", -1.2345, 60.0),
                ("00003039 00000000 00000000", 1.2345, 0.0),
            )
        ),
        # Whatever turns it before anything was commanded, the reading says that its direction is not known.
        Reply(
            "read 2 0000H 6",
            bytes.fromhex("00003039 00001770 0000004e"),
            reads={"speed_accuracy.source": f"{_SPEED.source}; direction not known"},
            call="measure",
            times=1,
        ),
        # A third of the frequency, or three times: a filter that lags, which is no reason to wait.
        *(
            Reply("read 1 2103H 1", counts.to_bytes(2, "big"), None, call="measure", within=0.01)
            for counts in (3183, 350)
        ),
        # 0.75 rpm: a shaft stands below half a one.
        Reply("read 2 0000H 6", bytes.fromhex("000000000000004b00000000"), MeasurementError, call="zero_torque"),
        Reply("read 1 2100H 1", bytes.fromhex("0500"), None),
        # 0.1 A is what a sensor shows without a current.
        Reply("read 1 2103H 2", bytes.fromhex("0000000a"), None),
        Reply("read 1 2103H 2", bytes.fromhex("0000000b"), ReportedError, says="0.11 A"),
        Reply("read 1 2103H 2", bytes.fromhex("00640000"), ReportedError, says="1 Hz"),
        *_SCALES,
        # A speed that is ten times too small does not settle, for a reason that is known; a fault is told where it does not.
        Reply("read 2 0000H 6", _TENTH, MeasurementError, call=_BEGINS, says="Set speed_decimals"),
        Reply(
            "read 2 0000H 6",
            bytes(12),
            ReportedError,
            call=_BEGINS,
            says="49",
            beside={"read 1 2100H 1": b"\0\x31"},
        ),
    ),
    # 599 Hz at the most; the rated torque unless the station lowers it.
    models=(
        Model(options={"maximum_speed": 1e4}, states={"maximum_speed": math.pi * 599.0, "maximum_torque": 5.0}),
        Model(options={"maximum_speed": 1e4, "pole_pairs": 4}, states={"maximum_speed": math.pi * 299.5}),
        Model(options={"rated_torque": 3.0}, states={"maximum_torque": 3.0, "maximum_speed": 500.0}),
        Model(options={"maximum_torque": 2.0}, states={"maximum_torque": 2.0}),
        *(Model(options={"watchdog_time": time}, error=SetpointError, says="watchdog_time") for time in (0.4, 100.1)),
        *(
            Model(
                options={"watchdog_time": time},
                states={"watchdog.time": time},
                # 09-02: 2 coasts to a stop; 09-03 counts tenths of a second.
                holds={"read 1 0902H 1": (2,), "read 1 0903H 1": (tenths,)},
            )
            for time, tenths in ((0.5, 5), (2.0, 20), (100.0, 1000))
        ),
        # No torque is commanded once it has driven at one.
        Model(holds={"read 1 0B22H 1": (0,)}),
        # A sensor whose decimals of speed cannot be read shows tenths of rpm.
        Model(
            {"^read 2 0020H": None, "^read 2 0000H": bytes.fromhex("000000000000002800000000")},
            states={"measure.speed": 4.0 * math.pi / 30.0},
        ),
        Model({"^read 1 0902H": None}, {"watchdog_time": 2.0}, error=ReportedError, says="watchdog_time = 0"),
        Model({"^read 1 0903H": None}, {"watchdog_time": 2.0}, error=ReportedError, says="watchdog_time = 0"),
    ),
    # An external fault, which stays until a person resets it.
    trip=ProtectionTrip(lambda simulated: simulated.units[1].write(0x2002, [1]), says="49", resets=False),
    not_yet=(NotYet("read 1 2103H 2", bytes.fromhex("00640000"), 1.0), *_PUSHED),
)


#: Power against torque is backwards; power with torque, both ways of it, is forwards.
DELTA_BY_POWER = {
    "direction_from": "power",
    "manual": Manual(
        replies=tuple(
            Reply("read 2 0000H 6", bytes.fromhex(shown), reads={"speed": rpm * _RPM}, call="measure")
            for shown, rpm in (
                ("00003039 00001770 0000004e", 60.0),
                ("00003039 00001770 ffffffb2", -60.0),
                ("ffffcfc7 00001770 0000004e", -60.0),
                ("ffffcfc7 00001770 ffffffb2", 60.0),
            )
        )
    ),
}
#: Forwards, before anything was commanded.
DELTA_BY_COMMAND = {
    "direction_from": "command",
    "manual": Manual(
        replies=(
            Reply(
                "read 2 0000H 6",
                bytes.fromhex("000030390000177000000308"),
                reads={"speed": 60.0 * _RPM},
                call="measure",
            ),
        )
    ),
}
#: A small transducer, whose thousandth is less than three counts: these are zero, a fourth is waited for and then subtracted.
DELTA_SMALL = {
    "transducer_range": 0.05,
    "manual": Manual(
        not_yet=tuple(
            NotYet("read 2 0000H 6", bytes((0, 0, 0, counts, *bytes(8))), patience, call="zero_torque", told=False)
            for counts, patience in ((3, 0.0), (4, 1.0))
        )
    ),
}
