"""`motorbench sim six-step`: its JSON, its text, its figure, and what it refuses."""

import json
from importlib import resources
from pathlib import Path

import pytest

from bench.cli.sim.six_step import six_step
from bench.i18n.errors import InputError, UsageError
from bench.motor.six_step_file import EXAMPLE, load_drive

FILE = (resources.files("bench") / "motors" / f"{EXAMPLE}.toml").read_text(encoding="utf-8")


def changed(folder: Path, old: str, new: str) -> str:
    assert old in FILE
    path = folder / "motor.toml"
    path.write_text(FILE.replace(old, new, 1), encoding="utf-8")
    return str(path)


def test_json_is_one_object_in_si_units(capsys: pytest.CaptureFixture[str]) -> None:
    six_step(EXAMPLE, load=[0.5, 1.2], json=True)
    captured = capsys.readouterr()
    points = json.loads(captured.out)["points"]
    assert captured.err == ""
    assert len(points) == 2
    first = points[0]
    assert set(first) == {
        "speed_rpm",
        "load_torque",
        "electromagnetic_torque",
        "supply_current",
        "bus_voltage",
        "source_voltage",
        "winding_current_average",
        "winding_current_rms",
        "winding_current_start",
        "winding_current_end",
        "freewheel_time",
        "state_time",
        "voltage_components",
        "losses",
        "power_residual",
    }
    assert first["speed_rpm"] == pytest.approx(3256, rel=0.002)
    assert first["load_torque"] == pytest.approx(0.5)
    assert first["winding_current_average"]["c"] == pytest.approx(-5.88074, rel=0.005)
    assert first["voltage_components"]["c_branch"]["emf"] == pytest.approx(19.95604, rel=0.005)
    assert first["voltage_components"]["supply"]["switches_at_supply_current"] == pytest.approx(0.503715, rel=0.005)
    assert set(first["losses"]) == {"copper", "switches", "diode", "source", "friction"}
    assert abs(first["power_residual"]) < 1e-6
    # The next state starts where this one ends, windings renamed and reversed.
    assert first["winding_current_end"]["b"] == pytest.approx(-first["winding_current_start"]["c"])
    assert points[1]["speed_rpm"] < first["speed_rpm"]


def test_text_shows_both_tables(capsys: pytest.CaptureFixture[str]) -> None:
    six_step(EXAMPLE, speed=[3256.0])
    text = capsys.readouterr().out
    assert text.startswith("3256.00 rpm, motoring: load 0.49624 N·m")
    assert "EMF                             19.95928      19.95928" in text
    assert "R_11L" in text
    assert "power balance's residual" in text


def test_generating_point_is_solved_and_said(capsys: pytest.CaptureFixture[str]) -> None:
    six_step(EXAMPLE, speed=[4500.0], json=True)
    captured = capsys.readouterr()
    assert json.loads(captured.out)["points"][0]["supply_current"] < 0
    assert "4500 rpm: the EMF drives current back into the source (generating)" in captured.err


