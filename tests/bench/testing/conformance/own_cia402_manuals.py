"""What the profile CiA 402, and the simulated drives that have it, state of themselves, by the object that is read."""

import math
from collections.abc import Sequence
from typing import Any

from bench.testing.conformance.manual import Manual, Model, NotYet, ProtectionTrip, Reply, StatedLimits
from drivers.cia402.stated_objects import StatedObject
from drivers.interfaces import (
    Accuracy,
    CommunicationError,
    Identity,
    IdentityError,
    MeasurementError,
    ReportedError,
)

#: What the station states of the simulated drives, which are set up with one pole pair.
CIA402_INVERTER: dict[str, Any] = {
    "maximum_current": 20.0,
    "maximum_frequency": 500.0,
    "heartbeat_time": 0.0,
    "process_data": False,
    "current_scale": 1.0,
    "pole_pairs": 1,
    "field_current": StatedObject("0x2000:00", "u32", 1e-3),
}
CIA402_SIX_STEP: dict[str, Any] = {
    "heartbeat_time": 0.0,
    "process_data": False,
    "mode": -1,
    "pole_pairs": 1,
    "bus_current": StatedObject("0x2010:00", "i32", 1e-3),
    "hall_state": StatedObject("0x2011:00", "u8"),
}
#: 0.001 rpm of one pole pair, in Hz.
_COUNT = 1.0 / 60_000.0

_BUS = {
    "DC link voltage": Accuracy(gain=0.01, resolution=1e-3),
    "DC link current": Accuracy(gain=0.02, offset=0.02, resolution=1e-3),
    "frequency": Accuracy(resolution=_COUNT),
}
_CURRENT = Accuracy(offset=0.5, resolution=0.01)

_FAULT, _NO_STATE, _READY = b"\x18\x02", b"\x05\x02", b"\x31\x02"
_CIA402: Sequence[Reply] = (
    Reply("read 6041H 0", _FAULT, ReportedError),
    # One that can be reset is told all the same, and one that comes on the way down.
    Reply("read 6041H 0", _FAULT, ReportedError, says="in fault", times=1),
    Reply("read 6041H 0", _FAULT, ReportedError, says="in fault", call="make_safe", after="read 6041H 0"),
    Reply("read 6041H 0", b"\x1f\x02", ReportedError),
    # Switch on disabled, without the voltage of the power stage.
    Reply("read 6041H 0", b"\x40\x02", None, call="make_safe"),
    Reply("read 6041H 0", _NO_STATE, CommunicationError),
    Reply("read 1000H 0", b"\x91\x01\x02\x00", IdentityError),
)


#: A state or a mode is waited for; in the first of these calls only, where it is named.
def _power(*calls: str) -> Sequence[NotYet]:
    return (
        *(NotYet("read 6041H 0", _READY, 1.0, call=call) for call in calls or ("",)),
        NotYet("read 6061H 0", b"\0", 1.0),
    )


def _in_fault(*calls: str) -> Sequence[Reply]:
    return tuple(Reply("read 6041H 0", _FAULT, ReportedError, call=call, says="in fault") for call in calls)


#: Another master takes the enable away.
_STOPPED = ProtectionTrip(lambda simulated: simulated.write(0x6040, 0), says="left operation")


def _running(mode: int) -> Any:
    """Return what has another program enable a simulated drive in a mode of operation: 6, 7 and Fh are the way up."""

    def run(simulated: Any) -> None:
        for index, value in ((0x6060, mode), (0x6040, 0x06), (0x6040, 0x07), (0x6040, 0x0F)):
            simulated.write(index, value)

    return run


def _node(model: str, mode: int, **stated: Any) -> Manual:
    return Manual(
        running=_running(mode),
        identity=Identity("vendor 0x000002FF", model, "1", "10000"),
        not_yet=(*_power(*stated.pop("powers", ())), *stated.pop("not_yet", ())),
        trip=ProtectionTrip(
            lambda simulated: simulated._power.trip(0x2310),
            says="0x2310 (continuous over-current); it sent the emergency 0x2310 (continuous over-current), 0x1001 = 03",
            within=0.3,
        ),
        **stated,
    )


