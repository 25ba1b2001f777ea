"""Our drivers with the options that they are checked with, and the state in which a predecessor may have left each."""

from collections.abc import Mapping, Sequence
from dataclasses import replace
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import Any

from bench.plugins.catalogues import Catalogues, installed
from bench.plugins.files import load_file
from bench.testing.conformance.manual import Manual, Model
from drivers.bases.oscilloscope_data import Probe
from drivers.interfaces import Accuracy, IdentityError, InstrumentError, ProbeKind, SetpointError
from drivers.keysight.options import ImpedanceCalibration
from sim_instruments.instruments.cia402.catalogue import VELOCITY_INVERTER
from sim_instruments.world.fixture.layout import crosspoints
from tests.bench.plugins.how_to_pages import OSCILLOSCOPE, PROBES, codes, left
from tests.bench.testing.conformance.own_cia402_manuals import (
    CIA402_INVERTER,
    CIA402_SIX_STEP,
    INVERTER,
    INVERTER_VARIANTS,
    ROTOR,
    SIX_STEP,
)
from tests.bench.testing.conformance.own_cia402_models import INVERTER_MODELS, SIX_STEP_MODELS
from tests.bench.testing.conformance.own_delta_manual import (
    DELTA,
    DELTA_BY_COMMAND,
    DELTA_BY_POWER,
    DELTA_SMALL,
    POWER_STATED,
)
from tests.bench.testing.conformance.own_found_states import LACKS, LEFT
from tests.bench.testing.conformance.own_gwinstek_manual import GPT9800, GPT9800_SLOW
from tests.bench.testing.conformance.own_keysight_manuals import (
    DMM_34461A,
    E4980A,
    E4980A_CALIBRATED,
    INFINIIVISION,
    SWITCH_UNIT_34970A,
)
from tests.bench.testing.conformance.own_lutron_manual import LUTRON
from tests.bench.testing.conformance.own_moteus_manual import MOTEUS
from tests.bench.testing.conformance.own_supply_manuals import E36300, SCPI_SUPPLY

VOLTAGE, CURRENT = Probe(ProbeKind.VOLTAGE, 10.0), Probe(ProbeKind.CURRENT, 10.0)
_POINT = Accuracy(gain=1e-3, source="calibration")
OPTIONS: Mapping[str, Mapping[str, Any]] = {
    "keysight-e36300": {"channel": 1},
    "keysight-e4980a": {
        "temperature_factor": 2.0,
        "calibration": (ImpedanceCalibration(4000.0, resistance=_POINT, inductance=_POINT),),
    },
    "keysight-34461a": {},
    "keysight-infiniivision": {"probes": {1: VOLTAGE, 2: VOLTAGE, 4: CURRENT}},
    "delta-dyn200": {"maximum_speed": 500.0, "watchdog_time": 0.0},
    "lutron-tachometer": {},
    "cia402-inverter": CIA402_INVERTER,
    "cia402-six-step": CIA402_SIX_STEP,
    "keysight-34970a": {"crosspoints": crosspoints()},
    "cia402-rotor-actuator": {"maximum_speed": 30.0, "heartbeat_time": 0.0},
    "gwinstek-gpt9800": {},
    "mjbots-moteus": {"maximum_current": 20.0},
    "scpi-supply": {"maximum_voltage": 30.0, "maximum_current": 5.0},
}


#: A make of the how-to pages, a second one of a base of ours.
OF_HOW_TO: Mapping[str, Mapping[str, Any]] = {"rigol-ds1000z": {"probes": PROBES}}


def catalogues_of(name: str) -> Catalogues:
    """Return where a driver and its simulated instrument are found, those of the how-to pages loaded anew."""
    if name not in OF_HOW_TO:
        return installed()
    with TemporaryDirectory() as folder:
        files = []
        for page in ("add-a-driver.md", "add-a-simulated-instrument.md"):
            for file, code in codes(page).items():
                if file in OSCILLOSCOPE:
                    path = Path(folder, file)
                    path.write_text(code, encoding="utf-8")
                    files.append(load_file(path, str(path)))
        return installed().with_files(files)


