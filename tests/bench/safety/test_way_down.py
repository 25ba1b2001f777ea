"""The shutdown: every item on its own, in order, measured, and never longer than it must be."""

import threading
from collections.abc import Iterator
from functools import partialmethod
from typing import Any

import pytest

from bench.journal.codec import data_of
from bench.safety.instrument_threads import InstrumentThreads
from bench.safety.shutdown import failures, shut_down
from bench.safety.shutdown_items import Measured, perform
from bench.station.shutdown_sequence import (
    OFF_BY,
    ROLES_OF,
    Item,
    ShutdownAction,
    ShutdownSequence,
    default_items,
    item,
)
from drivers.interfaces import Accuracy, CommunicationError, DynamometerReading, OverloadError, Reading, SetpointError
from procedures.core.bench import Role
from procedures.core.events import Event
from tests.bench.conftest import Clock


class Journal:
    def __init__(self) -> None:
        self.events: list[dict[str, Any]] = []

    def record(self, event: Event) -> None:
        assert event.kind == "made_safe"
        self.events.append(data_of(event))


class Instrument:
    """Does what every item asks; the call named `failing` raises, the one named `hanging` waits for `release`."""

    def __init__(self, name: str, calls: list[str], release: threading.Event) -> None:
        self.name = name
        self.calls = calls
        self.release = release
        self.failing = self.hanging = ""
        self.values: Iterator[float] = iter([])

    def _do(self, what: str) -> None:
        self.calls.append(f"{self.name}.{what}")
        if what == self.hanging:
            self.release.wait(20.0)
        if what == self.failing:
            raise CommunicationError(self.name, "no reply")

    def make_safe(self) -> None:
        self._do("make_safe")

    def output_off(self) -> None:
        self._do("output_off")

    def command_zero(self) -> None:
        self._do("command_zero")

    def stop(self) -> None:
        self._do("stop")

    def configure(self, full_scale: float) -> None:
        self._do("configure")

    def _reading(self, unit: str) -> Reading:
        self._do("measured")
        return Reading(next(self.values, 0.0), unit, Accuracy(), 0.0)

    measure_voltage = partialmethod(_reading, "V")
    measure_current = partialmethod(_reading, "A")
    measure_speed = partialmethod(_reading, "rad/s")
    measure_frequency = partialmethod(_reading, "Hz")

    def measure(self) -> DynamometerReading:
        return DynamometerReading(0.0, self._reading("rad/s").value, 0.0, 0.0, Accuracy(), Accuracy())


@pytest.fixture
def calls() -> list[str]:
    return []


@pytest.fixture
def release() -> Iterator[threading.Event]:
    event = threading.Event()
    yield event
    event.set()


@pytest.fixture
def instruments(calls: list[str], release: threading.Event) -> dict[Role, Any]:
    return {role: Instrument(role.value, calls, release) for role in Role}


USUAL = default_items()


def test_the_usual_list_reaches_every_role_and_every_source_of_energy() -> None:
    assert {one.role for one in USUAL} == set(Role)
    assert {(off, role) for role, off in OFF_BY.items()} <= {(one.do, one.role) for one in USUAL}
    # The high voltage first, and no contact parts before it is known that nothing flows.
    assert USUAL[0] == item(ShutdownAction.OUTPUT_OFF, Role.INSULATION_TESTER)
    order = [one.do for one in USUAL[1:]]
    do = ShutdownAction
    energy = [
        do.COMMAND_ZERO,
        do.DISABLE,
        do.OUTPUT_OFF,
        do.SILENCE,
        do.VOLTAGE_DECAYED,
        do.CURRENT_ZERO,
        do.SPEED_ZERO,
    ]
    assert order == sorted(order, key=[*energy, do.OPEN].index)


def test_a_person_is_asked_once_an_instrument() -> None:
    manual = default_items(Role)
    assert len(manual) == len(Role)
    assert {one.role for one in manual} == set(Role)


