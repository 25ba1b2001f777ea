"""Mistakes of a driver that show only beside another user: in what is told, given back, and found running."""

from collections.abc import Callable
from dataclasses import replace
from typing import Any

import pytest

from bench.plugins.catalogues import installed
from bench.testing.conformance.connection import check_connection
from bench.testing.conformance.driver import subject_of
from bench.testing.conformance.ends import check_found
from bench.testing.conformance.guarded import check_guarded
from bench.testing.conformance.manual import Manual
from bench.testing.conformance.models import check_model
from bench.testing.conformance.opening import check_opening
from bench.testing.conformance.process_data import check_process_data
from bench.testing.conformance.report import Checks
from bench.testing.conformance.session import Trial, session_of
from bench.testing.conformance.station import check_station
from drivers.bases.waveform import Preamble
from drivers.cia402.inverter import Cia402Inverter
from drivers.cia402.node import Cia402Node
from drivers.cia402.velocity import Velocity
from drivers.interfaces import CommunicationError
from drivers.interfaces.found_state import FoundSetting
from drivers.interfaces.text import text
from drivers.lutron.tachometer import LutronTachometer
from drivers.transport.can.network_management import NmtState
from drivers.transport.can.process_data import MappedObject
from sim_instruments.instruments.cia402.catalogue import VELOCITY_INVERTER
from tests.bench.testing.conformance.own_cia402_models import TOO_FINE
from tests.bench.testing.conformance.own_drivers import OPTIONS, manual_of

Patch = pytest.MonkeyPatch


def _full(trial: Trial) -> None:
    with trial.opened() as (made, instrument):
        trial.session.full(made, instrument, trial.checks)


def _brief(trial: Trial) -> None:
    with trial.opened() as (made, instrument):
        trial.session.brief(made, instrument, trial.checks)


def failures(check: Callable[[Trial], None], name: str, manual: Manual | None = None, **options: Any) -> list[str]:
    """Return the checks that one of our drivers does not pass."""
    subject = subject_of(name, None, {**OPTIONS[name], **options}, installed())
    checks = Checks(manual=manual or Manual())
    check(Trial(subject, session_of(subject.role), checks, seed=0))
    report = checks.report(name)
    assert report.findings
    return [one.check for one in report.failures]


def _velocity_mode(trial: Trial) -> None:
    check_station(trial, [{"simulated": VELOCITY_INVERTER, "pole_pairs": 2}])


@pytest.mark.parametrize(
    "wrong", [pytest.param("", marks=pytest.mark.slow), "VL_TARGET_VELOCITY", "VL_ACTUAL_VELOCITY"]
)
def test_a_variant_is_used_with_another_instrument_of_its_family(monkeypatch: Patch, wrong: str) -> None:
    if wrong:
        monkeypatch.setattr(f"drivers.cia402.velocity.{wrong}", 0x6046)
    failed = failures(_velocity_mode, "cia402-inverter")
    assert bool(failed) is bool(wrong), failed


@pytest.mark.parametrize("puts_back", [pytest.param(True, marks=pytest.mark.slow), False])
def test_process_data_that_stay_mapped_are_found(monkeypatch: Patch, puts_back: bool) -> None:
    if not puts_back:
        monkeypatch.setattr("drivers.transport.can.process_data.ProcessData._restore", lambda *_: None)
    failed = failures(check_process_data, "cia402-six-step", process_data=True)
    assert failed == ([] if puts_back else ["PDOs: put back"])


@pytest.mark.parametrize(("index", "wrong"), [(0x6041, 4), (0x6079, 8), (0x6079, 2)])
def test_an_object_that_is_mapped_with_another_length_is_found(monkeypatch: Patch, index: int, wrong: int) -> None:
    def mapped(one: int, size: int, signed: bool = False) -> MappedObject:
        return MappedObject(one, wrong if one == index else size, signed)

    monkeypatch.setattr("drivers.cia402.six_step.MappedObject", mapped)
    assert failures(check_process_data, "cia402-six-step", process_data=True) == ["PDOs: each object in its length"]


def test_an_object_that_is_read_with_another_sign_from_a_pdo_is_found(monkeypatch: Patch) -> None:
    def unsigned(index: int, size: int, _signed: bool = False) -> MappedObject:
        return MappedObject(index, size)

    monkeypatch.setattr("drivers.cia402.six_step.MappedObject", unsigned)
    assert failures(check_process_data, "cia402-six-step", process_data=True) == ["PDOs: each object as by SDO"]


