import json
import os
import signal
import socket
import subprocess
import sys
from pathlib import Path
from typing import Any

import pytest

from bench.motor.motor_file import load_motor
from bench.motor.shipped_motors import shipped_motors
from tests.command_line import Call

ROOT = Path(__file__).parents[3]
LG = (ROOT / "bench" / "motors" / "lg-400w.toml").read_text(encoding="utf-8")


MANUAL = """
[station]
name = "By hand"
[instruments.oscilloscope]
driver = "manual"
probes = { 1 = "V", 2 = "V", 3 = "V", 4 = "A" }
frequency_accuracy = { gain = 1e-4, source = "assumed" }
[instruments.tachometer]
driver = "manual"
accuracy = { offset = 0.1, source = "assumed" }
[instruments.dynamometer]
driver = "manual"
maximum_speed = 600.0
maximum_torque = 5.0
"""


@pytest.fixture
def by_hand(tmp_path: Path) -> Path:
    path = tmp_path / "station.toml"
    path.write_text(MANUAL, encoding="utf-8")
    return path


@pytest.fixture
def answers(tmp_path: Path) -> Path:
    path = tmp_path / "answers.toml"
    path.write_text(
        "[readings]\ntachometer.speed = [1600]\noscilloscope.frequency = [53.76]\n",
        encoding="utf-8",
    )
    return path


def test_help_version_and_usage(call: Call) -> None:
    assert call("--version")[1].strip() == "0.1.0"
    code, out, _ = call("--help")
    assert code == 0
    for command in ("demo", "run", "procedures", "analyze", "sim", "results", "station", "doctor"):
        assert command in out
    assert "To begin, without any instrument: motorbench demo" in call()[1]
    assert call("results") == call("results", "list")
    for wrong in (
        ["bogus"],
        ["run", "--bogus"],
        ["results", "--bogus"],
        ["run"],
        ["analyze", "back-emf"],
        ["demo", "--seed", "x"],
    ):
        code, out, err = call(*wrong)
        assert code == 2
        assert err.startswith("motorbench: ")
        assert out == ""


@pytest.mark.parametrize(
    ("old", "new", "said"),
    [
        ("rated_current = 29.0", "rated_curent = 29.0", "did you mean rated_current"),
        ("rated_current = 29.0", "rated_current = 0", "nameplate.rated_current = 0; allowed is a number above 0"),
        ("[0.0163, 0.0159, 0.0158]", "-0.016", "virtual.phase_resistance = -0.016"),
        ("[0.0163, 0.0159, 0.0158]", '"16 mOhm"', "give a number in ohm"),
    ],
)
def test_a_bad_motor_file_is_one_clear_message(call: Call, tmp_path: Path, old: str, new: str, said: str) -> None:
    path = tmp_path / "motor.toml"
    path.write_text(LG.replace(old, new), encoding="utf-8")
    code, out, err = call("demo", "--motor", str(path))
    assert (code, out) == (2, "")
    assert str(path) in err
    assert said in err
    assert not (tmp_path / "runs").exists()
    code, out, err = call("demo", "--motor", str(path), "--json")
    assert code == 2
    assert said in json.loads(out)["error"]


def test_a_motor_without_truth_cannot_be_simulated(call: Call, tmp_path: Path) -> None:
    path = tmp_path / "plate.toml"
    path.write_text('[nameplate]\nname = "B"\nconnection = "delta"\nrated_current = 5\n', encoding="utf-8")
    code, _, err = call("demo", "--motor", str(path))
    assert code == 2
    assert "add a table [virtual]" in err


