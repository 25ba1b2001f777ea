"""Faults from a file and from flags: what is taken, and what is said of what is not."""

import json
import subprocess
import sys
from pathlib import Path
from typing import Any

import pytest

from bench.i18n.errors import InputError, UsageError
from bench.journal.journal_file import read_journal
from bench.virtual.fault_file import given_faults, load_faults
from bench.virtual.fault_phrase import parse_phrase
from sim_instruments.faults.on_lines import LineFault
from tests.command_line import Call

EXAMPLE = Path(__file__).parents[3] / "docs" / "examples" / "faults.toml"


def written(tmp_path: Path, content: str) -> Path:
    file = tmp_path / "faults.toml"
    file.write_text(content, encoding="utf-8")
    return file


def test_the_example_is_taken() -> None:
    faults = load_faults(EXAMPLE)
    assert len({fault.described.fault for fault in faults}) == len(faults) > 5


def test_a_fault_is_what_the_file_says(tmp_path: Path) -> None:
    file = written(
        tmp_path,
        '[[faults]]\nfault = "late"\nrole = "supply"\npattern = "MEAS"\ntimes = 3\ndelay = 2\n'
        'step = "3.2.2/3"\nprocedure = "stator-resistance"\nafter = 0.5\nduration = 4\n',
    )
    (given,) = given_faults(file)
    assert given.described == LineFault(
        fault="late",
        role="supply",
        pattern="MEAS",
        times=3,
        delay=2.0,
        step="3.2.2/3",
        procedure="stator-resistance",
        after=0.5,
        duration=4.0,
    )
    assert given.source == f"{file}: faults[0]"


@pytest.mark.parametrize(
    ("content", "named"),
    [
        ("", "give at least one table [[faults]]"),
        ("faults = 3", "give at least one table [[faults]]"),
        ("[[fault]]\nfault = 'silence'", "unknown key fault; did you mean faults?"),
        ("[[faults]]\nrole = 'supply'", "faults[0].fault is missing; known are: "),
        ("[[faults]]\nfault = 'silense'", "faults[0].fault 'silense' is not known; did you mean silence?"),
        ("[[faults]]\nfault = 3", "faults[0].fault 3 is not known"),
        (
            "[[faults]]\nfault = 'stuck_rotor'\n[[faults]]\nfault = 'stuck_rotor'\naftr = 1",
            "unknown key faults[1].aftr; did you mean after?",
        ),
        (
            "[[faults]]\nfault = 'stuck_rotor'\nat = -1",
            "faults[0].at = -1; allowed is a number of at least 0 and up to",
        ),
        ("[[faults]]\nfault = 'stuck_rotor'\nat = nan", "faults[0].at = nan"),
        (
            "[[faults]]\nfault = 'stuck_rotor'\nstep = '9.9'",
            "faults[0]: there is no step '9.9'; motorbench procedures lists them",
        ),
        (
            "[[faults]]\nfault = 'stuck_rotor'\nstep = '3.2.2/9'",
            "faults[0]: there is no step '3.2.2/9'; did you mean 3.2.2/",
        ),
        (
            "[[faults]]\nfault = 'stuck_rotor'\nstep = '3.2.2/3'\nprocedure = 'inertia'",
            "faults[0]: inertia has no step '3.2.2/3'",
        ),
        (
            "[[faults]]\nfault = 'stuck_rotor'\nstep = '3.2.2/3'\nprocedure = 'inertial'",
            "there is no procedure 'inertial'; did you mean inertia?",
        ),
        ("[[faults]]\nfault = 'silence'\nrole = 'supply'\npattern = '('\nstep = '3.2.2/3'", "is no regular expression"),
        ("[[faults]]\nfault = 'silence'\nrole = 'supply'\npattern = '[[a]'\nstep = '3.2.2/3'", "Possible nested set"),
        ("[[faults]]\nfault = 'silence'\nrole = 'supply'\npattern = 'a{99999999999}'\nat = 1.0", "repetition number"),
        ("[[faults]]\nfault = 'silence'\nrole = 'supply'", "give pattern or count, or when it begins"),
        ("[[faults]]\nfault = 'thermal_runaway'\ntemperature = 'hot'", "faults[0].temperature = 'hot'"),
        ("not toml", "not valid TOML"),
    ],
)
def test_files_that_are_refused(tmp_path: Path, content: str, named: str) -> None:
    file = written(tmp_path, content)
    with pytest.raises(InputError) as refused:
        load_faults(file)
    assert str(refused.value).startswith(f"{file}: ")
    assert named in str(refused.value)


@pytest.mark.parametrize(
    ("phrase", "table"),
    [
        ("stuck_rotor", {"fault": "stuck_rotor"}),
        ("supply: silence at step 3.2.2/3", {"role": "supply", "fault": "silence", "step": "3.2.2/3"}),
        ("motor-unplugged at 12.5s", {"fault": "motor_unplugged", "at": 12.5}),
        (
            "supply: late on 'MEAS:CURR' times=2 delay=3.5 at step 3.2.2/3 of stator-resistance after 1 s for 20",
            {
                "role": "supply",
                "fault": "late",
                "pattern": "MEAS:CURR",
                "times": 2,
                "delay": 3.5,
                "step": "3.2.2/3",
                "procedure": "stator-resistance",
                "after": 1.0,
                "duration": 20.0,
            },
        ),
        (
            "open_phase terminal=A when supply 'OUTP ON'",
            {"fault": "open_phase", "terminal": "A", "message": {"role": "supply", "pattern": "OUTP ON"}},
        ),
        (
            "lcr_meter: half on FETC times=always",
            {"role": "lcr_meter", "fault": "half", "pattern": "FETC", "times": "always"},
        ),
        ("swapped pair=['A','B']", {"fault": "swapped", "pair": "[A,B]"}),
    ],
)
def test_phrases(phrase: str, table: dict[str, Any]) -> None:
    assert parse_phrase(phrase) == table


