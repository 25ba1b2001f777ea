"""A supply whose commands are data: what is sent, its protections, and off."""

from collections.abc import Iterator
from typing import Any

import pytest
from pyvisa import ResourceManager

from bench.motor.motor_file import load_motor
from drivers.bases.scpi_supply import ScpiSupply, ScpiSupplyModel, ScpiSupplyOptions, SupplyCommands, SupplyData
from drivers.catalogue import Surroundings
from drivers.interfaces import Accuracy, OutputMode, Regulated, ReportedError, SetpointError
from sim_instruments.bench import VirtualBench
from sim_instruments.catalogue import SimulatedUnit
from sim_instruments.instruments.scpi_supply import SupplyHeaders, SupplyRating, simulated_supply

METER = Accuracy(offset=5e-3, source="manual")
MODEL = ScpiSupplyModel(("Acme",), ("PS303",), SupplyData(30.0, 3.0, 33.0, METER, METER))
SIMULATED = simulated_supply("acme", "Acme,PS303,4711,1.0", SupplyRating(30.0, 3.0, 33.0))


@pytest.fixture
def bench() -> Iterator[VirtualBench]:
    with VirtualBench(load_motor("lg-400w").virtual_motor(), [SimulatedUnit(SIMULATED)], sockets=False) as made:
        made.world.connect({"A": "supply+", "B": "supply-"})
        made.world.lock_rotor()
        yield made


def opened(bench: VirtualBench, traffic: list[str] | None = None, **options: Any) -> ScpiSupply:
    heard = None if traffic is None else lambda direction, text: traffic.append(text) if direction == "write" else None
    surroundings = Surroundings(bench.clock, lambda: ResourceManager(bench.visa_library), traffic=heard)
    made = MODEL.driver("acme").open(str(bench.address("supply")), ScpiSupplyOptions(**options), surroundings)
    assert isinstance(made, ScpiSupply)
    return made


def test_the_messages_of_a_block(bench: VirtualBench) -> None:
    sent: list[str] = []
    supply = opened(bench, sent)
    sent.clear()
    with supply.energised(2.0, 1.5, Regulated.CURRENT):
        assert bench.world.supply.is_on
        bench.clock.sleep(0.5)
        assert supply.output_mode() is OutputMode.CONSTANT_CURRENT
        assert supply.measure_current().value == pytest.approx(1.5, abs=0.01)
    assert not bench.world.supply.is_on
    said = [line for line in sent if line != "SYST:ERR?"]
    assert said[:9] == [
        "CURR:PROT:TRIP?", "VOLT:PROT:TRIP?", "VOLT?", "CURR:PROT:STAT OFF", "CURR 1.5", "VOLT:PROT 2.7", "VOLT 2",
        "CURR?", "VOLT:PROT?",
    ]  # fmt: skip
    assert said[said.index("OUTP OFF") + 1] == "OUTP?"
    supply.close()


def test_over_current_protection_trips_and_is_told(bench: VirtualBench) -> None:
    supply = opened(bench)
    with (
        pytest.raises(ReportedError, match="over-current protection switched the output off"),
        supply.energised(5.0, 0.5),
    ):
        bench.clock.sleep(1.0)
    assert supply.output_mode() is OutputMode.OFF
    supply.close()


def test_the_lesser_limit_holds_before_anything_is_sent(bench: VirtualBench) -> None:
    sent: list[str] = []
    supply = opened(bench, sent, maximum_voltage=12.0)
    assert (supply.maximum_voltage, supply.maximum_current) == (12.0, 3.0)
    sent.clear()
    with pytest.raises(SetpointError, match="12 V"):
        supply.configure(13.0, 1.0)
    assert sent == []
    supply.close()


def test_a_supply_without_protections_is_asked_for_none(bench: VirtualBench) -> None:
    commands = SupplyCommands(
        over_voltage="", over_current="", over_voltage_tripped="", over_current_tripped="", clear=""
    )
    plain = ScpiSupplyModel(MODEL.makers, MODEL.models, MODEL.data, commands)
    sent: list[str] = []
    surroundings = Surroundings(
        bench.clock, lambda: ResourceManager(bench.visa_library), traffic=lambda _, text: sent.append(text)
    )
    supply = plain.open(str(bench.address("supply")), ScpiSupplyOptions(), surroundings, "supply")
    with supply.energised(1.0, 1.0):
        pass
    supply._clear_protection()
    assert not [line for line in sent if "PROT" in line]
    supply.close()


def test_the_front_panel_is_taken_on_opening_and_given_back_by_closing() -> None:
    headers = SupplyHeaders(remote="SYSTem:REMote", local="SYSTem:LOCal")
    unit = SimulatedUnit(simulated_supply("acme", "Acme,PS303,4711,1.0", SupplyRating(30.0, 3.0, 33.0), headers))
    with VirtualBench(load_motor("lg-400w").virtual_motor(), [unit], sockets=False) as bench:

        def taken(guarding: bool = False, **words: str) -> ScpiSupply:
            model = ScpiSupplyModel(MODEL.makers, MODEL.models, MODEL.data, SupplyCommands(**words))
            surroundings = Surroundings(bench.clock, lambda: ResourceManager(bench.visa_library), guarding=guarding)
            return model.open(str(bench.address("supply")), ScpiSupplyOptions(), surroundings, "supply")

        with pytest.raises(ReportedError, match="-203"):
            taken().configure(1.0, 1.0)
        used = taken(remote="SYST:REM", local="SYST:LOC")
        guardian = taken(guarding=True, remote="SYST:REM", local="SYST:LOC")
        # What a guardian leaves is still the run's.
        guardian.make_safe()
        guardian.close()
        used.configure(1.0, 1.0)
        used.close()
        with pytest.raises(ReportedError, match="-203"):
            taken().configure(1.0, 1.0)


def test_an_output_that_stays_on_is_told(bench: VirtualBench) -> None:
    supply = opened(bench)
    with pytest.raises(ReportedError, match="the output is still on"), supply.energised(1.0, 1.0, Regulated.CURRENT):
        bench.world.damage.stick("supply", "on")
    bench.world.damage.stick("supply", None)
    supply.output_off()
    supply.close()
