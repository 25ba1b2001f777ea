"""Commands on the virtual bench, through the real drivers: values by physics, limits, the journal, everything off at the end."""

import json
import math
from collections.abc import Callable
from dataclasses import replace
from pathlib import Path
from typing import Any

import pytest
from rich.console import Console

from bench.eol.line.preparation.prepare import planned_of
from bench.eol.plan import PlannedCheck
from bench.i18n.errors import InputError, UsageError
from bench.journal.codec import RecordedEvent
from bench.journal.journal_file import read_journal
from bench.journal.waveforms import read_waveform
from bench.motor.motor_file import load_motor
from bench.plugins.catalogues import installed
from bench.rehearsal.rehearse import rehearse
from bench.run.plan import make_plan
from bench.run.request import Finished, RunRequest
from bench.run.run import run
from bench.virtual.fault_file import given_faults
from drivers.bases.scpi_supply import ScpiSupply
from drivers.interfaces import Role
from procedures.core.actions import ChangeSetup, EnterCommand
from procedures.core.events import ActionDone, ActionStarted
from procedures.core.setup_change import ChangeKind
from sim_instruments.world.world import World

Do = Callable[..., Finished]


@pytest.fixture
def do(tmp_path: Path) -> Do:
    """Carry out commands, and see that nothing is left on."""

    def carried_out(*commands: str, **more: Any) -> Finished:
        answers = tmp_path / "commands.toml"
        answers.write_text(f"commands = {json.dumps(commands)}", encoding="utf-8")
        done = run(wishes(tmp_path, answers=answers, **more), installed().procedures, Console(quiet=True))
        assert not done.left["energised"]
        return done

    return carried_out


def wishes(runs: Path, **more: Any) -> RunRequest:
    operator = "answers" if "answers" in more else ""
    settled = {"station": "virtual", "language": "en", "operator": operator, "guardian": False, **more}
    return RunRequest(procedures=["by-hand"], motor=load_motor("lg-400w"), runs=runs, **settled)


def events(done: Finished) -> tuple[RecordedEvent, ...]:
    return read_journal(done.folder.journal).events


def refusals(done: Finished) -> list[tuple[str, str]]:
    """Return the commands that were refused, and what was said of each."""
    told, line = list[tuple[str, str]](), ""
    for recorded in events(done):
        match recorded.event:
            case ActionStarted(action="EnterCommand", details=EnterCommand(said=said, refused=True)):
                told.append((line, str(said)))
            case ActionDone(action="EnterCommand", given=str() as given):
                line = given
    return told


def values(done: Finished, instrument: str, call: str) -> Any:
    """Return what an instrument's call gave last."""
    given = [one.data for one in events(done) if one.kind == "reading" and one.data["instrument"] == instrument]
    return next(one["value"] for one in reversed(given) if one["call"] == call)


def energised(done: Finished) -> list[tuple[str, str]]:
    return [(one.kind, one.data["instrument"]) for one in events(done) if one.kind in ("energising", "de_energised")]


def test_readings_are_those_of_physics_and_every_command_is_in_the_journal(do: Do) -> None:
    commands = (
        "connect A=supply+ B=supply-",
        "voltmeter-leads A B",
        "supply energised 1 V 500 mA regulated=current",
        "turn-to-rest",
        "supply measure_current",
        "voltmeter configure 100 mV",
        "voltmeter measure_voltage",
        "off supply",
        "voltmeter-leads off",
        "connect A=lcr_high B=lcr_low",
        "lcr_meter configure 1 kHz",
        "lcr_meter measure",
        "connect",
        "couple-dynamometer",
        "probes 1=A:B",
        "dynamometer driving_speed 300 rpm",
        "dynamometer measure",
        "oscilloscope configure_channel 1 20 V",
        "oscilloscope configure_acquisition 100 ms 2000",
        "oscilloscope configure_trigger none",
        "oscilloscope initiate",
        "oscilloscope fetch 1 1 s",
    )
    done = do(*commands)
    assert (done.view.status, refusals(done)) == ("completed", [])
    truth = load_motor("lg-400w").virtual_motor()
    volts = values(done, "voltmeter", "measure_voltage")["value"]
    amperes = values(done, "supply", "measure_current")["value"]
    assert volts / amperes == pytest.approx(sum(truth.phase_resistances[:2]), rel=0.01)
    bridge = values(done, "lcr_meter", "measure")
    assert bridge["frequency"] == 1000.0
    assert 2.0 * truth.d_axis_inductance < bridge["inductance"] < 2.0 * truth.q_axis_inductance
    assert values(done, "dynamometer", "measure")["speed"] == pytest.approx(10.0 * math.pi, rel=0.005)
    (wave,) = [one.data for one in events(done) if one.kind == "waveforms"]
    samples = read_waveform(done.folder.path / wave["file"]["path"], wave["value"]["1"]["waveform"]).values
    emf = math.sqrt(3.0) * truth.flux_linkage * truth.pole_pairs * 10.0 * math.pi
    assert max(samples) == pytest.approx(emf, rel=0.05)
    typed = [
        one.event.given for one in events(done) if one.kind == "action_done" and one.data["action"] == "EnterCommand"
    ]
    # What goes on is confirmed once for each setup.
    assert typed == [*commands[:3], "yes", *commands[3:16], "yes", *commands[16:], "finish"]
    assert [one["command"] for one in done.view.finished["by-hand"].findings["read"]] == [
        line for line in commands if "measure" in line or "fetch" in line
    ]


