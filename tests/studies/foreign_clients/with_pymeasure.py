"""Calls of pymeasure's drivers: every property read, every one that can be set given back what it has, and figures."""

from calls import TRUTH, Calls, address, hands, properties
from pymeasure.instruments.agilent import Agilent34410A, AgilentE4980
from pymeasure.instruments.hp import HP34401A
from pymeasure.instruments.keysight import KeysightDSOX1102G, KeysightE36312A

_OURS = ("adapter", "name", "SCPI", "status", "next_error", "complete", "id", "options")
#: Those that configure another function than the one set.
_OLD = ("voltage_ac", "current_dc", "current_ac", "resistance", "resistance_4w")
#: What is the same whatever the function.
_COMMON = (
    *("complete", "status", "options", "id", "next_error", "terminals_used", "trigger_source", "trigger_count"),
    *("sample_count", "display_enabled", "displayed_text", "remote_control_enabled", "remote_lock_enabled"),
    *("beeper_enabled", "scpi_version", "self_test_result", "detector_bandwidth", "autozero_enabled", "stored_reading"),
)


def every(calls: Calls, device, prefix: str = "", skip=()) -> None:
    """Read every property of a device and set it to what was read."""
    for name in properties(type(device)):
        if name in skip or name in _OURS[:3]:
            continue
        value = calls.make(prefix + name, lambda name=name: getattr(device, name))
        if value is not None and getattr(type(device), name).fset is not None:
            calls.make(
                f"{prefix}{name} = …", lambda name=name, value=value: setattr(device, name, value), quiet=LookupError
            )


def opened(kind, role: str, way: str = "hislip"):
    """Return a device, and its calls."""
    ends = {} if way == "hislip" else {"read_termination": "\n", "write_termination": "\n"}
    device = kind(address(role, way), visa_library="@py", **ends)
    device.adapter.connection.timeout = 1_500
    device.write("*RST;*CLS")
    return device, Calls(f"pymeasure {kind.__name__}", lambda: device.adapter.connection.query("SYST:ERR?"))


def multimeters() -> None:
    """Agilent34410A's figures, HP34401A's functions."""
    meter, calls = opened(Agilent34410A, "voltmeter")
    rms = TRUTH["amplitude"] / 2.0**0.5
    calls.make("voltage_ac", lambda: meter.voltage_ac, rms)
    calls.make("voltage_dc", lambda: meter.voltage_dc, lambda value: abs(value) < TRUTH["amplitude"])
    # The shaft turns: what the ohmmeter makes of the EMF is no resistance.
    for name in ("resistance", "resistance_4w"):
        calls.make(name, lambda name=name: getattr(meter, name), lambda value: value == 9.9e37)
    for name in ("current_dc", "current_ac"):
        calls.make(name, lambda name=name: getattr(meter, name), 0.0)
    every(calls, meter, skip=properties(Agilent34410A))
    meter, calls = opened(HP34401A, "voltmeter")
    for function in HP34401A.FUNCTIONS:
        calls.make(f"function_ = {function}", lambda function=function: setattr(meter, "function_", function))
        counted = () if function in ("FREQ", "PERIOD") else ("gate_time",)
        common = () if function == "DCV" else _COMMON
        every(calls, meter, f"{function}.", skip=(*_OLD, *counted, *common, "function_"))
        meter.write("*RST;*CLS")
    meter.function_ = "FREQ"
    calls.make("FREQ.reading", lambda: meter.reading, TRUTH["frequency"])
    meter.function_ = "PERIOD"
    calls.make("PERIOD.reading", lambda: meter.reading, 1.0 / TRUTH["frequency"])
    meter.write("*RST")


def bridge() -> None:
    """AgilentE4980: settings, figures of every mode, a sweep."""
    hands("hold_shaft")
    meter, calls = opened(AgilentE4980, "lcr_meter")
    every(calls, meter)
    meter.write("TRIG:SOUR INT")
    for mode in ("LSRS", "RX", "ZTD", "CPD", "LPQ", "GB", "YTR"):
        calls.make(f"mode = {mode}", lambda mode=mode: setattr(meter, "mode", mode))
        resistance = {"LSRS": 1, "RX": 0}.get(mode, -1)
        calls.make(
            f"impedance, {mode}",
            lambda: meter.impedance,
            lambda value, place=resistance: place < 0 or abs(value[place] - TRUTH["resistance"]) < 0.02,
        )
    calls.make("aperture('LONG', 2)", lambda: meter.aperture("LONG", 2))
    calls.make("aperture()", lambda: meter.aperture(), lambda value: value == ("LONG", 2))
    calls.make("freq_sweep", lambda: meter.freq_sweep([100.0, 1e3, 1e4], True), lambda got: got[2] == [100.0, 1e3, 1e4])


def supply() -> None:
    """KeysightE36312A: every channel's properties."""
    device, calls = opened(KeysightE36312A, "supply")
    every(calls, device)
    for number in (1, 2, 3):
        every(calls, device.channels[number], f"ch_{number}.", skip=("insert_id",))
    device.ch_1.voltage_setpoint, device.ch_1.output_enabled = 2.0, True
    calls.make("ch_1.voltage after setting 2 V", lambda: device.ch_1.voltage, 2.0)
    device.ch_1.output_enabled = False


def oscilloscope() -> None:
    """KeysightDSOX1102G: every property, both channels' dictionaries, data, screenshot and set-up."""
    # It reads a picture byte by byte until nothing comes any more; over HiSLIP PyVISA-py never says that nothing comes.
    scope, calls = opened(KeysightDSOX1102G, "oscilloscope", "socket")
    for line in (":CHAN1:SCAL 4", ":CHAN2:DISP ON;SCAL 4", ":TIM:RANG 0.1", ":TRIG:LEV 0"):
        scope.write(line)
    every(calls, scope, skip=("_digitize", "waveform_data", "waveform_preamble", "system_setup"))
    for number, channel in ((1, scope.ch1), (2, scope.ch2)):
        every(calls, channel, f"ch{number}.", skip=("current_configuration",))
        calls.make(
            f"ch{number}.current_configuration",
            lambda channel=channel: channel.current_configuration,
            lambda found, number=number: found["CHAN"] == number and found["RANG"] == 32.0,
        )
    calls.make("timebase", lambda: scope.timebase, lambda found: found["MAIN:RANG"] == 0.1)
    calls.make("digitize('channel1')", lambda: scope.digitize("channel1"))
    calls.make(
        "download_data('channel1', 2000)",
        lambda: scope.download_data("channel1", 2000),
        lambda found: len(found[0]) == found[1]["points"] and abs(max(found[0]) / TRUTH["amplitude"] - 1.0) < 0.05,
    )
    calls.make("download_image()", lambda: scope.download_image(), lambda found: found[:4] == b"\x89PNG")
    setup = calls.make("system_setup", lambda: scope.system_setup)
    calls.make("system_setup = …", lambda: setattr(scope, "system_setup", setup))
    for name in ("run", "stop", "single", "autoscale", "default_setup", "factory_reset", "clear_status"):
        calls.make(f"{name}()", getattr(scope, name))


multimeters()
oscilloscope()
supply()
bridge()