@pytest.mark.parametrize("failing", range(len(USUAL)))
def test_one_item_that_fails_does_not_stop_the_next(
    instruments: dict[Role, Any], calls: list[str], failing: int
) -> None:
    one = USUAL[failing]
    for what in ("command_zero", "make_safe", "output_off", "measured"):
        wanted = {ShutdownAction.COMMAND_ZERO: "command_zero", ShutdownAction.OUTPUT_OFF: "output_off"}.get(
            one.do, "make_safe"
        )
        if one.role is Role.INSULATION_TESTER:
            wanted = "make_safe"
        if what == ("measured" if one.measures else wanted):
            instruments[one.role].failing = what
    journal = Journal()
    outcomes = shut_down(ShutdownSequence(), instruments, journal, Clock())
    assert [outcome.item for outcome in outcomes] == list(USUAL)
    assert len(calls) == len(USUAL)
    failed = [outcome.item for outcome in outcomes if outcome.error]
    assert one in failed
    assert {bad.role for bad in failed} == {one.role}
    assert failures(outcomes)[0].startswith(f"{one.role.value} could not be made safe (")
    assert "no reply" in failures(outcomes)[0]
    assert [(e["instrument"], e["item"], e["outcome"] == "failed") for e in journal.events] == [
        (outcome.item.role.value, outcome.item.do.value, bool(outcome.error)) for outcome in outcomes
    ]


def test_what_is_measured_is_waited_for_and_stands_in_the_journal(instruments: dict[Role, Any]) -> None:
    instruments[Role.DYNAMOMETER].values = iter([-30.0, -8.0, -0.5])
    instruments[Role.SUPPLY].values = iter([12.0, 3.0, 0.9])
    clock, journal = Clock(), Journal()
    assert not failures(shut_down(ShutdownSequence(), instruments, journal, clock))
    assert clock.time == pytest.approx(0.2)
    found = {(e["instrument"], e["item"]): (e["value"], e["unit"]) for e in journal.events if "value" in e}
    assert found == {
        ("supply", "voltage_decayed"): (0.9, "V"),
        ("supply", "current_zero"): (0.0, "A"),
        ("dynamometer", "speed_zero"): (0.5, "rad/s"),
        ("drive", "speed_zero"): (0.0, "rad/s"),
        ("tachometer", "speed_zero"): (0.0, "rad/s"),
    }


@pytest.mark.parametrize(("widest", "asked"), [(100.0, 100.0), (60.0, 50.0), (4.0, 2.0), (1.0, 1.0)])
def test_a_voltmeter_is_read_in_the_widest_range_that_it_has(
    instruments: dict[Role, Any], widest: float, asked: float
) -> None:
    taken: list[float] = []

    def configure(full_scale: float) -> None:
        if full_scale > widest:
            raise SetpointError("voltmeter", "full scale", full_scale, "V", 0.0, widest, "the model")
        taken.append(full_scale)

    voltmeter = instruments[Role.VOLTMETER]
    voltmeter.configure, voltmeter.values = configure, iter([0.3])
    one = item(ShutdownAction.VOLTAGE_DECAYED, Role.VOLTMETER)
    assert perform(one, voltmeter, Clock(), threading.Event()) == Measured(0.3, "V")
    assert taken == [asked]


def test_more_than_the_range_holds_may_come_down_yet(instruments: dict[Role, Any]) -> None:
    voltmeter = instruments[Role.VOLTMETER]
    replies = iter([OverloadError("voltmeter", "overload")] * 3)

    def measure() -> Reading:
        for error in replies:
            raise error
        return Reading(0.2, "V", Accuracy(), 0.0)

    voltmeter.measure_voltage = measure
    one = item(ShutdownAction.VOLTAGE_DECAYED, Role.VOLTMETER)
    assert perform(one, voltmeter, Clock(), threading.Event()) == Measured(0.2, "V")
    voltmeter.measure_voltage = lambda: (_ for _ in ()).throw(OverloadError("voltmeter", "overload"))
    clock = Clock()
    with pytest.raises(OverloadError):
        perform(one, voltmeter, clock, threading.Event())
    assert clock.time == pytest.approx(one.within, abs=0.1)