def test_what_is_beyond_a_limit_or_unsafe_is_refused_before_anything_is_sent(do: Do) -> None:
    done = do(
        "supply energised 1 V 1 A",
        "connect A=supply+ B=supply-",
        "supply energised 500 V 1 A",
        "supply energised 1 V 90 A",
        "inverter driving_frequency 10 Hz 500 A",
        "dynamometer driving_speed 300 rpm",
        "supply energised 1 V 1 A regulated=current",
        "connect A=lcr_high B=lcr_low",
        "supply energised 1 V 1 A",
    )
    assert done.view.status == "completed"
    whys = [
        "stays off until you have stated what is connected to the motor's terminals",
        "voltage = 500 V is outside 0 …",
        "current limit = 90 A is outside 0 …",
        "current = 500 A is outside",
        "disconnect supply first",
        "switch everything off before working by hand",
        "supply is already on",
    ]
    (said,) = [str(notice.message) for _, notice in done.view.warnings() if notice.identifier == "refused-commands"]
    assert "supply energised 500 V 1 A" in said
    assert "connect A=supply+" not in said
    told = refusals(done)
    assert len(told) == len(whys)
    assert [(why, said) for (_, said), why in zip(told, whys, strict=True) if why not in said] == []
    # Nobody looks over the bench for what is refused anyway.
    asked = [one.event for one in events(done) if isinstance(one.event, ActionDone)]
    confirmed = [one.given for one in asked if one.action == "EnterCommand"]
    assert [confirmed[number - 1] for number, line in enumerate(confirmed) if line == "yes"] == [
        "supply energised 1 V 1 A regulated=current"
    ]
    # Of all these only the one that was not refused was ever on its way to an instrument; finish switched it off.
    assert energised(done) == [("energising", "supply"), ("de_energised", "supply")]


def test_connections_by_hand_follow_the_order_of_the_hands(do: Do) -> None:
    done = do(
        "connect A=supply+ B=supply-",
        "voltmeter-leads A B",
        "connect A=lcr_high B=lcr_low",
        "probes 1=A:B",
        "connect A=inverter_u B=inverter_v C=inverter_w",
        "connect A=inverter_u B=inverter_v C=inverter_w",
    )
    assert [(line, "which is to be alone there" in said) for line, said in refusals(done)] == [("probes 1=A:B", True)]
    asked = [one.event.details for one in events(done) if isinstance(one.event, ActionStarted)]
    changes = [one.changes for one in asked if isinstance(one, ChangeSetup)]
    # Unknown at first, so everything comes off; the meter does not stay beside the bridge; what is so already is not asked for.
    clear, put_on, off = ChangeKind.CLEAR, ChangeKind.PUT_ON, ChangeKind.TAKE_OFF
    assert [[(one.kind, one.role) for one in each] for each in changes] == [
        [(clear, None), (put_on, Role.SUPPLY), (put_on, Role.SUPPLY)],
        [(put_on, Role.VOLTMETER)] * 2,
        [(off, Role.SUPPLY)] * 2 + [(off, Role.VOLTMETER)] * 2 + [(put_on, Role.LCR_METER)] * 2,
        [(off, Role.LCR_METER)] * 2 + [(put_on, Role.INVERTER)] * 3,
    ]


def test_after_hand_work_that_failed_nothing_is_believed_to_be_connected(
    do: Do, monkeypatch: pytest.MonkeyPatch
) -> None:
    def slipped(_: object) -> None:
        raise RuntimeError("the coupling does not close")

    monkeypatch.setattr(World, "couple_dynamometer", slipped)
    done = do("connect A=supply+ B=supply-", "couple-dynamometer", "supply energised 1 V 1 A", "connect")
    assert [(line, said[:40]) for line, said in refusals(done)] == [
        ("couple-dynamometer", "the virtual operator cannot do it: the c"),
        ("supply energised 1 V 1 A", "supply stays off until you have stated w"),
    ]
    assert energised(done) == []


