"""Units on a Modbus line that a person named, found by reading (function 3) over framings and unit numbers."""

from collections.abc import Collection, Sequence
from functools import partial
from urllib.parse import urlsplit

from bench.discovery.findings import FoundInstrument
from bench.discovery.inquiry import Inquiry
from drivers.interfaces import CommunicationError, ReportedError
from drivers.interfaces.text import Text, lines, text
from drivers.recognition import ModbusUnit
from drivers.transport.modbus.line import LINE_ERRORS, NO_SUCH_UNIT, RTU_SILENCE, ModbusClient, ModbusLine, client_for
from drivers.transport.serial.port_errors import not_opened

#: How long (s) a unit may take to answer where its framing is known, and where several are tried.
ANSWER_TIME, SWEEP_TIME = 0.5, 0.15
#: The unit numbers that are tried unless a person says otherwise.
USUAL_UNITS = range(1, 17)
_OPENING = 2.0


def framed(port: str, framings: Sequence[str]) -> tuple[str, ...]:
    """Return the Modbus addresses of a port: one a framing where it says none itself."""
    address = port if "://" in port else f"rtu://{port}"
    if urlsplit(address).scheme != "rtu" or urlsplit(address).query:
        return (address,)
    return tuple(f"{address}?{framing}" for framing in framings)


def longest(addresses: Collection[str], units: Collection[int]) -> float:
    """Return how long (s) a sweep takes at most: each framing once, and once more the one that somebody answers."""
    return (len(addresses) + 1) * len(units) * (_patience(addresses) + 2.0 * RTU_SILENCE) + len(addresses) * _OPENING


def sweep(inquiry: Inquiry, port: str, units: Collection[int], used_by: tuple[str, ...] = ()) -> None:
    """Look for units on a line; the first framing that anybody answers is the line's."""
    framings = tuple(dict.fromkeys(one for unit in inquiry.known.modbus_units() for one in unit.framings))
    addresses = framed(port, framings)
    if not inquiry.take(addresses[0], units=units):
        return
    if not used_by:
        inquiry.say(
            text(
                "{port}: units {first} to {last} in {count} framings, at most {seconds:.0f} s; only registers are read",
                port=port,
                first=min(units),
                last=max(units),
                count=len(addresses),
                seconds=longest(addresses, units),
            )
        )
    what = text("units {first} to {last} by function 3 (register 0000H)", first=min(units), last=max(units))
    refused: list[str] = []
    for address in addresses:
        asking = partial(_units_at, inquiry, address, units, _patience(addresses), refused)
        reply = inquiry.ask(address, what, asking, longest((address,), units) + _OPENING)
        if reply:
            _judge(inquiry, address, reply, used_by)
        if reply or refused:
            return


def _units_at(
    inquiry: Inquiry, address: str, units: Collection[int], timeout: float, refused: list[str]
) -> dict[int, dict[int, tuple[int, ...]]] | None:
    """Return the registers of each unit that answers; None where none does. An address that cannot be opened is put into `refused`."""
    client = client_for(address, timeout)
    if not client.connect():
        refused.append(address)
        refusal = getattr(client, "refusal", None)
        if refusal is not None:
            raise not_opened(address, address, refusal) from refusal
        raise CommunicationError(address, text("cannot be opened at {address}", address=address))
    try:
        line = ModbusLine(client, address, clock=inquiry.clock if address.startswith("rtu") else None)
        there = {unit for unit in units if _answers(inquiry, client, unit)}
        if there:
            # Who has missed one request is not passed over on a line that is alive.
            there |= {unit for unit in units if unit not in there and _answers(inquiry, client, unit)}
        return {unit: _registers(inquiry, line, unit) for unit in sorted(there)} or None
    finally:
        line.close()


def _answers(inquiry: Inquiry, client: ModbusClient, unit: int) -> bool:
    inquiry.clock.sleep(RTU_SILENCE)
    try:
        reply = client.read_holding_registers(0, count=1, device_id=unit)
    except LINE_ERRORS:
        # The client may have hung up on silence.
        client.connect()
        return False
    return not (reply.isError() and getattr(reply, "exception_code", 0) in (0, *NO_SUCH_UNIT))


def _registers(inquiry: Inquiry, line: ModbusLine, unit: int) -> dict[int, tuple[int, ...]]:
    result: dict[int, tuple[int, ...]] = {}
    for first, count in sorted({block for kind in inquiry.known.modbus_units() for block in kind.reads}):
        try:
            result[first] = tuple(line.read(unit, first, count, "identity"))
        except (ReportedError, CommunicationError):
            # What a unit refuses, or passes over in silence, it has not; that tells it from others.
            continue
    return result


def _judge(
    inquiry: Inquiry, address: str, found: dict[int, dict[int, tuple[int, ...]]], used_by: tuple[str, ...]
) -> None:
    known: dict[int, ModbusUnit] = {}
    messages: list[Text] = []
    for unit, registers in found.items():
        told = inquiry.known.unit_at(registers)
        if told is None:
            words = ", ".join(f"{first:04X}H = {' '.join(map(str, values))}" for first, values in registers.items())
            messages.append(text("unit {unit}: unknown ({registers})", unit=unit, registers=words or "–"))
        else:
            known[unit] = told[0]
            messages.append(text("unit {unit}: {what}", unit=unit, what=told[1]))
    matches, near = inquiry.known.modbus(known)
    inquiry.add(FoundInstrument((address,), lines(messages, between="; "), None, matches, near, used_by))


def _patience(addresses: Collection[str]) -> float:
    return ANSWER_TIME if len(addresses) == 1 else SWEEP_TIME