def test_a_wye_has_one_branch(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    six_step(changed(tmp_path, 'connection = "delta"', 'connection = "wye"'), speed=[1500.0], json=True)
    components = json.loads(capsys.readouterr().out)["points"][0]["voltage_components"]
    assert set(components) == {"ac_branch", "supply"}
    branch = components["ac_branch"]
    parts = branch["emf"] + branch["resistance"] + branch["self_inductance"] + sum(branch["mutual_inductance"])
    assert parts == pytest.approx(branch["terminal"])


@pytest.mark.slow
@pytest.mark.parametrize(("name", "magic"), [("figure.png", b"\x89PNG"), ("figure.svg", b"<?xml")])
def test_plot(tmp_path: Path, name: str, magic: bytes) -> None:
    path = tmp_path / name
    six_step(EXAMPLE, speed=[3256.0, 6000.0], plot=path)
    content = path.read_bytes()
    assert content.startswith(magic)
    assert len(content) > 20_000


@pytest.mark.parametrize(
    ("arguments", "message"),
    [
        ({}, "give either --speed"),
        ({"speed": [1.0], "load": [1.0]}, "one of the two"),
        ({"speed": [1.0], "plot": Path("figure.txt")}, r"\.svg or \.png"),
        ({"speed": [1.0, 2.0, 3.0, 4.0, 5.0], "plot": Path("figure.svg")}, "up to 4 points"),
        ({"speed": [1.0], "plot": Path("/nowhere/figure.svg")}, r"/nowhere/figure\.svg: the plot cannot be written"),
        ({"speed": [0.0]}, "finite speed above 0 rpm"),
        ({"speed": [-100.0]}, "finite speed above 0 rpm"),
        ({"speed": [float("nan")]}, "finite speed above 0 rpm"),
        ({"speed": [1e300]}, "can be solved for this drive"),
        ({"load": [6.0]}, "above the stall torque"),
        ({"load": [float("inf")]}, "finite torque"),
    ],
)
def test_refused(arguments: dict, message: str, capsys: pytest.CaptureFixture[str]) -> None:
    with pytest.raises(InputError, match=message):
        six_step(EXAMPLE, **arguments)
    assert capsys.readouterr().out == ""


def test_neither_speed_nor_load_is_a_mistake_of_usage() -> None:
    with pytest.raises(UsageError):
        six_step(EXAMPLE)


@pytest.mark.parametrize(
    ("old", "new", "message"),
    [
        (
            "mutual_inductance = -0.0233e-3",
            "mutual_inductance = 0.5e-3",
            "motor.toml: virtual: .*positive definite only for",
        ),
        ("mutual_inductance = -0.0233e-3", "mutual_inductance = nan", r"virtual\.winding\.mutual_inductance = nan"),
        (
            "resistance = 0.1146",
            "resistance = 0.0",
            r"virtual\.winding\.resistance = 0\.0; allowed is a number above 0",
        ),
        ("resistance = 0.1146", 'resistance = "0.1 ohm"', "is text, not a number; give a number in ohm"),
        (
            "diode_drop = 0.7",
            "diode_drop = 0.7\ndiode_dorp = 1",
            "unknown key virtual.drive.diode_dorp; did you mean diode_drop",
        ),
        ("inertia = 1.17e-4", "", r"virtual\.inertia is missing; give a number above 0 .*kg·m²"),
        ("advance_angle_degrees = 0.0", "advance_angle_degrees = 120.0", r"above -90 and below 90 ° electrical"),
        ("emf_harmonics = []", "emf_harmonics = [{ order = 4, amplitude = 0.1 }]", "odd orders from 3"),
        ("[virtual.winding]", "[virtual.windings]", r"\[virtual\.winding\] missing; see 92bl-30-25l"),
        ("[virtual]\n", "[virtuel]\n", "unknown key virtuel"),
        ("pole_pairs = 4\n\n", "pole_pairs = 5\n\n", "nameplate.pole_pairs = 5 and virtual.pole_pairs = 4"),
    ],
)
def test_file_refused(tmp_path: Path, old: str, new: str, message: str) -> None:
    with pytest.raises(InputError, match=message):
        load_drive(changed(tmp_path, old, new))


def test_a_motor_without_a_drive_and_no_motor_at_all() -> None:
    with pytest.raises(
        InputError, match=r"lg-400w: no six-step drive is described: \[virtual.winding\] and \[virtual.drive\]"
    ):
        load_drive("lg-400w")
    with pytest.raises(InputError, match="did you mean 92bl-30-25l"):
        load_drive("92bl-30-25")
    with pytest.raises(InputError, match="no such motor file"):
        load_drive("missing.toml")


def test_the_file_says_what_the_drive_is() -> None:
    drive = load_drive(EXAMPLE)
    assert (drive.connection, drive.pole_pairs, drive.resistance) == ("delta", 4, 0.1146)
    assert (drive.emf_constant, drive.source_voltage, drive.source_resistance) == (0.0613, 24.32, 0.124)


def test_another_source_voltage_is_solved(capsys: pytest.CaptureFixture[str]) -> None:
    six_step(EXAMPLE, load=[0.5], voltage=12.0, json=True)
    (point,) = json.loads(capsys.readouterr().out)["points"]
    assert point["source_voltage"] == 12.0
    assert 1400.0 < point["speed_rpm"] < 1480.0
    with pytest.raises(InputError, match=r"--voltage -1.*greater than 0"):
        six_step(EXAMPLE, load=[0.5], voltage=-1.0)