@pytest.mark.parametrize(
    ("arguments", "code", "said"),
    [
        (["run", "nameplate", "--station", "virtual"], 2, "--station FILE|virtual and --motor FILE are needed"),
        (["run", "nameplat", "--station", "virtual", "--motor", "lg-400w"], 2, "did you mean nameplate"),
        (["run", "nameplate", "--station", "nothing.toml", "--motor", "lg-400w"], 2, "no such station file"),
        (["run", "nameplate", "--station", "virtual", "--motor", "lg-400w", "--operator", "me"], 2, "--operator me"),
        (["run", "nameplate", "--station", "virtual", "--motor", "lg-400w", "--operator", "answers"], 2, "go together"),
        (["run", "nameplate", "--station", "virtual", "--motor", "lg-400w", "--language", "de"], 2, "--language de"),
        (["run", "nameplate", "--resume", "nothing"], 2, "no run was found here"),
        (["results", "nothing"], 2, "no run was found here"),
        (["analyze", "back-emf", "nothing.csv"], 2, "nothing.csv"),
        (["analyze", "back-emf", "x.csv", "--scale", "CHAN3"], 2, "give NAME=FACTOR"),
        (["station", "check", "nothing.toml"], 2, "no such station file"),
        (["demo", "--seed", "-1"], 2, "--seed"),
        (["run", "nameplate", "--station", "virtual", "--motor", "lg-400w", "--seed", "-1"], 2, "--seed"),
        (["serve", "--virtual", "--port", "99999"], 2, "--port 99999: allowed are 1 to 65535"),
    ],
)
def test_what_cannot_be_is_said_plainly(call: Call, arguments: list[str], code: int, said: str) -> None:
    given, out, err = call(*arguments)
    assert given == code
    assert said in err
    assert out == ""


def test_a_port_that_is_taken_is_named(call: Call) -> None:
    with socket.create_server(("127.0.0.1", 0)) as taken:
        port = taken.getsockname()[1]
        code, _, err = call("serve", "--virtual", "--port", str(port))
    assert code == 1
    assert f"cannot listen on 127.0.0.1:{port}" in err


def test_a_file_is_no_folder_of_runs(call: Call, tmp_path: Path) -> None:
    (file := tmp_path / "runs").touch()
    code, _, err = call("run", "nameplate", "--station", "virtual", "--motor", "lg-400w", "--runs", str(file))
    assert code == 1
    assert f"{file}: is a file" in err


def test_a_run_on_the_virtual_bench(call: Call, tmp_path: Path) -> None:
    arguments = ["run", "nameplate", "pole-pairs-static", "--station", "virtual", "--motor", "lg-400w", "--seed", "5"]
    code, out, err = call(*arguments, "--json", "--trace")
    result = json.loads(out)
    assert code == 0
    assert result["status"] == "completed"
    assert result["parameters"]["pole_pairs"]["value"] == 4
    assert result["parameters"]["pole_pairs"]["truth"] == 4
    assert result["parameters"]["maximum_current"]["source"] == "data sheet"
    assert result["bench_time"] > 10.0
    assert "§3.1.2.1/3  Mark every stable position" in err
    folder = Path(result["run"])
    assert json.loads((folder / "result.json").read_text(encoding="utf-8")) == result
    kinds = [json.loads(line)["kind"] for line in (folder / "journal.jsonl").read_bytes().splitlines()]
    assert {"run_started", "energising", "de_energised", "traffic", "made_safe", "run_finished"} <= set(kinds)
    code, shown, _ = call("results", result["run"], "--json")
    assert code == 0
    again = json.loads(shown)
    assert (again.pop("torn"), again.pop("guardian")) == (False, [])
    assert again == result
    code, other, _ = call(*arguments, "--json")
    marks = "procedures", "pole-pairs-static", "findings", "marked_angles"
    first, second = result, json.loads(other)
    for key in marks:
        first, second = first[key], second[key]
    assert first == second


def test_the_summary_of_a_run(call: Call) -> None:
    code, out, _ = call("run", "pole-pairs-static", "--station", "virtual", "--motor", "lg-400w", "--language", "zh")
    assert code == 0
    assert "极对数" in out
    # Shown again it took as long, and the hands with it.
    times = next(line for line in out.splitlines() if "其中手工" in line)
    assert "手工 0 s" not in times
    assert times in call("results", "latest", "--language", "zh")[1].splitlines()
    assert "运行：" in out


def test_a_typed_replay(call: Call, by_hand: Path, answers: Path) -> None:
    code, out, err = call(
        "run", "pole-pairs-back-emf", "--station", str(by_hand), "--motor", "lg-400w",
        "--operator", "answers", "--answers", str(answers), "--json",
    )  # fmt: skip
    result = json.loads(out)
    assert (code, result.get("cause")) == (0, None), err
    assert result["parameters"]["pole_pairs"]["value"] == 2
    assert "truth" not in result["parameters"]["pole_pairs"]