def test_set_points_are_in_the_journal_before_they_are_sent_and_what_tripped_is_said(do: Do) -> None:
    done = do(
        "connect A=supply+ B=supply-", "supply energised 1 V 1 A", "turn-to-rest", "off", "lcr_meter configure 1 kHz"
    )
    ((line, said),) = refusals(done)
    assert line == "off"
    assert "over-current protection switched the output off" in said
    kinds = [(one.kind, one.data.get("instrument")) for one in events(done)]
    assert kinds.index(("energising", "supply")) + 1 == kinds.index(("energised", "supply"))
    assert kinds.index(("commanding", "lcr_meter")) < kinds.index(("setting", "lcr_meter"))


def test_a_failed_instrument_switches_everything_off_and_the_run_goes_on(do: Do) -> None:
    (fault,) = given_faults(None, ["lcr_meter: silence at 1 s"], installed().procedures)
    done = do(
        "connect A=supply+ B=supply-",
        "supply energised 1 V 1 A regulated=current",
        "lcr_meter configure 1 kHz",
        "supply output_mode",
        faults=[fault],
    )
    assert done.view.status == "completed"
    ((line, said),) = refusals(done)
    assert (line, said.endswith("Everything was switched off")) == ("lcr_meter configure 1 kHz", True)
    assert energised(done) == [("energising", "supply"), ("de_energised", "supply")]
    assert values(done, "supply", "output_mode") == "off"


def test_a_fault_of_the_program_in_a_reading_ends_the_run_with_everything_off(
    do: Do, monkeypatch: pytest.MonkeyPatch
) -> None:
    def broken(_: object) -> None:
        raise ZeroDivisionError

    monkeypatch.setattr(ScpiSupply, "measure_current", broken)
    done = do(
        "connect A=supply+ B=supply-",
        "supply energised 1 V 1 A current",
        "supply measure_current",
        "supply energised 1 V 1 A",
    )
    assert done.view.status == "failed"
    assert "ZeroDivisionError" in done.view.cause
    assert energised(done) == [("energising", "supply"), ("de_energised", "supply")]


def test_chosen_roles_are_all_there_is(do: Do) -> None:
    done = do("dynamometer measure", "voltmeter configure 1 V", assignments=['roles=["voltmeter"]'])
    assert [(line, "there is no dynamometer here" in said) for line, said in refusals(done)] == [
        ("dynamometer measure", True)
    ]
    assert list(done.view.finished["by-hand"].findings["instruments"]) == ["voltmeter"]


def test_it_is_a_run_of_its_own_and_nothing_to_rehearse_or_to_go_on_with(do: Do, tmp_path: Path) -> None:
    known, quiet = installed().procedures, Console(quiet=True)
    done = do("supply measure_voltage")
    with pytest.raises(UsageError, match="begin a new one"):
        run(replace(wishes(tmp_path), resume=done.folder), known, quiet)
    with pytest.raises(UsageError, match="cannot be rehearsed"):
        rehearse(wishes(tmp_path), known, quiet)
    with pytest.raises(UsageError, match="the only procedure of a run"):
        make_plan(["by-hand", "stator-resistance"], [], known)
    with pytest.raises(InputError, match="cannot be part of a plan"):
        planned_of([PlannedCheck("by-hand", {}, 1, "stop", 0)], "plan.toml", known)
    assert "by-hand" not in {planned.name for planned in make_plan(["all"], [], known)}
    with pytest.raises(InputError, match=r"\[instruments.insulation_tester\]"):
        run(wishes(tmp_path, assignments=['roles=["insulation_tester"]']), known, quiet)
    assert run(wishes(tmp_path), known, quiet).view.status == "completed"


def test_what_is_connected_and_the_probes_factor_are_said_before_it_goes_on(do: Do) -> None:
    done = do(
        "yes",
        "connect",
        "couple-dynamometer",
        "probes 1=A:B",
        "help oscilloscope",
        "dynamometer driving_speed 300 rpm",
        "off",
        "dynamometer driving_speed 200 rpm",
    )
    assert refusals(done) == [("yes", "there is nothing to confirm; help lists the commands")]
    asked = [
        one.event.details
        for one in events(done)
        if isinstance(one.event, ActionStarted) and isinstance(one.event.details, EnterCommand)
    ]
    # The same setup is looked at once.
    (look,) = [each for each in asked if each.confirms]
    assert look.confirms == "dynamometer driving_speed 300 rpm"
    assert str(look.said).splitlines()[1:] == [
        "  the tip of channel 1 on A",
        "  the reference of channel 1 on B",
        "  channel 1: voltage probe 10:1; figures are in V at its tip",
        "The dynamometer is coupled. No other source, lead or short circuit may be connected to the motor, and "
        "nobody may touch it",
        "Type yes to switch it on; any other command leaves it off",
    ]
    assert any("channel 1: voltage probe 10:1" in str(each.said) for each in asked if "fetch" in str(each.said))
    assert energised(done) == [("energising", "dynamometer"), ("de_energised", "dynamometer")] * 2
