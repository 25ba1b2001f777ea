"""Our own plug-ins conform; mistakes in them are found and named."""

import sys
from contextlib import suppress
from dataclasses import replace
from pathlib import Path
from typing import Any

import pytest

from bench.i18n.errors import InputError
from bench.plugins.catalogues import installed
from bench.testing.conformance import (
    Manual,
    Model,
    NotYet,
    ProtectionTrip,
    Reply,
    StatedLimits,
    check_driver,
    check_export,
    check_simulated_instrument,
)
from bench.testing.conformance.connection import check_connection
from bench.testing.conformance.disturbed import check_trip
from bench.testing.conformance.driver import subject_of
from bench.testing.conformance.kit import Conformance
from bench.testing.conformance.models import check_model
from bench.testing.conformance.network_management import check_network_management
from bench.testing.conformance.opening import check_opening
from bench.testing.conformance.report import Checks
from bench.testing.conformance.roles import supply
from bench.testing.conformance.session import Trial, session_of
from bench.testing.conformance.watchdogs import check_watchdog
from drivers.interfaces import (
    Accuracy,
    CommunicationError,
    Identity,
    IdentityError,
    InstrumentError,
    MeasurementError,
    Reading,
)
from drivers.interfaces.declarations import Effect, declarations
from drivers.lutron.options import LutronTachometerOptions
from tests.bench.testing.conformance.own_drivers import FOUND, OPTIONS, VARIANTS, driver_named, manual_of

_BY_102 = {"maximum_frequency": 1e6}
#: Those that a check of takes well under half a second.
QUICK = ("keysight-34461a", "lutron-tachometer", "gwinstek-gpt9800")
#: A make that nobody of us knows, as the how-to has it: one that does not confirm that its output is off.
CARELESS = """
from contextlib import contextmanager
from bench.plugins.catalogues import installed
from drivers.bases.scpi_supply import ScpiSupplyModel, SupplyCommands, SupplyData, ScpiSupply
from drivers.interfaces import Accuracy
from sim_instruments.instruments.scpi_supply import SupplyRating, simulated_supply

STATED = Accuracy(gain=1e-3, offset=10e-3, source="Acme manual")
SUPPLY = ScpiSupplyModel(
    makers=("Acme",), models=("PS303",),
    data=SupplyData(30.0, 3.0, 33.0, STATED, STATED),
    commands=SupplyCommands(),
).driver("acme-ps303", simulated="acme-ps303")
SIMULATED = simulated_supply("acme-ps303", "Acme,PS303,4711,1.0", SupplyRating(30.0, 3.0, 33.0))
"""


@pytest.mark.parametrize(
    "name", [*QUICK, *(pytest.param(name, marks=pytest.mark.slow) for name in OPTIONS if name not in QUICK)]
)
def test_our_drivers_conform(name: str) -> None:
    report = check_driver(
        driver_named(name),
        options=OPTIONS[name],
        found=FOUND.get(name),
        manual=manual_of(name),
        variants=VARIANTS.get(name, ()),
    )
    assert report.passed, "\n".join(map(str, report.failures))
    assert len(report.findings) > 30
    # What a moteus cannot do is checked, too.
    told = any("driving_frequency: what it does not offer" in one.check for one in report.findings)
    assert told is (name == "mjbots-moteus")


def test_a_fault_that_is_not_told_as_it_should_be_is_found() -> None:
    trip = ProtectionTrip(lambda simulated: simulated._power.trip(0x2310), says="0x3210", resets=False)
    subject = subject_of("cia402-six-step", None, OPTIONS["cia402-six-step"], installed())
    checks = Checks(manual=Manual(trip=trip))
    check_trip(Trial(subject, session_of(subject.role), checks, seed=0))
    found = [one.check for one in checks.report("six-step").failures]
    assert any(check.startswith("a fault of its own at '") and check.endswith("': afterwards") for check in found)
    assert any(check.startswith("a fault of its own at '") and check.endswith("'") for check in found)


