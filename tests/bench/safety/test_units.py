"""A reading in another unit than its interface declares is not used, whatever it is wrapped in."""

from dataclasses import replace
from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest

from bench.safety.limits.bounds import Limit, Limits
from bench.safety.limits.guard import guarded
from bench.safety.shutdown_items import measured
from bench.station.shutdown_sequence import Item, ShutdownAction
from drivers.interfaces import Accuracy, InstrumentError, Reading, Role, Waveform
from drivers.interfaces.declarations import Effect, Quantity, declarations
from drivers.interfaces.insulation_tester import InsulationReading
from drivers.interfaces.text import Text

#: All that is declared to give a Reading or Waveform.
GIVEN = [(role, name, one) for role in Role for name, one in declarations(role.interface).items() if one.unit]
LOOSE = Limits(
    set_points={Quantity.INSULATION_VOLTAGE: Limit(1000.0, Text("somebody"))},
    readings={quantity: Limit(1.0, Text("somebody")) for quantity in Quantity},
)


def reading(unit: str, value: float = 0.5) -> Reading:
    return Reading(value, unit, Accuracy(), 0.0)


def wave(unit: str, channel: int = 1) -> Waveform:
    return Waveform(channel, np.arange(3.0), np.arange(3.0), unit, 0.1)


def behind(role: Role, name: str, result: Any) -> Any:
    instrument: Any = SimpleNamespace(**{name: lambda *_, **__: result}, maximum_voltage=1000.0)
    return getattr(guarded(role, instrument, f"the {role.value}", LOOSE, driver="milli"), name)


def arguments_of(role: Role, name: str) -> tuple[Any, ...]:
    return (500.0, 1.0) if (role, name) == (Role.INSULATION_TESTER, "measure") else ()


@pytest.mark.parametrize(("role", "name", "declared"), GIVEN, ids=lambda one: getattr(one, "value", str(one))[:30])
def test_every_declared_unit_is_demanded(role: Role, name: str, declared: Any) -> None:
    arguments = arguments_of(role, name)
    for unit in declared.unit.split("|"):
        right = reading(unit)
        assert behind(role, name, right)(*arguments) is right
        # Beyond the limit as well: what is said is the unit, for the number means nothing.
        with pytest.raises(InstrumentError) as caught:
            behind(role, name, reading(f"m{unit}", 500.0))(*arguments)
        said = str(caught.value)
        assert type(caught.value) is InstrumentError
        for word in (f"the {role.value}", "milli", name, f"'m{unit}'", unit, "convert"):
            assert word in said


def test_whatever_returns_readings_declares_their_unit() -> None:
    for role in Role:
        for name, one in declarations(role.interface).items():
            member = getattr(role.interface, name)
            returned = str(getattr(member, "__annotations__", {}).get("return", ""))
            if one.effect in (Effect.READING, Effect.ENERGISES) and any(
                kind in returned for kind in ("interfaces.identity.Reading", "Waveform", "InsulationReading")
            ):
                assert one.unit, (role, name)
    assert {(role.value, name) for role, name, _ in GIVEN} >= {
        ("insulation_tester", "measure"),
        ("oscilloscope", "fetch"),
    }


@pytest.mark.parametrize("wrap", [lambda one: one, lambda one: {1: wave("V"), 2: one}, lambda one: (wave("A"), [one])])
def test_waveforms_within_mappings_and_sequences(wrap: Any) -> None:
    for unit in ("V", "A"):
        behind(Role.OSCILLOSCOPE, "fetch", wrap(wave(unit, 2)))([1, 2], 1.0)
    with pytest.raises(InstrumentError, match="'mV', declared is V / A"):
        behind(Role.OSCILLOSCOPE, "fetch", wrap(wave("mV", 2)))([1, 2], 1.0)


def test_a_reading_within_a_dataclass() -> None:
    found = InsulationReading(reading("Ω", 1e9), 500.0, beyond_range=False)
    assert behind(Role.INSULATION_TESTER, "measure", found)(500.0, 1.0) is found
    with pytest.raises(InstrumentError, match="'MΩ'"):
        behind(Role.INSULATION_TESTER, "measure", replace(found, resistance=reading("MΩ", 1e3)))(500.0, 1.0)


def test_the_shutdown_does_not_take_kilovolts_for_volts() -> None:
    item = Item(ShutdownAction.VOLTAGE_DECAYED, Role.SUPPLY, below=60.0, within=1.0)
    assert measured(item, SimpleNamespace(measure_voltage=lambda: reading("V", 0.4))).value == 0.4
    with pytest.raises(InstrumentError, match="'kV'"):
        measured(item, SimpleNamespace(measure_voltage=lambda: reading("kV", 0.4)))