@pytest.mark.parametrize(("do", "role", "unit"), [
    (ShutdownAction.VOLTAGE_DECAYED, Role.SUPPLY, "V"),
    (ShutdownAction.VOLTAGE_DECAYED, Role.VOLTMETER, "V"),
    (ShutdownAction.CURRENT_ZERO, Role.SUPPLY, "A"),
    (ShutdownAction.SPEED_ZERO, Role.DYNAMOMETER, "rad/s"),
    (ShutdownAction.SPEED_ZERO, Role.TACHOMETER, "rad/s"),
])  # fmt: skip
def test_what_does_not_come_about_is_a_failure_with_its_value(
    instruments: dict[Role, Any], do: ShutdownAction, role: Role, unit: str
) -> None:
    instruments[role].values = iter([40.0] * 1000)
    clock = Clock()
    (outcome,) = shut_down(ShutdownSequence((item(do, role, 2.0, 1.5),)), instruments, Journal(), clock)
    assert f"is 40 {unit} after 1.5 s; at most 2 {unit} is safe" in outcome.error
    assert outcome.found is not None
    assert (outcome.found.value, outcome.found.unit) == (40.0, unit)
    assert clock.time == pytest.approx(1.5, abs=0.1)


def test_nan_is_not_safe(instruments: dict[Role, Any]) -> None:
    instruments[Role.SUPPLY].values = iter([float("nan")] * 1000)
    (outcome,) = shut_down(
        ShutdownSequence((item(ShutdownAction.VOLTAGE_DECAYED, Role.SUPPLY, 2.0, 0.2),)),
        instruments,
        Journal(),
        Clock(),
    )
    assert "the voltage is nan" in outcome.error


def test_an_instrument_that_hangs_does_not_hold_up_the_others(
    instruments: dict[Role, Any], calls: list[str], release: threading.Event
) -> None:
    instruments[Role.INVERTER].hanging = "command_zero"
    instruments[Role.TACHOMETER].make_safe = release.set
    outcomes = shut_down(ShutdownSequence(), instruments, Journal(), Clock(), patience=0.05)
    assert not failures(outcomes)
    assert calls.index("supply.output_off") < calls.index("inverter.make_safe")
    assert calls.index("inverter.command_zero") < calls.index("inverter.make_safe")


def test_what_does_not_answer_is_commanded_last_and_contacts_part_after_it(
    instruments: dict[Role, Any], calls: list[str]
) -> None:
    shut_down(ShutdownSequence(), instruments, Journal(), Clock(), silent={Role.INVERTER, Role.SWITCH_MATRIX})
    first = calls.index("inverter.command_zero")
    assert calls[first + 1] == "inverter.make_safe"
    assert {"supply.output_off", "dynamometer.make_safe", "voltmeter.make_safe"} <= set(calls[:first])
    assert calls.index("supply.measured") > first
    assert calls[-1] == "switch_matrix.make_safe"
    # A brake is not asked whether it has braked before it was told to.
    calls.clear()
    brake = (
        item(ShutdownAction.BRAKE, Role.DYNAMOMETER),
        item(ShutdownAction.SPEED_ZERO, Role.DYNAMOMETER),
        item(ShutdownAction.OUTPUT_OFF, Role.SUPPLY),
    )
    shut_down(ShutdownSequence(brake), instruments, Journal(), Clock(), silent={Role.DYNAMOMETER})
    assert calls == ["supply.output_off", "dynamometer.stop", "dynamometer.measured"]


def test_what_is_not_wanted_any_more_is_left_out(instruments: dict[Role, Any], calls: list[str]) -> None:
    outcomes = shut_down(
        ShutdownSequence(), instruments, Journal(), Clock(), wanted=lambda one: one.role is Role.SUPPLY
    )
    assert {outcome.item.role for outcome in outcomes} == {Role.SUPPLY}
    assert {call.partition(".")[0] for call in calls} == {"supply"}