@pytest.mark.parametrize("name", [pytest.param("cia402-inverter", marks=pytest.mark.slow), "cia402-six-step"])
@pytest.mark.parametrize("looks", [True, False])
def test_what_somebody_else_stopped_must_be_told(monkeypatch: pytest.MonkeyPatch, looks: bool, name: str) -> None:
    if not looks:
        unlooked = lambda power, source=None, **_: power.statusword(source)  # noqa: E731
        monkeypatch.setattr("drivers.cia402.power_state.PowerStateMachine.check_operation", unlooked)
    # Another master takes the enable away.
    stopped = ProtectionTrip(lambda simulated: simulated.write(0x6040, 0), says="left operation")
    subject = subject_of(name, None, OPTIONS[name], installed())
    checks = Checks(manual=Manual(stopped=stopped))
    check_trip(Trial(subject, session_of(subject.role), checks, seed=0))
    failed = [one.check for one in checks.report(name).failures]
    others = ("stopped by somebody else", "taken out of operation by another master (NMT)")
    assert failed == ([] if looks else [f"{one}: is told" for one in others])


@pytest.mark.parametrize(
    ("method", "found"),
    [
        ("", set()),
        ("_start", {"a node left pre-operational: is started", "a node left stopped: is started"}),
    ],
)
def test_a_node_that_is_not_started_when_opened_is_found(
    monkeypatch: pytest.MonkeyPatch, method: str, found: set[str]
) -> None:
    if method:
        monkeypatch.setattr(f"drivers.cia402.node.Cia402Node.{method}", lambda *_: None)
    subject = subject_of("cia402-six-step", None, OPTIONS["cia402-six-step"], installed())
    checks = Checks()
    check_network_management(Trial(subject, session_of(subject.role), checks, seed=0))
    report = checks.report("six-step")
    assert len(report.findings) >= 12
    assert {one.check for one in report.failures} >= found
    assert bool(report.failures) is bool(found)


def test_a_call_that_another_model_cannot_do_must_be_refused() -> None:
    modes = {"^read 6502H": (1 << 2).to_bytes(4, "little")}
    subject = subject_of("cia402-inverter", None, OPTIONS["cia402-inverter"], installed())
    for refused, wrong in ((("driving_current", 1.0), 0), (("driving_frequency", 20.0, 1.0), 1)):
        checks = Checks()
        model = Model(modes, refuses={refused: InstrumentError}, says="0x6502")
        check_model(Trial(subject, session_of(subject.role), checks, seed=0), model)
        assert len(checks.report("inverter").failures) == wrong


@pytest.mark.parametrize("name", sorted(installed().exports))
def test_our_exports_conform(name: str) -> None:
    check_export(name).require()


@pytest.mark.parametrize("name", sorted(set(installed().simulated_instruments) - {"generic-supply"}))
def test_our_simulated_instruments_conform(name: str) -> None:
    check_simulated_instrument(name).require()


def test_a_simulated_instrument_is_checked_with_a_driver_by_its_name() -> None:
    report = check_simulated_instrument("lutron-tachometer", driver="lutron-tachometer")
    assert report.passed
    assert any(one.check == "the same seed gives the same readings" for one in report.findings)
    with pytest.raises(InputError, match="known are: "):
        check_simulated_instrument("lutron-tachometer", driver="acme-none")
    with pytest.raises(InputError, match="is no driver: give a Driver"):
        check_simulated_instrument("lutron-tachometer", driver=LutronTachometerOptions)  # type: ignore[arg-type]


def test_a_plug_in_file_that_cannot_be_used_is_told_at_once(tmp_path: Path) -> None:
    (tmp_path / "acme.py").write_text("def opened(:\n")
    with pytest.raises(InputError, match=r"acme\.py cannot be used: SyntaxError: invalid syntax"):
        Conformance(tmp_path).files(tmp_path / "acme.py")


def test_a_procedure_conforms(tmp_path: Path) -> None:
    report = Conformance(tmp_path).procedure("pole-pairs-inverter", motors=1)
    assert any("aborted at" in finding.check for finding in report.findings)


