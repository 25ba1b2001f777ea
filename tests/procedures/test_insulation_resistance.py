"""The insulation test: its voltage is the motor's or none, and nothing else is on the terminals meanwhile."""

from collections.abc import Sequence
from dataclasses import dataclass, field
from typing import Any

import pytest

from drivers.interfaces import Accuracy, Identity, InsulationReading, MeasurementError, Reading
from procedures.core.actions import ConnectProbes, HandWork
from procedures.core.bench import Bench, ProcedureError, Role
from procedures.core.nameplate import Nameplate, WindingConnection
from procedures.core.setup import LeadContact
from procedures.core.setup_change import ChangeKind
from procedures.end_of_line.insulation_resistance import InsulationResistance, InsulationResistanceSettings
from sim_instruments.clock.virtual_clock import VirtualClock
from tests.studies.worlds.measured_motor import NoRecord

ACCURACY = Accuracy(gain=0.05, offset=1e6, source="fake tester")


@dataclass
class Megohmmeter:
    """An insulation tester before a winding of a resistance (Ω); `done` keeps what was done, and in which order."""

    resistance: float
    done: list[Any]
    largest: float = 9.999e9
    maximum_voltage: float = 1000.0
    broken: bool = False
    identity: Identity = field(default_factory=lambda: Identity("Fake", "T"))

    def measure(self, voltage: float, duration: float) -> InsulationReading:
        self.done.append((voltage, duration))
        if self.broken:
            raise MeasurementError("insulation_tester", "the test reached 40 V of 500 V")
        shown = min(self.resistance, self.largest)
        reading = Reading(shown, "Ω", ACCURACY, 0.0)
        return InsulationReading(reading, voltage, self.resistance > self.largest)


@dataclass
class Hands:
    done: list[Any]

    def perform(self, action: HandWork) -> None:
        self.done.append(action)


def plate(**changed: Any) -> Nameplate:
    return Nameplate(
        "M", WindingConnection.WYE, 10.0, **{"rated_voltage": 48.0, "insulation_test_voltage": 500.0, **changed}
    )


def run(tester: Megohmmeter, nameplate: Nameplate, *, beside: Sequence[Role] = (), **settings: Any) -> Any:
    instruments: dict[Role, Any] = {Role.INSULATION_TESTER: tester, **{role: object() for role in beside}}
    bench = Bench(instruments, Hands(tester.done), VirtualClock(), NoRecord())
    return InsulationResistance(bench, nameplate, InsulationResistanceSettings(**settings), {}).run()


def test_resistance_with_the_tester_s_own_error():
    tester = Megohmmeter(2.5e8, [])
    found = run(tester, plate(), duration=2.0).parameter("insulation_resistance")
    assert (found.value, found.unit) == (2.5e8, "Ω")
    assert found.standard_uncertainty == pytest.approx(((0.05 * 2.5e8) ** 2 + 1e12) ** 0.5 / 3**0.5)
    assert (500.0, 2.0) in tester.done


def test_all_terminals_and_nothing_else_and_open_afterwards():
    tester = Megohmmeter(1e9, [])
    run(tester, plate(), beside=(Role.OSCILLOSCOPE, Role.VOLTMETER))
    connected, _, parted = tester.done
    assert connected.after.contacts == tuple(LeadContact("insulation_high", terminal) for terminal in "ABC")
    assert connected.changes[0].kind is ChangeKind.CLEAR
    assert parted.after.known
    assert parted.after.contacts == ()


def test_beyond_the_range_it_is_at_least_the_largest():
    result = run(Megohmmeter(5e12, []), plate())
    found = result.parameter("insulation_resistance")
    assert found.value == 9.999e9
    assert "this or more" in found.estimator
    assert [notice.identifier for notice in result.warnings] == ["beyond-range"]
    assert result.findings["at_least"] is True


def test_a_damaged_insulation_is_a_figure_and_no_error():
    assert run(Megohmmeter(3e4, []), plate()).parameter("insulation_resistance").value == 3e4


@pytest.mark.parametrize(
    ("changed", "settings", "said"),
    [
        ({"insulation_test_voltage": None}, {}, ["no insulation_test_voltage", "IEEE 43 has 500 V"]),
        ({"insulation_test_voltage": None}, {"test_voltage": 500.0}, ["no insulation_test_voltage"]),
        ({}, {"test_voltage": 600.0}, ["600 V is above the motor's 500 V"]),
        ({"insulation_test_voltage": 2500.0}, {}, ["gives up to 1000 V, 2500 V are asked for"]),
    ],
)
def test_refused_before_anything_is_connected(changed, settings, said):
    tester = Megohmmeter(1e9, [])
    with pytest.raises(ProcedureError) as refused:
        run(tester, plate(**changed), **settings)
    for part in said:
        assert part in str(refused.value)
    assert tester.done == []


def test_what_will_be_refused_is_known_before_anything_runs():
    tester = Megohmmeter(1e9, [])
    bench = Bench({Role.INSULATION_TESTER: tester}, Hands(tester.done), VirtualClock(), NoRecord())
    settings = InsulationResistanceSettings()
    (told,) = InsulationResistance.check_capability(bench, plate(insulation_test_voltage=None), settings)
    assert told.identifier == "cannot-support"
    assert "insulation-resistance: the motor file gives no insulation_test_voltage" in str(told.message)
    assert InsulationResistance.check_capability(bench, plate(), settings) == ()


def test_no_advice_where_the_standard_gives_a_range():
    with pytest.raises(ProcedureError) as refused:
        run(Megohmmeter(1e9, []), plate(insulation_test_voltage=None, rated_voltage=3300.0))
    assert "IEEE" not in str(refused.value)


def test_no_hand_is_sent_to_a_winding_that_may_be_charged():
    tester = Megohmmeter(1e9, [], broken=True)
    with pytest.raises(MeasurementError):
        run(tester, plate())
    (connected, tested) = tester.done
    assert connected.after.source is Role.INSULATION_TESTER
    assert tested == (500.0, 1.0)


def test_probes_that_are_none_are_taken_off():
    assert str(ConnectProbes(()).lines({})[0]) == "Take the oscilloscope's probes off"