def test_two_walks_never_speak_to_one_instrument_at_once(
    instruments: dict[Role, Any], calls: list[str], release: threading.Event
) -> None:
    instruments[Role.INVERTER].hanging = "make_safe"
    threads = InstrumentThreads()
    way = ShutdownSequence((item(ShutdownAction.DISABLE, Role.INVERTER), item(ShutdownAction.OUTPUT_OFF, Role.SUPPLY)))

    def again() -> list[str]:
        outcomes = shut_down(way, instruments, Journal(), Clock(), patience=0.01, longest=0.05, threads=threads)
        return [one.item.role.value for one in outcomes if one.error]

    assert again() == again() == ["inverter"]
    assert calls.count("inverter.make_safe") == 1
    assert threads.is_busy("inverter")
    assert not threads.is_busy("supply")
    release.set()
    assert again() == []
    threads.end()


def test_whoever_is_in_a_hurry_waits_for_no_person_and_no_coasting_shaft(
    instruments: dict[Role, Any], release: threading.Event
) -> None:
    way = ShutdownSequence(
        (item(ShutdownAction.OUTPUT_OFF, Role.SUPPLY), item(ShutdownAction.SPEED_ZERO, Role.DYNAMOMETER)),
        frozenset({Role.SUPPLY}),
    )
    instruments[Role.SUPPLY].hanging = "output_off"
    instruments[Role.DYNAMOMETER].values = iter([40.0] * 1000)
    hurry, clock = threading.Event(), Clock()
    hurry.set()
    speed, supply = sorted(
        shut_down(way, instruments, Journal(), clock, hurry=hurry), key=lambda one: one.item.role.value
    )
    assert supply.error == "no answer in time"
    assert speed.error == "the speed is 40 rad/s; at most 1 rad/s is safe"
    assert clock.time == 0.0


def test_a_full_disk_does_not_keep_the_next_instrument_on(instruments: dict[Role, Any], calls: list[str]) -> None:
    class Full:
        def record(self, event: Event) -> None:
            raise OSError(28, "No space left on device")

    assert len(shut_down(ShutdownSequence(), instruments, Full(), Clock())) == len(USUAL) == len(calls)


def test_nothing_opened_nothing_to_make_safe() -> None:
    assert shut_down(ShutdownSequence(), {}, Journal(), Clock()) == []


@pytest.mark.parametrize("do", ShutdownAction)
def test_an_item_is_for_its_roles(do: ShutdownAction) -> None:
    for role in Role:
        if role in ROLES_OF[do]:
            assert item(do, role).role is role
        else:
            with pytest.raises(ValueError, match=f"{do.value} is not possible for {role.value}"):
                item(do, role)


def test_what_measures_nothing_has_no_threshold() -> None:
    with pytest.raises(ValueError, match="measures nothing"):
        item(ShutdownAction.DISABLE, Role.DRIVE, below=1.0)
    assert isinstance(item(ShutdownAction.BRAKE, Role.DYNAMOMETER), Item)


def test_a_walk_that_is_broken_off_leaves_nobody_speaking_to_an_instrument(instruments: dict[Role, Any]) -> None:
    class Stopped(Journal):
        def record(self, event: Event) -> None:
            raise KeyboardInterrupt

    finished: list[str] = []
    inverter = instruments[Role.INVERTER]
    inverter.make_safe = lambda: (threading.Event().wait(0.2), finished.append("inverter"))
    way = ShutdownSequence((item(ShutdownAction.DISABLE, Role.INVERTER), item(ShutdownAction.OUTPUT_OFF, Role.SUPPLY)))
    with pytest.raises(KeyboardInterrupt):
        shut_down(way, instruments, Stopped(), Clock(), patience=0.01)
    assert finished == ["inverter"]
