"""Calls of QCoDeS' drivers and its contributors': every parameter read, every one that can be set given back what it has."""

import qcodes
from calls import TRUTH, Calls, address, hands
from qcodes.instrument_drivers.Keysight import KeysightE4980A, KeysightE4980AMeasurementPair
from qcodes.instrument_drivers.Keysight.Keysight_34461A_submodules import Keysight34461A
from qcodes_contrib_drivers.drivers.Keysight.Keysight_E36313A import E36313A

_PAIRS = {
    "LSRS": (("H", "Ohm"), ("inductance", "resistance")),
    "RX": (("Ohm", "Ohm"), ("resistance", "reactance")),
    "CPD": (("F", ""), ("capacitance", "dissipation")),
}


def every(calls: Calls, module, prefix: str = "", skip=()) -> None:
    """Read every parameter of an instrument and of its submodules, and set those that can be to what was read."""
    for name, parameter in module.parameters.items():
        if name in skip:
            continue
        value = calls.make(prefix + name, parameter.get)
        if value is not None and parameter.settable and name != "timeout":
            calls.make(f"{prefix}{name}(…)", lambda parameter=parameter, value=value: parameter.set(value))
    for name, part in module.submodules.items():
        if hasattr(part, "parameters"):
            every(calls, part, f"{prefix}{name}.", skip)


def opened(kind, role: str, **options):
    """Return an instrument over HiSLIP, and its calls."""
    device = kind(kind.__name__, address(role), visalib="@py", **options)
    device.timeout(1.5)
    device.write("*RST")
    device.write("*CLS")
    return device, Calls(f"qcodes {kind.__name__}", lambda: device.visa_handle.query("SYST:ERR?"))


def multimeters() -> None:
    """Keysight34461A with all that its submodules have, and the older 34401A's driver."""
    meter, calls = opened(Keysight34461A, "voltmeter")
    every(calls, meter, skip=("time_axis", "timetrace"))
    calls.make("ac_volt", meter.ac_volt.get, TRUTH["amplitude"] / 2.0**0.5)
    calls.make("res", meter.res.get, lambda value: value == float("inf"))
    calls.make("sense_function", meter.sense_function.get, lambda value: value == "DC Voltage")
    calls.make("NPLC(1)", lambda: meter.NPLC(1))
    calls.make("range(10)", lambda: meter.range(10))
    calls.make("resolution(3e-5)", lambda: meter.resolution(3e-5))
    for name in ("autorange_once", "increase_range", "decrease_range", "init_measurement", "fetch", "read"):
        calls.make(f"{name}()", getattr(meter, name))
    for name in ("abort_measurement", "flush_error_queue", "reset"):
        calls.make(f"{name}()", getattr(meter, name))
    calls.make("display.clear()", meter.display.clear)
    meter.close()


def bridge() -> None:
    """KeysightE4980A: parameters, corrections, both measurements."""
    hands("hold_shaft")
    meter, calls = opened(KeysightE4980A, "lcr_meter")
    meter.write("TRIG:SOUR INT")
    every(calls, meter, skip=("timeout",))
    calls.make("measure_impedance", lambda: meter.measure_impedance.get()[0], TRUTH["resistance"])
    for name, (units, names) in _PAIRS.items():
        pair = KeysightE4980AMeasurementPair(name=name, names=names, units=units)
        calls.make(f"measurement_function({name})", lambda pair=pair: meter.measurement_function(pair))
        calls.make(f"measurement, {name}", lambda: meter.measurement.get())
    calls.make("correction.open()", meter.correction.open)
    calls.make("correction.short()", meter.correction.short)
    calls.make("voltage_level(0.5)", lambda: meter.voltage_level(0.5))
    calls.make("current_level(0.001)", lambda: meter.current_level(0.001))
    for name in ("system_errors", "clear_status", "reset"):
        calls.make(f"{name}()", getattr(meter, name))
    meter.close()


def supply() -> None:
    """E36313A of the contributors: all three channels."""
    device, calls = opened(E36313A, "supply")
    every(calls, device)
    device.close()


qcodes.config.logger.start_logging_on_import = "never"
multimeters()
bridge()
supply()