def test_a_port_that_may_not_be_opened_must_be_told_with_its_remedy(monkeypatch: Patch) -> None:
    told = CommunicationError("tachometer", text("it fails"))
    monkeypatch.setattr("drivers.lutron.tachometer.not_opened", lambda *_: told)
    assert failures(check_connection, "lutron-tachometer", manual_of("lutron-tachometer")) == [
        "a port that cannot be opened"
    ]


def test_a_driver_whose_traffic_is_not_told_is_found(monkeypatch: Patch) -> None:
    opened = LutronTachometer.open

    def opens(address: str, options: Any, surroundings: Any, name: str) -> Any:
        return opened(address, options, replace(surroundings, traffic=None), name)

    monkeypatch.setattr(LutronTachometer, "open", opens)
    assert failures(check_connection, "lutron-tachometer") == ["what it says and hears is told"]


def test_a_gain_of_another_trace_is_found(monkeypatch: Patch) -> None:
    manual = Manual(full_scale_gain=0.02)
    assert not failures(_brief, "keysight-infiniivision", manual)
    monkeypatch.setattr(Preamble, "value", lambda preamble, code: code * preamble.y_increment)
    assert "waveform: gain" in failures(_brief, "keysight-infiniivision", manual)


@pytest.mark.parametrize("disables", [True, False])
def test_a_mode_that_is_changed_under_power_is_found(monkeypatch: Patch, disables: bool) -> None:
    if not disables:
        monkeypatch.setattr(Cia402Node, "select", Cia402Node._set_mode)
    failed = failures(check_found, "cia402-inverter", Manual(running=manual_of("cia402-inverter").running))
    assert failed == ([] if disables else ["found running: works"])


def test_a_guard_that_tells_what_it_has_not_asked_is_found(monkeypatch: Patch) -> None:
    state = (FoundSetting("0x6060", "1", "", text("nothing")),)
    monkeypatch.setattr(Cia402Node, "found_state", property(lambda _: state))
    assert "found_state when guarding" in failures(check_guarded, "cia402-six-step")


@pytest.mark.slow
def test_a_drive_that_begins_with_an_older_command_is_found(monkeypatch: Patch) -> None:
    command = Velocity.command

    def commands(velocity: Velocity, frequency: float) -> None:
        if frequency:
            command(velocity, frequency)

    monkeypatch.setattr(Velocity, "command", commands)
    assert "no turning against the command on the way" in failures(_full, "cia402-inverter")


def test_a_guardian_that_leaves_a_velocity_commanded_is_found(monkeypatch: Patch) -> None:
    monkeypatch.setattr(Cia402Inverter, "_command_zero_unasked", lambda _: None)
    assert "command_zero() by a second connection: frequency" in failures(_full, "cia402-inverter")


@pytest.mark.parametrize("beyond", [pytest.param(1, marks=pytest.mark.slow), 4])
def test_a_command_that_the_drives_object_does_not_hold_is_to_be_told(beyond: int, monkeypatch: Patch) -> None:
    commands = Velocity.command

    def command(velocity: Velocity, frequency: float) -> None:
        counts = round(frequency * velocity.counts)
        if 1 << 31 <= abs(counts) < beyond << 31:
            return velocity.objects.write(velocity.target, 0, counts, velocity.size, signed=True)
        return commands(velocity, frequency)

    monkeypatch.setattr(Velocity, "command", command)

    def check(trial: Trial) -> None:
        for model in TOO_FINE:
            check_model(trial, model)

    failed = failures(check, "cia402-inverter")
    assert any(one.startswith("driving_frequency with") for one in failed) is (beyond > 1)


@pytest.mark.slow
def test_a_state_that_is_put_back_though_nobody_told_it_is_found(monkeypatch: Patch) -> None:
    identify = Cia402Node._woken

    def supposes(node: Cia402Node) -> Any:
        try:
            return identify(node)
        except CommunicationError:
            node._found_nmt = NmtState.STOPPED
            return identify(node)

    monkeypatch.setattr(Cia402Node, "_woken", supposes)
    failed = failures(check_opening, "cia402-rotor-actuator")
    assert any(one.endswith("when opening: the node's state is put back") for one in failed)