def test_answers_that_run_out_fail_the_run_and_it_is_resumed(call: Call, by_hand: Path, tmp_path: Path) -> None:
    short = tmp_path / "short.toml"
    short.write_text("[readings]\ntachometer.speed = [1600]\n", encoding="utf-8")
    code, out, err = call(
        "run", "nameplate", "pole-pairs-back-emf", "--station", str(by_hand), "--motor", "lg-400w",
        "--operator", "answers", "--answers", str(short), "--json",
    )  # fmt: skip
    result = json.loads(out)
    assert code == 1
    assert result["status"] == "failed"
    assert "no answers for oscilloscope.frequency" in result["cause"]
    assert "--resume" in err
    full = tmp_path / "full.toml"
    full.write_text("[readings]\ntachometer.speed = [1600]\noscilloscope.frequency = [53.76]\n", encoding="utf-8")
    resume = ["run", "--resume", result["run"], "--operator", "answers", "--answers", str(full), "--json"]
    by_hand.write_text(MANUAL.replace("600.0", "500.0"), encoding="utf-8")
    code, out, _ = call(*resume)
    assert code == 2
    assert "the station file" in json.loads(out)["error"]
    assert "is not the one this run began with" in json.loads(out)["error"]
    by_hand.write_text(MANUAL, encoding="utf-8")
    code, out, _ = call(*resume)
    again = json.loads(out)
    assert (code, again["status"]) == (0, "completed")
    assert set(again["procedures"]) == {"nameplate", "pole-pairs-back-emf"}
    assert "cause" not in again


def test_a_missing_instrument_is_named_before_anything_happens(call: Call, by_hand: Path, tmp_path: Path) -> None:
    code, _, err = call("run", "stator-resistance", "--station", str(by_hand), "--motor", "lg-400w")
    assert code == 2
    assert f"{by_hand}: stator-resistance: it needs [instruments.lcr_meter]" in err
    assert not (tmp_path / "runs").exists()


def test_station_check_names_who_does_not_answer(call: Call, tmp_path: Path, by_hand: Path) -> None:
    code, out, _ = call("station", "check", str(by_hand))
    assert code == 0
    assert "tachometer read by hand" in out
    dead = tmp_path / "dead.toml"
    dead.write_text(
        '[station]\nname = "S"\n[instruments.dynamometer]\ndriver = "delta-dyn200"\naddress = "tcp://127.0.0.1:9"\n'
        "maximum_speed = 100.0\n",
        encoding="utf-8",
    )
    code, out, _ = call("station", "check", str(dead), "--json")
    assert code == 1
    assert "cannot be opened at tcp://127.0.0.1:9" in json.loads(out)["instruments"]["dynamometer"]["error"]


def test_procedures_list_their_steps(call: Call) -> None:
    code, out, _ = call("procedures", "--json")
    listed: dict[str, Any] = json.loads(out)["procedures"]
    assert code == 0
    resistance = listed["stator-resistance"]
    assert resistance["section"] == "3.2"
    assert resistance["roles"] == ["lcr_meter"]
    assert [step["id"] for step in resistance["steps"]][:2] == ["3.2.2/1", "3.2.2/2"]
    assert any(step["by_hand"] for step in resistance["steps"])
    assert resistance["settings"]["frequency"] == {"default": 20.0, "unit": "Hz", "description": "test frequency, Hz"}
    code, out, _ = call("procedures", "stator-resistance", "inertia", "--json")
    assert json.loads(out)["procedures"] == {name: listed[name] for name in ("stator-resistance", "inertia")}
    code, out, err = call("procedures", "inertai", "--language", "en")
    assert (code, out) == (2, "")
    assert "'inertai': did you mean inertia?" in err
    code, out, _ = call("procedures", "--language", "zh")
    assert "定子电阻" in out


def test_doctor_reports(call: Call) -> None:
    code, out, _ = call("doctor", "--json")
    found = json.loads(out)
    assert found["libraries"]["numpy"]
    assert "@py" in found["visa_backends"]
    assert found["guardian"]["said"].startswith("the guardian has ")
    assert code == (1 if found["problems"] else 0)
    told = call("doctor")[1]
    assert "PyVISA" in told
    assert f"Guardian: {found['guardian']['said']}" in told


