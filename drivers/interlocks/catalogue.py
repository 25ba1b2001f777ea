"""Our drivers of interlock contacts; importing this imports no transport library."""

from drivers.cia402.options import CanInterlockOptions
from drivers.delta.options import ModbusInterlockOptions
from drivers.safety_devices import InterlockDriver


def _modbus_contact(address: str, options: ModbusInterlockOptions) -> str:
    contact = f"{options.input} {options.number}"
    return f"unit {options.unit} {contact}" if address.startswith("rtu:") else contact


def _can_contact(_: str, options: CanInterlockOptions) -> str:
    kind = "extended frame" if options.extended else "frame"
    return f"{kind} {options.frame} byte {options.byte} bit {options.bit}"


MODBUS = InterlockDriver(
    "modbus-input",
    ModbusInterlockOptions,
    "drivers.interlocks.modbus:ModbusInterlock",
    ("tcp", "rtu"),
    _modbus_contact,
    commands_in="drivers.interlocks",
)
CAN = InterlockDriver(
    "can-frame",
    CanInterlockOptions,
    "drivers.interlocks.can:CanInterlock",
    ("can",),
    _can_contact,
    commands_in="drivers.interlocks",
)
