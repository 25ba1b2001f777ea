"""Interlock contacts by the scheme of their address; importing this imports no transport library."""

from drivers.can_bus.options import CanInterlockOptions
from drivers.interfaces import Interlock
from drivers.modbus.options import ModbusInterlockOptions

InterlockOptions = ModbusInterlockOptions | CanInterlockOptions


def options_for(address: str) -> type[InterlockOptions]:
    """Return the class of an interlock's options by its address. Raises ValueError for a scheme of neither kind."""
    scheme = address.partition("://")[0]
    if scheme in ("tcp", "rtu"):
        return ModbusInterlockOptions
    if scheme == "can":
        return CanInterlockOptions
    raise ValueError("write tcp://host:port, rtu:///dev/…?baudrate=… or can://interface/channel?bitrate=…")


def open_interlock(address: str, options: InterlockOptions, *, name: str) -> Interlock:
    """Return the contact; raises what its class raises."""
    if isinstance(options, CanInterlockOptions):
        from drivers.can_bus.interlock import CanInterlock

        return CanInterlock(address, options, name=name)
    from drivers.modbus.interlock import ModbusInterlock

    return ModbusInterlock(address, options, name=name)