def test_a_supply_in_a_file_conforms(tmp_path: Path) -> None:
    (tmp_path / "acme_supply.py").write_text(CARELESS)
    kit = Conformance(tmp_path / "runs").files(tmp_path / "acme_supply.py")
    report = kit.driver("acme-ps303")
    assert {"off that does not take", "silence: is told", "set point: voltage"} <= {
        one.check for one in report.findings
    }


def mutated(monkeypatch: pytest.MonkeyPatch, module: str, name: str, change: Any) -> None:
    __import__(module)
    monkeypatch.setattr(sys.modules[module], name, change)


@pytest.mark.parametrize(
    ("driver", "module", "name", "value", "check"),
    [
        ("lutron-tachometer", "drivers.lutron.tachometer", "RPM", 1.0, "speed reading: value"),
        ("lutron-tachometer", "drivers.lutron.tachometer", "SOURCE", "", "speed reading: accuracy is stated"),
        ("keysight-34461a", "drivers.keysight.dmm_34461a", "is_overrange", lambda _: False, "beyond the range"),
        ("keysight-34461a", "drivers.keysight.dmm_34461a", "check_setpoint", lambda *_: None, "set points"),
        ("keysight-e4980a", "drivers.keysight.e4980a", "check_setpoint", lambda *_: None, "set points"),
        ("keysight-34970a", "drivers.keysight.switch_unit_34970a", "conflict", lambda _: None, "refused: "),
        ("gwinstek-gpt9800", "drivers.gwinstek.gpt9800", "check_setpoint", lambda *_: None, "set points"),
    ],
)
def test_mistakes_are_found(
    monkeypatch: pytest.MonkeyPatch, driver: str, module: str, name: str, value: Any, check: str
) -> None:
    mutated(monkeypatch, module, name, value)
    report = check_driver(driver, options=OPTIONS[driver], first_only=True)
    assert not report.passed
    (found,) = report.failures
    assert check in str(found), found
    with pytest.raises(AssertionError, match="does not conform"):
        report.require()


@pytest.mark.parametrize(
    ("driver", "manual", "check"),
    [
        ("lutron-tachometer", Manual(identity=Identity("Acme", "T1")), "identity as stated"),
        ("lutron-tachometer", Manual(defaults={"update_period": 2.0}), "default of update_period"),
        ("keysight-34461a", Manual(accuracies_at={(5.0,): Accuracy(gain=1e-5)}), "accuracy_at(5.0,): accuracy as the"),
        (
            "keysight-34461a",
            Manual(accuracies_at={(5.0,): Accuracy(gain=3.5e-5, offset=5e-5, resolution=1e-5, source="elsewhere")}),
            "accuracy_at(5.0,): accuracy as the",
        ),
        ("keysight-34461a", Manual(accuracies_at={(5.0,): MeasurementError}), "accuracy_at(5.0,): none is stated"),
        ("gwinstek-gpt9800", Manual(local="^SYST:LOC$"), "close() gives the front panel back"),
        (
            "keysight-34461a",
            Manual(limits=(StatedLimits("configure", "full_scale", 0.0, 2000.0),)),
            "full_scale as the manual",
        ),
        (
            "keysight-34461a",
            Manual(limits=(StatedLimits("configure", "full_scale", 0.0, 500.0),)),
            "full_scale as the manual",
        ),
        ("keysight-34461a", Manual(replies=(Reply("READ", b"+1.0E+00", MeasurementError),)), "measure_voltage"),
        ("keysight-34461a", Manual(replies=(Reply("READ", b"+1.0E+00", reads={"value": 2.0}),)), "measure_voltage"),
        pytest.param(
            "keysight-34461a",
            Manual(replies=(Reply("READ", b"+9.9E+37", CommunicationError),)),
            "measure_voltage",
            marks=pytest.mark.slow,
        ),
        ("keysight-34461a", Manual(replies=(Reply("READ", b"+9.9E+37", None),)), "is no error"),
        pytest.param(
            "keysight-34461a", Manual(replies=(Reply("NEVER", b"0", None),)), "is no error", marks=pytest.mark.slow
        ),
        ("gwinstek-gpt9800", Manual(not_yet=(NotYet(r"FUNC:TEST\?", b"TEST ON", 9.0),)), "patience"),
        ("lutron-tachometer", Manual(replies=(Reply("frame", b"", says="no such words"),)), "measure_speed"),
        ("lutron-tachometer", Manual(replies=(Reply("frame", 9 * b"0", within=0.1),)), "in time"),
        ("lutron-tachometer", Manual(takes={"measure_speed": (2.0, 3.0)}), "measure_speed() lasts"),
        ("lutron-tachometer", Manual(port={"baudrate": 4800}), "baudrate of the port"),
        ("keysight-e4980a", Manual(models=(Model({r"\*OPT\?": b"032"}, states=_BY_102),)), "maximum_frequency with"),
        pytest.param(
            "keysight-infiniivision",
            Manual(models=(Model(states={("attenuation", 1): 1.0}),)),
            "('attenuation', 1) with its options",
            marks=pytest.mark.slow,
        ),
        pytest.param(
            "keysight-34461a",
            Manual(models=(Model(options={"calibration": {}}, error=IdentityError),)),
            "not opened with",
            marks=pytest.mark.slow,
        ),
        (
            "gwinstek-gpt9800",
            Manual(models=(Model(options={"ramp_time": 0.5}, holds={"MANU:RTIM?": "000.6 S"}),)),
            "MANU:RTIM? with",
        ),
        ("scpi-supply", Manual(steps={"^VOLT": 0.1}), "rounded to 0.1"),
    ],
)
def test_a_driver_that_is_not_as_its_manual_is_found(driver: str, manual: Manual, check: str) -> None:
    report = check_driver(driver_named(driver), options=OPTIONS[driver], manual=manual, first_only=True)
    (found,) = report.failures
    assert check in found.check, found


