"""Interlock contacts by the scheme of their address; importing this imports no transport library."""

from drivers.cia402.options import CanInterlockOptions
from drivers.delta.options import ModbusInterlockOptions
from drivers.interfaces import Interlock
from drivers.interfaces.text import text
from drivers.transport.canonical_address import canonical_addresses

InterlockOptions = ModbusInterlockOptions | CanInterlockOptions


def options_for(address: str) -> type[InterlockOptions]:
    """Return the class of an interlock's options by its address. Raises ValueError for a scheme of neither kind."""
    scheme = address.partition("://")[0]
    if scheme in ("tcp", "rtu"):
        return ModbusInterlockOptions
    if scheme == "can":
        return CanInterlockOptions
    raise ValueError(text("write tcp://host:port, rtu:///dev/…?baudrate=… or can://interface/channel?bitrate=…"))


def contact_names(address: str, options: InterlockOptions) -> tuple[str, ...]:
    """Return the names of a contact; however its address is written, one contact has one in common."""
    if isinstance(options, CanInterlockOptions):
        kind = "extended frame" if options.extended else "frame"
        contact = f"{kind} {options.frame} byte {options.byte} bit {options.bit}"
        return tuple(f"{place} {contact}" for place in canonical_addresses(address))
    contact = f"{options.input} {options.number}"
    places = canonical_addresses(address, units=options.units)
    if address.startswith("rtu:"):
        contact = f"unit {options.unit} {contact}"
    return tuple(f"{place} {contact}" for place in places)


def open_interlock(address: str, options: InterlockOptions, *, name: str) -> Interlock:
    """Return the contact; raises what its class raises."""
    if isinstance(options, CanInterlockOptions):
        from drivers.interlocks.can import CanInterlock

        return CanInterlock(address, options, name=name)
    from drivers.interlocks.modbus import ModbusInterlock

    return ModbusInterlock(address, options, name=name)
