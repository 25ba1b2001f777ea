"""Replies that replace those of the simulated instrument, on any transport."""

from collections.abc import Callable, Mapping
from functools import partial

from bench.testing.conformance.stand import OneInstrumentBench
from sim_instruments.faults.line_faults import Fault, FaultKind, MessageWatch

#: What a node says of an object that it has not (CiA 301), and a Modbus unit of a register.
_NO_OBJECT = (0x06020000).to_bytes(4, "little")
_NO_REGISTER = 2
#: What the diagnostic stream of a multiplex node says of a name that it has not, and the node of a register.
_NO_NAME, _NO_INDEX = b"\x41\x01\x05ERR\r\n", b"\x31\x00\x02"


def play(made: OneInstrumentBench, answers: Mapping[str, bytes | None]) -> None:
    """From now on answer messages (a regular expression) in this way; None is the answer of an instrument that lacks the function.

    Messages are named as in a `Reply`.
    """
    if made.transport == "visa":
        made.answer(answers)
        return
    for pattern, data in answers.items():
        fault = Fault.on(FaultKind.REPLACE, pattern, times=None)
        fault.strikes = partial(_struck, made.transport, fault, fault.strikes, data)
        made.faults.add(fault)


def lose(made: OneInstrumentBench, message: str, number: int = 0) -> None:
    """Confirm a writing message (Modbus, CAN) without carrying it out, once: the next one, or the one of that number."""
    if made.transport == "can":
        play(made, {f"^{message}$": b""})
        return
    unit = made.simulated.units[int(message.split()[1])]

    def not_taken() -> None:
        taken = unit.write
        unit.write = lambda *_: setattr(unit, "write", taken)

    made.faults.watch(MessageWatch.at(number, not_taken) if number else MessageWatch.on(f"^{message}$", not_taken))


def put(fault: Fault, transport: str, message: str, data: bytes | None) -> None:
    """Set a fault's answer to the message that it strikes: data (a `Reply`'s), or a refusal if there is None."""
    fault.kind = FaultKind.REPLACE
    match transport:
        case "visa":
            fault.reply = (data or b"") + b"\n"
        case "modbus" if data is None:
            fault.kind, fault.code = FaultKind.EXCEPTION, _NO_REGISTER
        case "modbus":
            fault.kind = FaultKind.FROZEN
            fault.memory[message] = bytes((3, len(data or b""))) + (data or b"")
        case "can":
            verb, index, subindex = message.split()
            place = int(index[:4], 16).to_bytes(2, "little") + bytes([int(subindex)])
            if data is None:
                fault.reply = b"\x80" + place + _NO_OBJECT
                return
            command = 0x43 | (4 - len(data)) << 2 if verb == "read" else 0x60
            fault.reply = bytes([command]) + place + data.ljust(4, b"\0")
        case "can-fd" if data is None:
            fault.reply = _NO_NAME if message.startswith("stream") else _NO_INDEX
        case _:
            fault.reply = data or b""


def _struck(
    transport: str, fault: Fault, strikes: Callable[[int, str], bool], data: bytes | None, count: int, message: str
) -> bool:
    if not strikes(count, message):
        return False
    put(fault, transport, message, data)
    return True
