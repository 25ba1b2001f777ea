"""The commands of simulated instruments: SCPI's commands and queries, Modbus registers, CANopen objects, registers on CAN FD."""

from collections.abc import Mapping
from typing import TYPE_CHECKING, Any

from bench.cli.output import print_json
from bench.i18n.errors import UsageError
from drivers.interfaces.text import text

if TYPE_CHECKING:
    from sim_instruments.bench import VirtualBench

#: A shipped motor on whose bench every role has an instrument.
WITH_EVERY_ROLE = "92bl-30-25l"


def print_understood(role: str, motor: Any, bench: Mapping[str, Any], *, json: bool) -> None:
    """Print what a role's instrument understands; `bench` are the words of a served bench.

    Raises UsageError for a role that is not there, or whose instrument listens to nobody.
    """
    from sim_instruments.bench import VirtualBench

    words = {name: value for name, value in bench.items() if name != "watchdog_relay"}
    with VirtualBench(motor, sockets=False, **words) as virtual:
        listening = [name for name in virtual.roles if virtual.transport(name) != "serial"]
        if role not in listening:
            raise UsageError(text("--commands {role}: allowed are {roles}", role=role, roles=sorted(listening)))
        understood = _understood(virtual, role)
    if json:
        print_json({"role": role, "understands": understood})
    else:
        print("\n".join(understood))


def _understood(virtual: "VirtualBench", role: str) -> list[str]:
    instrument, transport = virtual.instrument(role), virtual.transport(role)
    if transport == "visa":
        return sorted(instrument.tree.headers())
    if transport == "can":
        objects = sorted(instrument.entries, key=lambda entry: (entry.index, entry.subindex))
        return [f"{one.index:04X}h:{one.subindex:02X} {one.kind} {one.access} {one.name}" for one in objects]
    if transport == "can-fd":
        understood: list[str] = instrument.understands()
        return understood
    lines = []
    for number, unit in sorted(instrument.units.items()):
        lines += [f"unit {number}: {first:04X}H … {first + count - 1:04X}H" for first, count in unit.ranges]
        if hasattr(unit, "write_bit"):
            lines.append(f"unit {number}: coils (function 05)")
    return lines
