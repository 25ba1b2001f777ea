"""A plan rehearsed: what it lists, against which limits, and that nothing of the station is touched."""

import json
import socket
from collections.abc import Callable
from pathlib import Path
from typing import Any

import pytest

from bench.cli.main import main
from bench.journal.journal_file import read_journal

MOTOR = """
[nameplate]
name = "Unknown 200 W"
connection = "delta"
rated_current = 8.0
maximum_current = 20.0
rated_speed_rpm = 4000.0
maximum_speed_rpm = 5000.0
rated_voltage = 36.0

[expected]
stator_resistance = 0.15
"""

STATION = """
[station]
name = "bench 7"

[instruments.supply]
driver = "keysight-e36300"
name = "left supply"
address = "TCPIP0::192.0.2.10::inst0::INSTR"
serial_number = "MY61005055"
channel = 2

[instruments.supply.limits]
maximum_voltage = 12.0

[instruments.lcr_meter]
driver = "manual"
frequencies = [100.0, 1000.0]
resistance_accuracy = { gain = 0.01, source = "manual" }
inductance_accuracy = { gain = 0.01, source = "manual" }

[instruments.oscilloscope]
driver = "keysight-infiniivision"
address = "TCPIP0::192.0.2.11::inst0::INSTR"
probes.1 = { kind = "V", attenuation = 10.0 }
probes.2 = { kind = "V", attenuation = 10.0 }
probes.3 = { kind = "V", attenuation = 10.0 }
probes.4 = { kind = "A", attenuation = 10.0 }

[instruments.voltmeter]
driver = "keysight-34461a"
address = "USB0::0x2A8D::0x1401::MY53201234::0::INSTR"

[instruments.dynamometer]
driver = "manual"
maximum_speed = 600.0
maximum_torque = 3.0
speed_accuracy = { gain = 0.01, source = "manual" }
torque_accuracy = { gain = 0.01, source = "manual" }

[instruments.tachometer]
driver = "lutron-tachometer"
address = "/dev/no-such-port"

[instruments.inverter]
driver = "cia402-inverter"
address = "can://socketcan/can7?node=5"
maximum_current = 15.0
maximum_frequency = 500.0
current_scale = 1.4142
velocity_unit = "0.1 rpm"
pole_pairs = 4
field_current = { object = "0x2031:00", type = "u32", scale = 0.001 }

[instruments.drive]
driver = "cia402-six-step"
address = "can://socketcan/can7?node=6"
mode = -3
velocity_unit = "0.01 Hz"
bus_current = { object = "0x2210:02", type = "i16", scale = 0.01 }
hall_state = { object = "0x2211:00", type = "u8" }

[instruments.drive.limits]
maximum_voltage = 40.0
"""

Rehearse = Callable[..., tuple[int, dict[str, Any]]]


