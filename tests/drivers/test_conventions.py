"""What holds for every driver: docstrings of one style, and the interface of its kind."""

import importlib
import inspect
import pkgutil
import re
from collections.abc import Iterator
from dataclasses import fields, is_dataclass
from typing import Any, Protocol

import pytest

import drivers
from bench.plugins.catalogues import installed
from drivers.interfaces import (
    BldcDrive,
    Dynamometer,
    Instrument,
    InsulationTester,
    Inverter,
    LcrMeter,
    Oscilloscope,
    RotorActuator,
    Supply,
    SwitchMatrix,
    Tachometer,
    Voltmeter,
)

DRIVERS = [driver for drivers in installed().drivers.values() for driver in drivers]

MODULES = sorted(module.name for module in pkgutil.walk_packages(drivers.__path__, "drivers."))

KINDS: dict[str, tuple[str, tuple[type, ...]]] = {
    "drivers.keysight.e36300.KeysightE36300": ("supply", (Supply,)),
    "drivers.keysight.e4980a.KeysightE4980A": ("lcr_meter", (LcrMeter,)),
    "drivers.keysight.infiniivision.KeysightInfiniiVision": ("oscilloscope", (Oscilloscope,)),
    "drivers.delta.dynamometer.DeltaDyn200": ("dynamometer", (Dynamometer,)),
    "drivers.lutron.tachometer.LutronTachometer": ("tachometer", (Tachometer,)),
    "drivers.cia402.inverter.Cia402Inverter": ("inverter", (Inverter,)),
    "drivers.cia402.six_step.Cia402SixStep": ("drive", (BldcDrive,)),
    "drivers.keysight.dmm_34461a.Keysight34461A": ("voltmeter", (Voltmeter,)),
    "drivers.keysight.switch_unit_34970a.Keysight34970A": ("switch_matrix", (SwitchMatrix,)),
    "drivers.gwinstek.gpt9800.GwInstekGpt9800": ("insulation_tester", (InsulationTester,)),
    "drivers.cia402.rotor_actuator.Cia402RotorActuator": ("rotor_actuator", (RotorActuator,)),
    "drivers.mjbots.inverter.MjbotsMoteus": ("inverter", (Inverter,)),
    "drivers.manual.supply.ManualSupply": ("supply", (Supply,)),
    "drivers.manual.lcr_meter.ManualLcrMeter": ("lcr_meter", (LcrMeter,)),
    "drivers.manual.oscilloscope.ManualOscilloscope": ("oscilloscope", (Oscilloscope,)),
    "bench.captures.oscilloscope.CaptureFilesOscilloscope": ("oscilloscope", (Oscilloscope,)),
    "drivers.manual.dynamometer.ManualDynamometer": ("dynamometer", (Dynamometer,)),
    "drivers.manual.tachometer.ManualTachometer": ("tachometer", (Tachometer,)),
    "drivers.manual.inverter.ManualInverter": ("inverter", (Inverter,)),
    "drivers.manual.drive.ManualDrive": ("drive", (BldcDrive,)),
    "drivers.manual.voltmeter.ManualVoltmeter": ("voltmeter", (Voltmeter,)),
}


def found(path: str) -> Any:
    module, _, name = path.rpartition(".")
    return getattr(importlib.import_module(module), name)


def public(module_name: str) -> Iterator[tuple[str, Any]]:
    module = importlib.import_module(module_name)
    yield module_name, module
    for name, member in vars(module).items():
        if name.startswith("_") or getattr(member, "__module__", None) != module_name:
            continue
        yield f"{module_name}.{name}", member
        if inspect.isclass(member):
            for method_name, method in vars(member).items():
                target = method.fget if isinstance(method, property) else method
                if not method_name.startswith("_") and inspect.isfunction(target):
                    yield f"{module_name}.{name}.{method_name}", target


@pytest.mark.parametrize("module_name", MODULES)
def test_docstrings_begin_with_one_plain_sentence(module_name: str) -> None:
    wrong = []
    for path, member in public(module_name):
        if not (inspect.ismodule(member) or inspect.isclass(member) or inspect.isfunction(member)):
            continue
        text = inspect.cleandoc(member.__doc__ or "")
        first = re.split(r"(?<=\.)\s", text.replace("\n", " "))[0]
        if not text or (not first[0].isupper() and not first.startswith("`")) or not re.search(r"[.)]$|\.$", first):
            wrong.append(path)
    assert wrong == []


@pytest.mark.parametrize("path", KINDS)
def test_every_driver_has_its_whole_interface(path: str) -> None:
    driver = found(path)
    for kind in (Instrument, *KINDS[path][1]):
        for name, wanted in inspect.getmembers(kind, lambda member: inspect.isfunction(member)):
            if name.startswith("_"):
                continue
            own = inspect.signature(getattr(driver, name))
            assert list(own.parameters) == list(inspect.signature(wanted).parameters), f"{path}.{name}"
        for name, _ in inspect.getmembers(kind, lambda member: isinstance(member, property)):
            assert isinstance(inspect.getattr_static(driver, name), property), f"{path}.{name}"


def test_every_registered_driver_is_checked_here() -> None:
    assert sorted(role for role, _ in KINDS.values()) == sorted(driver.role.value for driver in DRIVERS)


@pytest.mark.parametrize("path", KINDS)
def test_every_driver_takes_a_clock_and_a_name(path: str) -> None:
    parameters = inspect.signature(found(path).__init__).parameters
    assert "clock" in parameters
    assert parameters["name"].default == KINDS[path][0]
    assert "options" in parameters


def test_options_are_frozen_dataclasses_with_every_field_explained() -> None:
    for driver in DRIVERS:
        options = driver.options
        assert is_dataclass(options)
        assert options.__dataclass_params__.frozen
        assert fields(options)


def test_interfaces_are_protocols() -> None:
    assert all(Protocol in kind.__mro__ for _, kinds in KINDS.values() for kind in kinds)
