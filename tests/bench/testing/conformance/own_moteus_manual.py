"""What the reference of the moteus states, or what is assumed where it does not, by the registers that a frame asks for."""

from bench.testing.conformance.manual import Manual, ProtectionTrip, Reply, StatedLimits
from drivers.interfaces import Accuracy, CommunicationError, ReportedError

_CURRENT = Accuracy(gain=0.05, offset=0.1, resolution=0.1)
_VOLTAGE = Accuracy(gain=0.05, offset=0.01, resolution=0.01)
#: Mode and fault code: as read, and as the answer to a stop.
_STATE = "^read 000H read 00FH$"


def _state(mode: int, code: int = 0) -> bytes:
    return bytes((0x21, 0x00, mode, 0x21, 0x0F, code))


#: Firmware 1.3.4, register map 5, a serial number.
_IDENTITY = bytes.fromhex("2a8102 04030100 05000000 2ba002 11111111 22222222 33333333")

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
    ),
    replies=(
        Reply("^read 101H", _IDENTITY.replace(b"\x05", b"\x03", 1), ReportedError, says="register map has version 3"),
        Reply("^read 101H", bytes.fromhex("31820201"), ReportedError, says="0x102 (1)"),
        Reply("^read 101H", _IDENTITY[:11], CommunicationError, says="no number in its reply"),
        Reply("^read 101H", bytes.fromhex("7f"), CommunicationError, says="subframe 0x7F"),
        Reply(_STATE, _state(10), ReportedError, call="driving_dq_current begins", says="its mode is 10", after="01CH"),
        Reply(_STATE, _state(1, 33), ReportedError, call="driving_dq_current begins", says="fault 33", after="01CH"),
        Reply(_STATE, _state(9), ReportedError, call="make_safe", says="stays in mode 9"),
        Reply("^write 000H read", _state(1, 38), ReportedError, call="make_safe", says="it is too hot", times=1),
    ),
    trip=ProtectionTrip(lambda simulated: simulated.servo._trip(34), says="fault 34", within=0.5),
)