def driver_named(name: str) -> Any:
    """Return what a driver is checked by: its name, or for `scpi-supply` a make that is data only, of the base as it is now."""
    if name != "scpi-supply":
        return name
    from drivers.bases.scpi_supply import ScpiSupplyModel, SupplyData

    volts, amperes = (Accuracy(gain=5e-4, offset=each, source="manual") for each in (1e-2, 5e-3))
    data = SupplyData(32.0, 6.0, 33.0, volts, amperes)
    return ScpiSupplyModel(("motorbench",), ("GENERIC SUPPLY",), data).driver(name, simulated="generic-supply")


def _messages(*messages: str) -> Any:
    """Return what sends messages to a simulated SCPI instrument, as somebody before us may have."""

    def send(simulated: Any) -> None:
        for message in (*messages, "*CLS"):
            simulated.write(message.encode() + b"\n")

    return send


def _stopping_by_ramp(simulated: Any) -> None:
    simulated.units[1].write(0x0016, [0])


def _objects(values: Mapping[int, int]) -> Any:
    """Return what writes objects of a simulated drive, as a master before us may have."""

    def write(simulated: Any) -> None:
        for index, value in values.items():
            simulated.write(index, value)

    return write


def _configured(items: Mapping[str, float]) -> Any:
    """Return what sets up a simulated moteus, and leaves half a line on its diagnostic stream."""

    def configure(simulated: Any) -> None:
        for name, value in items.items():
            simulated.configuration.put(name, value)
        simulated._console.take(b"tel get servo_st")

    return configure


FOUND: Mapping[str, Any] = {
    "keysight-e4980a": _messages("FUNC:IMP CPD", "TRIG:SOUR INT", "FORM REAL", "FUNC:IMP:RANG:AUTO OFF", "BIAS:STAT ON"),
    "keysight-34461a": _messages("CONF:VOLT:AC", "TRIG:SOUR BUS"),
    "keysight-infiniivision": _messages(
        ":CHAN1:DISP OFF", ":CHAN1:COUP AC", ":CHAN1:UNIT AMP", ":CHAN1:PROB 1", ":TIM:REF LEFT", ":ACQ:TYPE AVER",
        ":WAV:FORM BYTE", ":WAV:UNS OFF", ":WAV:BYT MSBF", ":TRIG:MODE GLIT", ":WAV:POIN:MODE NORM", ":TIM:MODE ROLL",
    ),
    "keysight-e36300": _messages(
        "VOLT 1,(@1)", "VOLT:PROT 2,(@1)", "CURR:PROT:STAT OFF,(@1)", "CURR:PROT:DEL 0.2,(@1)", "VOLT 3,(@2)", "OUTP ON,(@2)"
    ),
    "rigol-ds1000z": left,
    "keysight-34970a": _messages("ROUT:CLOS (@111,122)"),
    "gwinstek-gpt9800": _messages("MAIN:FUNC MANU", "MANU:EDIT:MODE DCW"),
    "delta-dyn200": _stopping_by_ramp,
    "cia402-inverter": _objects({0x6071: 900, 0x60FF: 4000}),
    "cia402-rotor-actuator": _objects({0x60FF: 200_000}),
    "mjbots-moteus": _configured(
        {
            "servo.enable_motor_temperature": 1.0,
            "servo.fw.enable": 1.0, "servo.max_current_A": 100.0, "servopos.position_min": -0.01, "servopos.position_max": 0.01,
        }
    ),
}  # fmt: skip

_REFUSED: Mapping[str, Sequence[tuple[Mapping[str, Any], Any]]] = {
    "keysight-e36300": (
        ({"channel": 4}, IdentityError),
        ({"over_current_delay": 0.2551}, SetpointError),
        ({"over_current_delay": -0.1}, SetpointError),
    ),
    "keysight-34461a": (({"calibration": {5.0: Accuracy(gain=1e-4)}}, IdentityError),),
    "keysight-infiniivision": tuple(
        ({"probes": {1: Probe(ProbeKind.VOLTAGE, attenuation)}}, SetpointError) for attenuation in (1e5, 1.01e4, 0.99e-3)
    ),
    "keysight-34970a": (
        *(
            ({"crosspoints": crosspoints}, ValueError)
            for crosspoints in (
                {"A:supply+": 99}, {"A:supply+": 10_000}, {"A:supply+": 111, "A:supply-": 111}, {"D:supply+": 111},
            )
        ),
        ({"crosspoints": {"A:supply+": 1101}}, IdentityError),
        ({"crosspoints": {"A:supply+": 911}}, InstrumentError),
        ({"fixed": ("D:channel1~",)}, ValueError),
        ({"fixed": ("A:supply+",)}, ValueError),
    ),
    "gwinstek-gpt9800": (({"ramp_time": 0.05}, SetpointError), ({"ramp_time": 1000.0}, SetpointError)),
}  # fmt: skip

