"""Calls of scpi (python-scpi) on the switch unit, which no public driver of it takes with matrix modules, and on the supply."""

import asyncio

from calls import Calls, address
from scpi import SCPIDevice, SCPIProtocol
from scpi.devices.generic import PowerSupply
from scpi.errors import CommandError
from scpi.transports.tcp import get as tcp

_loop = asyncio.new_event_loop()


def wait(what):
    """Return what a coroutine returns."""
    return _loop.run_until_complete(asyncio.wait_for(what, 5.0))


def opened(kind, role: str, client: str):
    """Return a device over the raw socket, and its calls."""
    port = int(address(role, "socket").split("::")[2])
    device = kind(SCPIProtocol(tcp("127.0.0.1", port)))
    return device, Calls(client, refusal=CommandError)


unit, calls = opened(SCPIDevice, "switch_matrix", "scpi SCPIDevice, 34970A")
calls.make("identify()", lambda: wait(unit.identify()), lambda found: "34970A" in found[1])
calls.make("reset()", lambda: wait(unit.reset()))
calls.make("wait_for_complete(1)", lambda: wait(unit.wait_for_complete(1)))
calls.make("get_error()", lambda: wait(unit.get_error()), (0, "No error").__eq__)
for message in ("ROUT:CLOS (@111,122)", "ROUT:CLOS:EXCL (@211)", "ROUT:OPEN (@111:148)", "ROUT:CLOS (@199)"):
    calls.make(message, lambda message=message: wait(unit.command(message)))
for message, right in (
    *(("ROUT:CLOS? (@111,211)", "0,1".__eq__), ("ROUT:OPEN? (@111,211)", "1,0".__eq__), ("ROUT:DONE?", "1".__eq__)),
    *(("SYST:CTYP? 100", lambda found: "34904A" in found), ("DIAG:REL:CYCL? (@111)", None)),
    *(("CONF:VOLT:DC (@111)", None), ("ROUT:SCAN?", None), ("READ?", None)),
):
    do = unit.ask if "?" in message else unit.command
    calls.make(message, lambda message=message, do=do: (wait(do(message)) or "").strip(), right)
supply, calls = opened(PowerSupply, "supply", "scpi PowerSupply, E36313A")
calls.make("set_voltage(2500)", lambda: wait(supply.set_voltage(2500)))
calls.make("query_voltage()", lambda: float(wait(supply.query_voltage())), 2.5)
calls.make("set_current(1500)", lambda: wait(supply.set_current(1500)))
calls.make("query_current()", lambda: float(wait(supply.query_current())), 1.5)
for state in (True, False):
    calls.make(f"set_output({state})", lambda state=state: wait(supply.set_output(state)))
    calls.make("query_output()", lambda: wait(supply.query_output()), state.__eq__)