_BEGINS, _AT_A_FIFTH = "driving_current begins", {"read 6077H 0": b"\xc8\0"}
_LIMITED = {"read 6041H 0": b"\x37\x0a"}
INVERTER = _node(
    "Virtual inverter",
    4,
    stopped=_STOPPED,
    accuracies={
        f"{when}: {what} reading": stated
        for when in ("at a frequency", "at a current")
        for what, stated in (("frequency", Accuracy(resolution=_COUNT)), ("current", _CURRENT))
    },
    replies=(
        *_CIA402,
        *_in_fault("measure_frequency", "measure_current", "driving_frequency begins", "driving_frequency ends"),
        *_in_fault(_BEGINS, "driving_current ends"),
        Reply("read 6075H 0", b"\0\0\0\0", ReportedError),
        Reply("read 6076H 0", b"\0\0\0\0", ReportedError, says="rated torque"),
        Reply("read 60A9H 0", b"\0\0\0\0", ReportedError, says="velocity_unit"),
        Reply("read 60A9H 0", b"\0\x47\xc0\0", ReportedError, says="velocity_unit"),
        Reply("read 607FH 0", b"\0\0\0\0", ReportedError, call="driving_frequency", says="0x607F"),
        *(
            Reply(f"read {limit} 0", b"\1\0", ReportedError, call=call, says=f"0x{limit[:4]} is 1")
            for limit in ("6072H", "6073H")
            for call in (_BEGINS, "set_current")
        ),
        Reply("read 6077H 0", b"\x9c\xff", reads={"value": -1.0}, call="measure_current"),
        # Current and torque of one motor are the same thousandths, but for a tenth of full scale and of the reading: 120 at 200.
        *(
            Reply("read 6078H 0", counts.to_bytes(2, "little"), error, call=_BEGINS, beside=_AT_A_FIFTH)
            for counts, error in ((319, None), (321, MeasurementError), (81, None), (79, MeasurementError))
        ),
        # A drive may show its current with a sign.
        Reply("read 6078H 0", (-200).to_bytes(2, "little", signed=True), None, call=_BEGINS, beside=_AT_A_FIFTH),
        Reply("read 606CH 0", b"\0\0\0\0", MeasurementError, call="driving_frequency"),
        # What has settled is within a hundredth of the rated current of 2 A; 0.05 Hz beside 5 Hz is not.
        *(
            Reply("read 6077H 0", counts.to_bytes(2, "little"), error, call=_BEGINS)
            for counts, error in ((209, None), (211, MeasurementError), (191, None), (189, MeasurementError))
        ),
        *(
            Reply("read 606CH 0", counts.to_bytes(4, "little"), MeasurementError, call="driving_frequency begins")
            for counts in (303_100, 296_900)
        ),
        # It is not reached because a limit of the drive's own acts.
        Reply(
            "read 606CH 0",
            b"\0\0\0\0",
            MeasurementError,
            call="driving_frequency begins",
            says="bit 11",
            beside=_LIMITED,
        ),
    ),
)
#: A drive that counts in rms amperes; 16 bits of a thousandth of the rated 10 A hold no more than 327.67 A.
INVERTER_VARIANTS = (
    {
        "current_scale": 2.0,
        "manual": Manual(replies=(Reply("read 6077H 0", b"\x9c\xff", reads={"value": -2.0}, call="measure_current"),)),
    },
    {
        "maximum_current": 1e4,
        "manual": Manual(limits=(StatedLimits("driving_current", "current", -327.67, 327.67, beyond=0.01),)),
    },
)
SIX_STEP = _node(
    "Virtual six-step drive",
    0,
    # While it runs, a state on the way up is one that it has left operation for.
    powers=("running begins", "running ends", "make_safe"),
    stopped=_STOPPED,
    accuracies={f"{when}: {what}": one for when in ("running", "at speed") for what, one in _BUS.items()},
    replies=(
        *_CIA402,
        *_in_fault("measure_bus_voltage", "measure_bus_current", "measure_frequency", "running begins", "running ends"),
        Reply("read 6061H 0", b"\0", MeasurementError),
        # A state on the way up, or a quick stop, while it runs is one that it has left operation for.
        *(
            Reply(
                "read 6041H 0",
                word,
                ReportedError,
                call="measure_bus_voltage",
                says=f"left operation by itself: {state}",
            )
            for word, state in ((_READY, "Ready to switch on"), (b"\x17\x02", "Quick stop active"))
        ),
        Reply("read 6079H 0", b"\xc0\x5d\0\0", reads={"value": 24.0}),
        # It has no sign.
        Reply("read 6079H 0", b"\0\0\0\x80", reads={"value": 2_147_483.648}),
        Reply("read 2010H 0", b"\x18\xfc\xff\xff", reads={"value": -1.0}),
        Reply("read 606CH 0", b"\xa0\x15\xff\xff", reads={"value": -1.0}),
    ),
)
#: 0.15 rad/s of 65536 increments a turn; brake and clutch among the inputs.
_CREEPING, _BRAKE, _CLUTCH, _NONE = b"\x1d\x06\0\0", b"\0\0\x01\0", b"\0\0\x02\0", b"\0\0\0\0"
#: 0.05 rad/s, at which it stands; and 2.08 rad/s and 2.12 rad/s of the 2 rad/s that are commanded.
_SLOW, _NEARLY, _FASTER = (round(speed / math.tau * 65_536).to_bytes(4, "little") for speed in (0.05, 2.08, 2.12))
#: In operation, a new target taken or not, reached or not; and no more in operation.
_NOT_TAKEN, _NOT_REACHED, _LEFT, _LEFT_AT_TARGET = b"\x37\x02", b"\x37\x12", b"\x50\x02", b"\x50\x16"
#: The farthest that 32 bits of increments hold.
_FARTHEST = (2**31 - 1) / 65_536 * math.tau
ROTOR = _node(
    "Virtual rotor actuator",
    1,
    accuracies={"angle": Accuracy(resolution=2.0 * math.pi / 65_536)},
    replies=(
        *_CIA402,
        *_in_fault("turn", "move_by", "stop"),
        # Where the outputs have a mask, all three are to be in it.
        *(Reply("read 60FEH 2", mask, None, beside={"write 60FEH 2": b""}) for mask in (_NONE, b"\0\0\7\0")),
        Reply("read 608FH 1", _NONE, ReportedError),
        Reply("read 608FH 2", _NONE, ReportedError),
        Reply("read 608FH 2", b"\x03\0\0\0", ReportedError),
        Reply("read 606CH 0", _CREEPING),
        Reply("read 60FDH 0", _BRAKE, ReportedError, call="release"),
        Reply("read 60FDH 0", _CLUTCH, ReportedError, call="lock"),
        Reply("read 60FDH 0", _BRAKE, call="turn"),
        Reply("read 60FDH 0", _BRAKE, call="move_by"),
        Reply("read 60FDH 0", _NONE, ReportedError, call="couple_dynamometer"),
        Reply("read 60FDH 0", b"\0\0\x04\0", ReportedError, call="uncouple_dynamometer"),
        *(Reply("read 606CH 0", _SLOW, None, call=call) for call in ("lock", "stop", "couple_dynamometer")),
        Reply("read 606CH 0", _NEARLY, None, call="turn", within=2.0),
        Reply("read 6064H 0", (-1000).to_bytes(4, "little", signed=True), reads={"value": -1000 / 65_536 * math.tau}, call="angle"),
        # What it says while it is waited for.
        Reply(
            "read 6041H 0", _FAULT, ReportedError, call="turn", after="read 606CH 0", says="in fault",
            beside={"read 606CH 0": _CREEPING}, within=2.0,
        ),
        Reply("read 6041H 0", _LEFT, ReportedError, call="turn", after="read 606CH 0", says="left operation"),
        Reply("read 6041H 0", _LEFT_AT_TARGET, ReportedError, call="move_by", after="write 607AH 0", says="left operation"),
        Reply("read 6041H 0", _NOT_TAKEN, MeasurementError, call="move_by", after="write 607AH 0", says="not taken"),
        Reply("read 6041H 0", _NOT_REACHED, MeasurementError, call="move_by", after="write 607AH 0", says="from its target"),
    ),
    limits=(StatedLimits("move_by", "angle", -_FARTHEST, _FARTHEST, beyond=5e-5),),
    not_yet=(
        NotYet("read 60FDH 0", _NONE, 5.0, call="turn"),
        NotYet("read 606CH 0", _CREEPING, 5.0, call="stop", between="read 6041H"),
        NotYet("read 606CH 0", _FASTER, 5.0, call="turn", between="read 6041H"),
    ),
    # An electrical frequency says nothing of a shaft.
    models=(
        Model({"^read 60A9H": None}, {"velocity_unit": "Hz"}, error=ReportedError, says="turns a shaft"),
        # Units of a feed: 1:1 was never set up, the increments of a turn are no other unit.
        *(
            Model({"^read 6092H 1": feed.to_bytes(4, "little"), "^read 6092H 2": turns.to_bytes(4, "little")}, error=error, says=says)
            for feed, turns, error, says in (
                (1, 1, (), ""), (65_536, 1, (), ""), (131_072, 2, (), ""), (1000, 1, ReportedError, "(1000 in 1 turns)"),
                (65_536, 2, ReportedError, "of a feed"), (2, 1, ReportedError, "of a feed"),
            )
        ),
    ),
)  # fmt: skip