def test_doctor_judges_a_stations_own_addresses(call: Call, tmp_path: Path) -> None:
    file = tmp_path / "station.toml"
    file.write_text(
        """[station]
name = "far away"

[instruments.supply]
driver = "keysight-e36300"
address = "USB0::0x2A8D::0x1202::NOBODY::0::INSTR"

[instruments.tachometer]
driver = "lutron-tachometer"
address = "/dev/nowhere"
""",
        encoding="utf-8",
    )
    code, out, _ = call("doctor", str(file))
    assert code == 1
    assert "✗ tachometer at /dev/nowhere: /dev/nowhere does not exist" in out.replace("\n", " ")
    assert "✗ supply at USB0::" in out
    assert "Nothing is missing" not in out
    code, out, _ = call("doctor", str(file), "--json")
    told = json.loads(out)
    assert code == 1
    # What stands beside an instrument is among what is wrong.
    assert all(
        any(said in problem for problem in told["problems"]) for one in told["station"] for said in one["problems"]
    )


def test_every_shipped_motor_is_listed_when_none_fits(call: Call) -> None:
    _, _, err = call("demo", "--motor", "zzz")
    for name in shipped_motors():
        assert name in err


def test_a_terminated_process_ends_safely(tmp_path: Path, by_hand: Path) -> None:
    command = [
        sys.executable,
        "-m",
        "bench",
        "run",
        "pole-pairs-back-emf",
        "--station",
        str(by_hand),
        "--motor",
        "lg-400w",
    ]
    process = subprocess.Popen(
        command, cwd=tmp_path, stdin=subprocess.PIPE, stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True,
        env={**os.environ, "PYTHONPATH": str(ROOT), "LANG": "C.UTF-8"},
    )  # fmt: skip
    assert process.stderr is not None
    said = ""
    while "Enter" not in said:
        character = process.stderr.read(1)
        assert character, said
        said += character
    process.send_signal(signal.SIGTERM)
    out, err = process.communicate(timeout=20)
    assert process.returncode == 1
    assert "Traceback" not in said + out + err
    assert "SIGTERM" in err
    (folder,) = (tmp_path / "runs").iterdir()
    result = json.loads((folder / "result.json").read_text(encoding="utf-8"))
    assert result["status"] == "aborted"


def test_a_fault_of_the_program_is_still_a_message(call: Call, monkeypatch: pytest.MonkeyPatch) -> None:
    def broken(reference: str) -> None:
        raise ZeroDivisionError("division by zero")

    monkeypatch.setattr("bench.cli.demo.load_motor", broken)
    code, _, err = call("demo")
    assert code == 1
    assert "program error: ZeroDivisionError" in err
    assert load_motor("lg-400w").nameplate.name == "LG-400W"


def test_help_and_refusals_in_chinese(call: Call, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setenv("LC_ALL", "zh_CN.UTF-8")
    code, out, _ = call("run", "--help")
    assert code == 0
    assert "用法：motorbench run [选项] [参数…]" in out
    assert "操作人员姓名，写入记录。" in out
    assert "[默认：auto]" in out
    assert call() == call("--help")
    assert "永磁电机测试台" in call("station", "--help", "--language", "zh")[1] + call()[1]
    assert "测试台文件。" in call("station", "check", "--help")[1]
    for wrong, said in (
        (["run", "--stat"], "未知选项：--stat。您是否要用 --station？"),
        (["rnu"], "未知命令“rnu”。您是否要用 run？"),
        (["demo", "--seed", "x"], "--seed：“x”不是整数。"),
        (["demo", "--seed", "-1"], "--seed 不能为 -1。必须 >= 0。"),
        (["demo", "--seed"], "--seed 需要一个值。"),
    ):
        code, out, err = call(*wrong)
        assert (code, out) == (2, "")
        assert said in err
    monkeypatch.setenv("LC_ALL", "C")
    assert "Usage: motorbench run [OPTIONS] [ARGS...]" in call("run", "--help")[1]
    assert "Unknown option: --stat. Did you mean --station?" in call("run", "--stat")[2]
