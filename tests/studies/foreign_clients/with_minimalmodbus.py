"""Calls of minimalmodbus on the serial line of the torque sensor and the dynamometer's drive."""

import minimalmodbus
from calls import Calls, address

port = address("dynamometer", "rtu").removeprefix("rtu://").partition("?")[0]


def unit(number: int) -> minimalmodbus.Instrument:
    """Return a unit on the line."""
    made = minimalmodbus.Instrument(port, number, close_port_after_each_call=True)
    made.serial.baudrate, made.serial.timeout = 9600, 1.0
    return made


calls = Calls("minimalmodbus")
sensor, drive = unit(2), unit(1)
calls.make("sensor: read_long(0)", lambda: sensor.read_long(0, signed=True), lambda value: abs(value) < 1000)
calls.make("sensor: read_long(2)", lambda: sensor.read_long(2), lambda value: value >= 0)
calls.make("sensor: read_registers(0, 6)", lambda: sensor.read_registers(0, 6), lambda value: len(value) == 6)
calls.make("sensor: read_long(8), decimals", lambda: sensor.read_long(8), lambda value: 0 <= value <= 4)
calls.make("sensor: write_bit(0), zero", lambda: sensor.write_bit(0, 1))
calls.make("drive: read_register(0), identity", lambda: drive.read_register(0), 6)
calls.make("drive: read_registers(0x2100, 5)", lambda: drive.read_registers(0x2100, 5), lambda value: len(value) == 5)
calls.make("drive: write_register(0x2001, 1000)", lambda: drive.write_register(0x2001, 1000, functioncode=6))
calls.make("drive: read_register(0x2102)", lambda: drive.read_register(0x2102, 2), 10.0)
