"""Calls of tm_devices: that it knows none of these models, and its plain SCPI control of each, as of any that it does not know."""

import re

from calls import Calls, address, hands
from tm_devices import DeviceManager, configure_logging
from tm_devices.driver_mixins.device_control import PIControl
from tm_devices.drivers.device import Device
from tm_devices.helpers import PYVISA_PY_BACKEND

#: By role: the model as the library parses it, its own kind of device, a setting with a value, and a query with its answer.
_DEVICES = {
    "supply": ("E36313A", "psu", ("VOLT", 2.0), "VOLT? (@1)", 2.0),
    "voltmeter": ("34461A", "dmm", ("VOLT:DC:RANG", 10.0), "VOLT:DC:RANG?", 10.0),
    "lcr_meter": ("E4980AL", "dmm", ("FREQ", 1e3), "FREQ?", 1e3),
    "oscilloscope": ("DSO-X 3024T", "scope", (":CHAN1:SCAL", 4.0), ":CHAN1:SCAL?", 4.0),
}


configure_logging(log_console_level="NONE", log_file_level="NONE")


class Unknown(PIControl, Device):
    """A device of the user's own, by the library's documented way for what it does not know."""

    device_type = "CUSTOM"

    def _cleanup(self) -> None:
        pass

    def _reboot(self) -> None:
        pass

    def _get_errors(self) -> tuple[int, tuple[str, ...]]:
        return 0, ()


#: There is one manager in a process; it looks at these again for each device.
drivers: dict[str, type[Device]] = {}
with DeviceManager(verbose=False, external_device_drivers=drivers) as manager:
    manager.visa_library = PYVISA_PY_BACKEND
    manager.setup_cleanup_enabled = manager.teardown_cleanup_enabled = False
    for role, (model, kind, (header, value), query, right) in _DEVICES.items():
        port = int(re.search(r"::(\d+)::SOCKET", address(role, "socket"))[1])
        where = {"address": "127.0.0.1", "connection_type": "SOCKET", "port": port}
        calls = Calls(f"tm_devices, {model}", refusal=SystemError)
        calls.make(f"add_{kind}", lambda kind=kind, where=where: getattr(manager, f"add_{kind}")(**where))
        drivers[model] = Unknown
        device = manager.add_unsupported_device(**where)
        calls = Calls(f"tm_devices, {model}", lambda device=device: device.visa_resource.query("SYST:ERR?"))
        calls.make("reset", lambda device=device: device.write("*RST", opc=True))
        calls.make("model", lambda device=device: device.model, lambda found, model=model: found == model)
        calls.make("set_and_check", lambda d=device, h=header, v=value: d.set_and_check(h, v, tolerance=1e-6))
        calls.make("query", lambda device=device, query=query: device.query(query), right)
        calls.make("query_response", lambda d=device, q=query, r=right: d.query_response(q, r, tolerance=1e-6)[0], True)
        calls.make("ieee_cmds.esr", lambda device=device: device.ieee_cmds.esr(), lambda found: int(found) >= 0)
        calls.make("ieee_cmds.opc", lambda device=device: device.ieee_cmds.opc(), lambda found: int(found) == 1)
        calls.make("an unknown header", lambda device=device: device.write("FOO:BAR 1"))
        calls.make(
            "query_expect_timeout", lambda device=device: device.query_expect_timeout("FOO:BAR?", timeout_ms=300)
        )
hands("let_go")