_MODELS: Mapping[str, Sequence[Model]] = {
    "cia402-inverter": INVERTER_MODELS,
    "cia402-six-step": SIX_STEP_MODELS,
}


_MANUALS: Mapping[str, Manual] = {
    "keysight-e36300": E36300,
    "keysight-e4980a": E4980A,
    "keysight-34461a": DMM_34461A,
    "keysight-infiniivision": INFINIIVISION,
    "lutron-tachometer": LUTRON,
    "delta-dyn200": DELTA,
    "cia402-inverter": INVERTER,
    "cia402-six-step": SIX_STEP,
    "cia402-rotor-actuator": ROTOR,
    "gwinstek-gpt9800": GPT9800,
    "keysight-34970a": SWITCH_UNIT_34970A,
    "scpi-supply": SCPI_SUPPLY,
    "mjbots-moteus": MOTEUS,
}


def manual_of(name: str) -> Manual:
    """Return what the manual states of a driver's instrument, and the options that it must refuse."""
    refused = (Model(options=options, error=error) for options, error in _REFUSED.get(name, ()))
    stated = _MANUALS.get(name, Manual())
    models = (*stated.models, *refused, *_MODELS.get(name, ()))
    return replace(stated, models=models, left=LEFT.get(name, ()), lacks=LACKS.get(name))


#: Other options with which each is used as well.
VARIANTS: Mapping[str, Sequence[Mapping[str, Any]]] = {
    "keysight-e36300": ({"over_voltage_margin": 0.2, "over_voltage_headroom": 0.3},),
    "keysight-e4980a": (
        {"calibration": (ImpedanceCalibration(1000.0, resistance=_POINT),)},
        {"calibration": (ImpedanceCalibration(1000.0, resistance=_POINT, inductance=_POINT),)},
        *E4980A_CALIBRATED,
    ),
    "keysight-34461a": ({"calibration": {10.0: _POINT}},),
    "keysight-infiniivision": ({"calibration": {1: Accuracy(gain=0.02, offset=0.1, source="calibration")}},),
    "lutron-tachometer": ({"update_period": 0.5, "manual": Manual(port={"timeout": 1.0})},),
    "keysight-34970a": ({"crosspoints": {}}, {"fixed": ("A:channel4~", "A:voltmeter+")}),
    "delta-dyn200": (
        {"direction_from": "command"},
        DELTA_BY_COMMAND,
        DELTA_BY_POWER,
        DELTA_SMALL,
        POWER_STATED,
        {"watchdog_time": 2.0},
        # A ramp that takes longer than the patience, and comes nearer all the time.
        {"settle_timeout": 0.3},
    ),
    "cia402-inverter": (
        {"heartbeat_time": 1.0},
        {"process_data": True},
        # Velocity mode and cyclic torque, read one by one and by process data.
        *({"simulated": VELOCITY_INVERTER, "process_data": by_pdo, "pole_pairs": 2} for by_pdo in (False, True)),
        *INVERTER_VARIANTS,
    ),
    "cia402-six-step": ({"heartbeat_time": 1.0}, {"process_data": True}),
    "cia402-rotor-actuator": ({"increments_per_turn": 65_536}, {"heartbeat_time": 1.0}, {"timeout": 0.3}),
    "gwinstek-gpt9800": ({"ramp_time": 0.5}, GPT9800_SLOW),
    "mjbots-moteus": (
        {"pole_pairs": 4},
        {"maximum_voltage": 50.0},
        {"sample_interval": 0.002},
        {"current_tolerance": 0.1},
    ),
}