@pytest.mark.parametrize("name", sorted({*OPTIONS} - {"scpi-supply"}))
def test_the_use_that_is_disturbed_is_of_everything_that_feeds(name: str) -> None:
    subject = subject_of(driver_named(name), None, OPTIONS[name], installed(), found=FOUND.get(name))
    used: set[str] = set()

    class Noted:
        def __init__(self, instrument: Any) -> None:
            self.instrument = instrument

        def __getattr__(self, what: str) -> Any:
            used.add(what)
            return getattr(self.instrument, what)

    trial = Trial(subject, session_of(subject.role), Checks(), seed=0)
    with trial.opened() as (made, instrument):
        trial.session.brief(made, Noted(instrument), trial.checks)
        feeds = {
            method
            for method, declared in declarations(subject.role.interface).items()
            if declared.effect is Effect.ENERGISES
            and (declared.ability is None or declared.ability in instrument.abilities)
        }
    assert feeds <= used
    assert not trial.checks.wrong


def test_an_offset_on_another_scale_is_found(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr("drivers.bases.oscilloscope_dialogue.OscilloscopeDialogue._offset_sign", 1e-3)
    subject = subject_of("keysight-infiniivision", None, OPTIONS["keysight-infiniivision"], installed())
    trial = Trial(subject, session_of(subject.role), Checks(), seed=0)
    with trial.opened() as (made, instrument):
        trial.session.full(made, instrument, trial.checks)
    failed = [one.check for one in trial.checks.report("oscilloscope").failures]
    assert [one for one in failed if "hides what is beyond" in one]


@pytest.mark.slow
def test_a_driver_that_waits_too_short_for_a_real_line_is_found(monkeypatch: pytest.MonkeyPatch) -> None:
    # In process a reply is there at once, however short one waits.
    mutated(monkeypatch, "drivers.mjbots.controller", "_REPLY_TIME", 1e-3)
    subject = subject_of("mjbots-moteus", None, OPTIONS["mjbots-moteus"], installed(), found=FOUND["mjbots-moteus"])
    checks = Checks(manual=manual_of("mjbots-moteus"))
    check_opening(Trial(subject, session_of(subject.role), checks, seed=0))
    found = [one.check for one in checks.report("moteus").failures]
    assert found == ["opening over a real line"]


def test_a_level_that_is_raised_before_its_protection_is_found() -> None:
    subject = subject_of("keysight-e36300", None, OPTIONS["keysight-e36300"], installed())
    trial = Trial(subject, session_of(subject.role), Checks(), seed=0)
    with trial.opened() as (made, instrument):

        def configure(voltage: float, _: float) -> None:
            for header, value in (("VOLT", voltage), ("VOLT:PROT", 1.2 * voltage)):
                instrument._channel.write(header, f"{value:.6g}")

        instrument.configure = configure
        supply._set_without_output(made, instrument, trial.checks)
    failed = [one.check for one in trial.checks.report("supply").failures]
    assert "over-voltage protection while levels change" in failed


def test_a_driver_whose_wire_is_not_heard_is_found(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr("drivers.lutron.tachometer.TappedPort", lambda port, _: port)
    subject = subject_of("lutron-tachometer", None, OPTIONS["lutron-tachometer"], installed())
    checks = Checks()
    check_connection(Trial(subject, session_of(subject.role), checks, seed=0))
    assert [one.check for one in checks.report("it").failures] == ["what is on its wire is told"]


def test_a_question_that_is_never_answered_must_be_told(monkeypatch: pytest.MonkeyPatch) -> None:
    # The line asks again by itself, so that one lost answer shows nothing.
    def setting(sensor: Any, address: int, highest: int, what: str) -> int:
        with suppress(CommunicationError):
            value = sensor.setting(address, what)
        return int(value)

    monkeypatch.setattr("drivers.delta.dyn200.Dyn200._setting", setting)
    subject = subject_of("delta-dyn200", None, OPTIONS["delta-dyn200"], installed(), found=FOUND["delta-dyn200"])
    checks = Checks()
    check_opening(Trial(subject, session_of(subject.role), checks, seed=0, thorough=True))
    found = {one.check: one.wrong for one in checks.report("delta").failures}
    assert list(found) == ["no answer at all when opening: is told"]
    assert "UnboundLocalError at 'read 2 0020H 2'" in found["no answer at all when opening: is told"]


def test_a_watchdog_that_acts_too_early_is_found(monkeypatch: pytest.MonkeyPatch) -> None:
    # As if 09-03 counted fifths of a second.
    mutated(monkeypatch, "drivers.delta.c2000_watchdog", "TIME_STEP", 0.2)
    options = {**OPTIONS["delta-dyn200"], "watchdog_time": 1.0}
    subject = subject_of("delta-dyn200", None, options, installed(), found=FOUND["delta-dyn200"])
    checks = Checks()
    trial = Trial(subject, session_of(subject.role), checks, seed=0, thorough=True)
    check_watchdog(trial, "watched", trial)
    assert "watched: acts not before" in [one.check for one in checks.report("delta").failures]


def test_an_export_that_forgets_a_figure_is_found() -> None:
    target = installed().exports["c-header"]
    report = check_export(replace(target, write=lambda sheet: f"R = {sheet.lines[0].text}\n"))
    forgotten = [finding.check for finding in report.failures]
    assert forgotten == [f"{field.name}: stands in the file" for field in target.fields[1:]]


def test_findings_say_what_was_wrong_and_what_to_do() -> None:
    checks = Checks()
    stated = Accuracy(gain=1e-3, source="manual")
    checks.reading("current", Reading(2.0, "mA", stated, 0.0), 1.0, "A")
    said = [str(finding) for finding in checks.report("it").failures]
    assert "current: unit: 'mA' instead of 'A'. Compare scale, sign and unit with the maker's manual" in said
    assert any(line.startswith("current: value: 2 instead of 1") for line in said)


def test_a_report_without_checks_has_not_passed() -> None:
    with pytest.raises(AssertionError, match="nothing was checked"):
        Checks().report("it").require()


@pytest.mark.parametrize(
    "check",
    [
        lambda: check_simulated_instrument("keysight-infiniivision", driver="keysight-infiniivision"),
        lambda: check_driver("keysight-infiniivision", options={"probes": {}}),
    ],
)
def test_an_oscilloscope_without_probes_says_how_to_state_them(check: Any) -> None:
    with pytest.raises(InputError, match=r"has no voltage probe in its options.*Probe\(ProbeKind.VOLTAGE"):
        check()