@pytest.mark.parametrize(
    ("phrase", "named"),
    [
        ("stuck_rotor at", "something is missing after 'at'"),
        ("stuck_rotor at noon", "'noon' is no time in seconds"),
        ("stuck_rotor soon", "'soon' does not fit"),
        ("stuck_rotor at 1 at 2", "at is given twice"),
        ("stuck_rotor 'at", "No closing quotation"),
    ],
)
def test_phrases_that_are_refused(phrase: str, named: str) -> None:
    with pytest.raises(UsageError) as refused:
        parse_phrase(phrase)
    assert named in str(refused.value)
    assert "[ROLE:] FAULT" in str(refused.value)


def test_a_fault_of_an_instrument_that_no_bench_has_lists_those_there_are() -> None:
    with pytest.raises(InputError) as refused:
        given_faults(None, ["toaster: silence"])
    said = str(refused.value)
    assert said.startswith(
        "--fault \"toaster: silence\": there is no instrument 'toaster'; known are: drive, dynamometer, "
    )
    assert said.endswith("voltmeter")


def test_an_empty_phrase_says_what_faults_there_are() -> None:
    with pytest.raises(InputError, match="fault is missing; known are: bus_off"):
        given_faults(None, [""])


RUN = ("run", "stator-resistance", "--motor", "lg-400w")


def test_on_a_real_station_faults_are_refused(call: Call, tmp_path: Path) -> None:
    station = tmp_path / "station.toml"
    station.write_text('[station]\nname = "real"\n[instruments.lcr_meter]\ndriver = "manual"\n', encoding="utf-8")
    code, _, said = call(*RUN, "--station", str(station), "--fault", "stuck_rotor")
    assert code == 2
    assert f"--faults, --fault: {station} is no virtual bench" in said
    assert not (tmp_path / "runs").exists()


def test_what_the_bench_cannot_have_is_refused_before_the_run(call: Call, tmp_path: Path) -> None:
    code, _, said = call(*RUN, "--station", "virtual", "--fault", "drive: silence at 1")
    assert code == 2
    assert "--fault \"drive: silence at 1\": role 'drive' is unknown; the bench has supply" in said
    assert not (tmp_path / "runs").exists()


@pytest.mark.slow
def test_what_libraries_log_does_not_stand_between_the_lines(tmp_path: Path) -> None:
    words = ("run", "pole-pairs-inverter", "--motor", "lg-400w", "--station", "virtual", "--runs", str(tmp_path))
    done = subprocess.run(
        [sys.executable, "-m", "bench", *words, "--fault", "inverter: bus_off at step 3.1.2.2-1/1"],
        capture_output=True,
        text=True,
        timeout=60.0,
        check=False,
    )
    first, *_ = [line for line in done.stderr.splitlines() if not line.startswith("[")]
    assert first.startswith("motorbench: the run failed: pole-pairs-inverter: inverter after 'read 0x6041:00'")


def test_faults_stand_in_the_record(call: Call, tmp_path: Path) -> None:
    file = written(tmp_path, "[[faults]]\nfault = 'thermal_runaway'\ntemperature = 30\nat = 2\nduration = 3\n")
    phrase = "lcr_meter: silence at step 3.2.2/3 after 1"
    code, out, _ = call(*RUN, "--station", "virtual", "--json", "--faults", str(file), "--fault", phrase)
    assert code == 1
    result = json.loads(out)
    heat = {"fault": "thermal_runaway", "temperature": 30, "at": 2, "duration": 3}
    silence = {"fault": "silence", "role": "lcr_meter", "step": "3.2.2/3", "after": 1.0}
    assert result["faults"] == [heat, silence]
    events = read_journal(Path(result["run"]) / "journal.jsonl").events
    told = [(event.kind, event.data["fault"]) for event in events if event.kind.startswith("fault_")]
    assert sorted(told, key=str) == sorted(
        [("fault_began", heat), ("fault_mended", heat), ("fault_began", silence)], key=str
    )
    step = next(e.time for e in events if e.kind == "step_started" and e.data["step"] == "3.2.2/3")
    assert next(e.time for e in events if e.kind == "fault_began" and e.data["fault"] == silence) == step + 1.0


@pytest.mark.parametrize(
    ("phrase", "felt"),
    [
        ("supply: silence at step 3.2.2/3", False),
        ("stuck_rotor at 90000", False),
        ("lcr_meter: late on FETC delay=0.1", True),
    ],
)
def test_a_fault_that_nothing_has_felt_is_an_error(call: Call, phrase: str, felt: bool) -> None:
    arguments = ("run", "stator-resistance", "--station", "virtual", "--motor", "lg-400w", "--fault", phrase)
    status, _, said = call(*arguments)
    assert status == (0 if felt else 1)
    assert ("this fault had no effect" in said) != felt