@pytest.fixture
def rehearse(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> Rehearse:
    def call(*arguments: str, station: str = "virtual", motor: str = "lg-400w") -> tuple[int, dict[str, Any]]:
        runs = ("--runs", str(tmp_path / "runs"))
        with pytest.raises(SystemExit) as stop:
            main(["run", *arguments, "--station", station, "--motor", motor, "--rehearse", "--json", *runs])
        out, err = capsys.readouterr()
        assert "Traceback" not in err
        return int(stop.value.code or 0), json.loads(out)

    return call


@pytest.fixture
def files(tmp_path: Path) -> dict[str, str]:
    """A station at whose addresses nobody is, and a motor that is no virtual one."""
    (tmp_path / "motor.toml").write_text(MOTOR, encoding="utf-8")
    (tmp_path / "station.toml").write_text(STATION, encoding="utf-8")
    return {"motor": str(tmp_path / "motor.toml"), "station": str(tmp_path / "station.toml")}


def lines(made: dict[str, Any], kind: str) -> list[dict[str, Any]]:
    return [
        line
        for procedure in made["procedures"]
        for step in procedure["steps"]
        for line in step["lines"]
        if line["kind"] == kind
    ]


def test_a_rehearsal_lists_the_set_points_of_the_run(
    rehearse: Rehearse, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    plan = ("pole-pairs-static", "stator-resistance-dc", "pole-pairs-back-emf")
    status, made = rehearse(*plan)
    assert (status, made["good"], made["violations"]) == (0, True, [])
    with pytest.raises(SystemExit):
        main(["run", *plan, "--station", "virtual", "--motor", "lg-400w", "--json", "--runs", str(tmp_path / "runs")])
    run = Path(json.loads(capsys.readouterr().out)["run"])
    sent = [
        (event.data["instrument"], value)
        for event in read_journal(run / "journal.jsonl").events
        if event.kind == "energising"
        for value in event.data["arguments"]
        if isinstance(value, float)
    ]
    listed = [(line["instrument"], line["value"]) for line in lines(made, "set point")]
    assert listed == sent
    assert len(lines(made, "on")) == len(lines(made, "off")) == 52
    assert lines(made, "action")[0]["text"] == [
        "Connect, in this order:",
        "Take every lead and probe off the motor that is still on it",
        "Take the motor's shaft off the dynamometer",
        "Unlock the shaft and turn it a little by hand: it moves freely",
        "Put the supply's plus on A",
        "Put the supply's minus on B and C",
    ]
    assert made["bench_time"] == pytest.approx(sum(one["bench_time"] for one in made["procedures"]), abs=5.0)
    assert 0.0 < made["hand_time"] < made["bench_time"]


def test_what_readings_decide_is_listed_as_maybe_and_not_by_the_twin_s_own(rehearse: Rehearse) -> None:
    """Of these two motors other lines differ most, and are read again."""
    listed = []
    for motor in ("lg-400w", "gimbal"):
        _, made = rehearse("winding-balance", motor=motor)
        listed.append([(line["kind"], line["text"]) for line in (*lines(made, "action"), *lines(made, "perhaps"))])
    assert listed[0] == listed[1]
    assert listed[0][-1] == ("perhaps", ["BC", "CA"])
    assert sum("high from C to A" in str(words) for _, words in listed[0]) == 1, "the first line again, always"


def test_the_largest_set_points_stand_against_the_least_limit(rehearse: Rehearse) -> None:
    _, made = rehearse("pole-pairs-static", "back-emf-constant")
    supply = made["highest"]["supply"]
    assert supply["current limit"] == {
        "value": pytest.approx(2.9), "unit": "A", "limit": 10.0, "whose": "the station (instruments.supply.maximum_current)",
    }  # fmt: skip
    assert (supply["voltage"]["limit"], supply["voltage"]["whose"]) == (6.18, "the model")
    speed = made["highest"]["dynamometer"]["speed"]
    assert speed["value"] == pytest.approx(314.159, abs=1e-3)
    assert (speed["limit"], speed["whose"]) == (
        pytest.approx(418.879, abs=1e-3),
        "the motor (nameplate.maximum_speed_rpm)",
    )
    reached = {(one["instrument"], one["unit"]): one["value"] for one in made["reached"]}
    assert reached["tachometer", "rad/s"] == pytest.approx(314.0, abs=1.0)


def test_nothing_of_the_station_is_touched_and_a_motor_is_assumed(
    rehearse: Rehearse, files: dict[str, str], monkeypatch: pytest.MonkeyPatch
) -> None:
    def refuse(*_: object) -> None:
        raise AssertionError("a rehearsal connects to nothing")

    monkeypatch.setattr(socket.socket, "connect", refuse)
    plan = (
        "stator-resistance",
        "dq-inductance-time-constant",
        "pole-pairs-inverter",
        "inertia",
    )
    status, made = rehearse(*plan, "--set", "stator-resistance.frequency=100", **files)
    assert status == 0, made["cause"]
    assert [one["status"] for one in made["procedures"]] == ["completed"] * len(plan)
    assumed = {one["name"]: one["why"] for one in made["assumed"]}
    assert assumed["stator_resistance"] == "type value, [expected] of the motor file"
    assert "no pole_pairs" in assumed["pole_pairs"]
    assert {"flux_linkage", "d_axis_inductance", "q_axis_inductance", "inertia", "coulomb_friction"} <= set(assumed)
    # The station's own limits, its names and its choice of output hold on the twin.
    supply = made["highest"]["left supply"]
    assert supply["voltage"]["whose"] == "the station (instruments.supply.limits.maximum_voltage)"
    assert (supply["voltage"]["value"], supply["current limit"]["limit"]) == (12.0, 2.06)
    assert made["highest"]["dynamometer"]["torque"]["limit"] == 3.0
    said = " ".join(made["differences"])
    assert "output 2 of an E36313A is taken, at most 25.75 V, 2.06 A" in said
    assert "lcr_meter: keysight-e4980a simulates the station's manual" in said
    watchdogs = {one["role"]: (one["watchdog"], one["armed"], one["by_hand"]) for one in made["watchdogs"]}
    asked = {"time": 1.0, "action": "switches its voltage off", "setting": "0x1016, 0x6007"}
    assert watchdogs == {
        "inverter": (asked, False, False),
        "dynamometer": (None, False, True),
        "supply": (None, False, False),
    }


def test_a_limit_that_would_be_passed_is_named_and_the_rest_is_rehearsed_all_the_same(
    rehearse: Rehearse, files: dict[str, str]
) -> None:
    path = Path(files["station"])
    path.write_text(path.read_text() + "\n[instruments.lcr_meter.limits]\nmaximum_level = 0.5\n", encoding="utf-8")
    status, made = rehearse(
        "stator-resistance", "stator-resistance-dc", "--set", "stator-resistance.frequency=100", **files
    )
    assert (status, made["good"]) == (1, False)
    assert [one["status"] for one in made["procedures"]] == ["failed", "completed"]
    assert made["violations"] == [
        {
            "procedure": "stator-resistance",
            "message": "lcr_meter: level = 1 V rms is outside 0 … 0.5 V rms, "
            "the limit of the station (instruments.lcr_meter.limits.maximum_level); nothing was sent",
        }
    ]
    refused = [line for line in lines(made, "set point") if not line["allowed"]]
    assert [(line["parameter"], line["value"], line["limit"]) for line in refused] == [("level", 1.0, 0.5)]


def test_a_frequency_that_the_meter_does_not_offer_is_named(rehearse: Rehearse, files: dict[str, str]) -> None:
    status, made = rehearse("stator-resistance", "dq-inductance-aligned", **files)
    assert (status, made["good"]) == (1, False)
    # The 20 Hz that a connection is verified at are not the plan's.
    (violation,) = made["violations"]
    assert violation["procedure"] == "stator-resistance"
    assert "frequency = 20 Hz is not one of the values that it offers, 100, 1000 Hz" in violation["message"]


@pytest.mark.parametrize(
    ("limits", "message"),
    [
        ("maximum_voltage = 20.0", "drive: DC link voltage = 2"),
        ("maximum_frequency = 30.0", "Hz is beyond 30 Hz, the limit of the station"),
    ],
)
def test_a_limit_that_the_twin_would_pass_while_it_runs_is_named_too(
    rehearse: Rehearse, tmp_path: Path, limits: str, message: str
) -> None:
    head, _, _ = STATION.partition("[instruments.supply]")
    drive = STATION[STATION.index("[instruments.drive]") :].replace("maximum_voltage = 40.0", limits)
    rest = """
[instruments.oscilloscope]
driver = "capture-files"
probes = { 4 = "A" }
amplitude_accuracy = { 4 = { gain = 0.01, source = "manual" } }

[instruments.dynamometer]
driver = "manual"
maximum_speed = 500.0
maximum_torque = 3.0
speed_accuracy = { gain = 0.01, source = "manual" }
torque_accuracy = { gain = 0.01, source = "manual" }

[instruments.tachometer]
driver = "manual"
accuracy = { gain = 0.01, source = "manual" }

"""
    (tmp_path / "station.toml").write_text(head + rest + drive, encoding="utf-8")
    loads = ("--set", "loads=[0.3, 0.5, 0.7]", "--set", "winding_inductance=1e-4", "--set", "winding_resistance=0.4")
    station = str(tmp_path / "station.toml")
    status, made = rehearse("equivalent-resistance", *loads, station=station, motor="92bl-30-25l")
    assert status == 1
    assert [message in one["message"] for one in made["violations"]] == [True]


def test_a_rehearsal_is_no_run(rehearse: Rehearse, tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    _, made = rehearse("nameplate")
    folder = Path(made["rehearsal"])
    assert folder.parent == tmp_path / "runs" / "rehearsals"
    assert "rehearsal" in folder.name
    assert sorted(path.name for path in folder.iterdir()) == ["rehearsal.json", "rehearsal.jsonl"]
    assert json.loads((folder / "rehearsal.json").read_text()) == made
    assert read_journal(folder / "rehearsal.jsonl").events[0].kind == "rehearsal_started"
    runs = ("--runs", str(tmp_path / "runs"))
    for arguments in (["run", "--resume", str(folder), *runs], ["results", str(folder), *runs]):
        with pytest.raises(SystemExit) as stop:
            main(arguments)
        assert stop.value.code != 0
        assert "this is a rehearsal; nothing was measured" in capsys.readouterr().err


@pytest.mark.parametrize(
    "more", [("--operator", "terminal"), ("--fault", "supply: silence at 1 s"), ("--answers", "readings.toml")]
)
def test_what_does_not_go_with_a_rehearsal_is_refused(
    tmp_path: Path, capsys: pytest.CaptureFixture[str], more: tuple[str, ...]
) -> None:
    arguments = ["run", "nameplate", "--station", "virtual", "--motor", "lg-400w", "--rehearse", *more]
    with pytest.raises(SystemExit) as stop:
        main([*arguments, "--runs", str(tmp_path / "runs")])
    assert stop.value.code != 0
    assert "--rehearse tries a whole plan with virtual hands" in capsys.readouterr().err
    assert not (tmp_path / "runs").exists()


@pytest.mark.parametrize(
    ("language", "said"),
    [
        ("en", ["on a virtual twin of bench 7", "These values were assumed:", "left supply: energised voltage 12 V (at most 12 V",
                "left supply: switched on", "☞ Connect, in this order:", "1. Take every lead and probe off", "Lock the shaft",
                "Largest set points", "No limit is exceeded",
                "If all processes of the bench die at once:", "supply: no watchdog; it stays on if run and guardian end"]),
        ("zh", ["bench 7", "☞", "✓", "left supply", "supply：没有看门狗"]),
    ],
)  # fmt: skip
def test_the_list_for_people(
    files: dict[str, str], tmp_path: Path, capsys: pytest.CaptureFixture[str], language: str, said: list[str]
) -> None:
    arguments = ["run", "stator-resistance-dc", "--station", files["station"], "--motor", files["motor"], "--rehearse"]
    with pytest.raises(SystemExit) as stop:
        main([*arguments, "--language", language, "--runs", str(tmp_path / "runs")])
    assert not stop.value.code
    out = capsys.readouterr().out
    for part in said:
        assert part in out
    assert ("Largest set points" in out) is (language == "en")
