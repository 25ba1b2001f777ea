"""Files that people and programs write: motors, stations, answers, faults, captures, journals, results."""

import hashlib
import json
from collections.abc import Iterator
from contextlib import suppress
from functools import cache
from pathlib import Path
from typing import Any

from bench.analysis.statements import read_statements
from bench.captures import read_capture
from bench.captures.capture import Capture
from bench.eol.plan import load_plan
from bench.i18n.errors import InputError
from bench.i18n.language import translator
from bench.journal.codec import RecordedEvent, UnknownEvent, encode
from bench.journal.journal import Journal
from bench.journal.journal_file import read_journal
from bench.journal.overview import overview
from bench.journal.run_folder import RunFolder, existing_run_folder
from bench.journal.run_result import result_of
from bench.journal.run_view import view_of
from bench.journal.verify import verify
from bench.journal.waveforms import StoredWaveform, file_image
from bench.motor.motor_file import load_motor
from bench.motor.shipped_motors import shipped_motors
from bench.operators.answers import AnswersOperator, AnswersPrompt, load_answers
from bench.plugins.catalogues import installed
from bench.run.plan import make_plan
from bench.run.resume import begun, check_identities, check_unchanged
from bench.station.station_file import load_station
from bench.virtual.fault_file import given_faults, load_faults
from bench.virtual.virtual_station import virtual_station
from drivers.interfaces import InstrumentError
from drivers.interfaces.text import Translate, text
from drivers.transport.can.addresses import parse_address
from procedures.core.actions import EnterReading, MarkRestPositions
from procedures.core.bench import ProcedureError
from reports.tables.summary import summary
from tests.journals import event
from tests.studies.fuzz.target import Target, as_file, each

ERRORS = (InputError,)
ROOT = Path(__file__).parents[3]
EXAMPLES = ROOT / "docs" / "examples" / "note"


def motor_file(data: bytes) -> None:
    read = load_motor(str(as_file(data, "motor.toml")))
    with suppress(InputError):
        read.virtual_motor()


def station_file(data: bytes) -> None:
    load_station(as_file(data, "station.toml"))


def answers_file(data: bytes) -> None:
    answers = load_answers(as_file(data, "answers.toml"))
    operator, prompt = AnswersOperator(answers), AnswersPrompt(answers, "tachometer")
    each(
        [
            lambda: operator.perform(EnterReading("winding_temperature", text("temperature"), "°C", -50.0, 200.0)),
            lambda: operator.perform(MarkRestPositions(1)),
            lambda: prompt.ask(text("speed"), "rpm", 0.0, 1e5, None),
        ],
        (ProcedureError, InstrumentError, InputError),
    )


def fault_file(data: bytes) -> None:
    each(
        [
            lambda: load_faults(as_file(data, "faults.toml")),
            lambda: given_faults(None, [data.decode("utf-8", "replace")]),
        ],
        ERRORS,
    )


def typed(data: bytes) -> None:
    """What is typed at the command line and taken apart by our own hands."""
    words = data.decode("utf-8", "replace")
    known = installed().procedures
    each(
        [
            lambda: make_plan(["stator-resistance"], [words], known),
            lambda: make_plan([words], [], known),
            lambda: existing_run_folder(words, ROOT / "bench"),
            lambda: load_motor(words),
            lambda: load_station(Path(words)),
            lambda: read_capture(words),
        ],
        ERRORS,
    )
    each([lambda: parse_address(words, "inverter")], (InstrumentError,))


def eol_plan(data: bytes) -> None:
    plan = load_plan(as_file(data, "plan.toml"))
    each([lambda: plan.limits({"stator_resistance": 0.016}), lambda: plan.check_serial("SN-0001")], ERRORS)


def accuracy_file(data: bytes) -> None:
    read_statements(file=as_file(data, "scope.toml"))


def capture(data: bytes) -> None:
    read = read_capture(as_file(data, "record.csv"))
    _used(read)


def angles(data: bytes) -> None:
    _used(read_capture(as_file(data, "sweep.csv"), abscissa="angle"))


def _used(read: Capture) -> None:
    each([read.times, read.evenly_sampled, lambda: read.channel("CH1"), lambda: read.scaled({"CH1": 2.0})], ERRORS)


def hdf5_capture(data: bytes) -> None:
    _used(read_capture(as_file(b"\x89HDF\r\n\x1a\n" + data, "record.h5")))


def _folder(journal: bytes, result: bytes | None = None) -> RunFolder:
    path = as_file(journal, "journal.jsonl")
    folder = RunFolder(path.parent)
    if result is None:
        folder.result.unlink(missing_ok=True)
    else:
        folder.result.write_bytes(result)
    return folder


@cache
def _chinese() -> Translate:
    return translator("zh")


def _read(folder: RunFolder) -> None:
    """Do what is done with a run that lies on the disk."""
    chinese = _chinese()
    overview(folder)

    def shown() -> None:
        view = view_of(read_journal(folder.journal).events)
        view.as_dict(chinese)
        summary(view.parameters(), view.warnings(), view.truth, chinese, 80)

    def resumed() -> None:
        read, began = begun(folder)
        check_identities(folder, read.events, {})
        check_unchanged(folder, began, load_motor("lg-400w"), virtual_station({"supply": "x"}), {"numpy": "2"})

    each([lambda: verify(folder), shown, resumed, lambda: result_of(read_journal(folder.journal))], ERRORS)


def journal_bytes(data: bytes) -> None:
    _read(_folder(data))


def journal_events(data: bytes) -> None:
    """A journal whose chain is right, whatever its events hold: each line of the input is one, `[kind, data]`."""
    path = as_file(b"", "journal.jsonl")
    lines: list[bytes] = []
    for line in data.splitlines()[:50]:
        try:
            kind, given = json.loads(line)
            event = UnknownEvent(str(kind), {str(key): value for key, value in dict(given).items()})
            previous = hashlib.sha256(lines[-1]).hexdigest() if lines else ""
            lines.append(encode(RecordedEvent(len(lines) + 1, "", 0.0, event), previous))
        except (ValueError, TypeError, RecursionError):
            continue
    path.write_bytes(b"".join(line + b"\n" for line in lines))
    folder = RunFolder(path.parent)
    folder.result.unlink(missing_ok=True)
    _read(folder)


@cache
def _small_run() -> bytes:
    path = as_file(b"", "small.jsonl")
    journal = Journal(path, lambda: 0.0, durable=False)
    for kind, data in _EVENTS:
        journal.record(event(kind, **data))
    journal.close()
    return path.read_bytes()


def result_file(data: bytes) -> None:
    _read(_folder(_small_run(), data))


_EVENTS: tuple[tuple[str, dict[str, Any]], ...] = (
    (
        "run_started",
        {
            "run": "runs/one",
            "motor": {"name": "M", "sha256": "00", "source": "m.toml"},
            "motor_file": 'a = 1\n[nameplate]\nname = "M"\n',
            "station": {"sha256": "00", "source": "s.toml", "instruments": {}},
            "station_file": "[station]\n",
            "procedures": ["tiny"],
            "settings": [],
            "software": {"numpy": "1"},
            "language": "en",
            "seed": 0,
            "truth": {"stator_resistance": 0.016},
        },
    ),
    ("instrument_opened", {"instrument": "supply", "identity": {"model": "M1", "serial_number": "1"}}),
    ("procedure_started", {"procedure": "tiny", "section": "9", "settings": {}, "steps": {"9/1": "Do"}}),
    ("step_started", {"step": "9/1", "text": "Do", "time": 0.0}),
    ("step_finished", {"step": "9/1", "time": 1.0}),
    (
        "known_before",
        {"procedure": "", "warning": {"id": "E1", "text": {"template": "{a:.1f} V", "values": {"a": 1.5}}}},
    ),
    (
        "procedure_finished",
        {
            "result": {
                "procedure": "tiny",
                "section": "9",
                "parameters": [
                    {
                        "name": "stator_resistance",
                        "value": 0.016,
                        "unit": "Ω",
                        "standard_uncertainty": 1e-4,
                        "degrees_of_freedom": 9.0,
                        "coverage_interval": [0.0158, 0.0162],
                        "procedure": "tiny",
                        "section": "9",
                        "estimator": "none",
                        "note_value": 0.0161,
                        "convention": "",
                        "winding": None,
                        "source": "",
                        "budget": [],
                    }
                ],
                "warnings": [],
                "findings": {"temperature": 25.0},
            }
        },
    ),
    (
        "waveforms",
        {"instrument": "scope", "call": "fetch", "file": {"path": "waveforms/1.h5", "sha256": "00"}, "value": {}},
    ),
    ("clock_set_back", {"seconds": 3.5}),
    ("consistency_checked", {"warnings": []}),
    ("run_finished", {"status": "completed", "cause": "", "bench_time": 1.0, "wall_time": 1.0}),
)

CSV = (
    b"time (s),CH1 (V),CH2 (A)\n0,1.0,2.0\n1e-3,1.5,2.5\n2e-3,1.0,2.0\n",
    b"in s,C1 in V\n-1.000010E-03,1.5E-01\n-9.900090E-04,2.5E-01\n",
    b"Record Length,3.000000e+00,,  -0.050000000000,   0.16000,\nVertical Units,V,,  -0.049960000000,   0.20000,\n",
    b"0;1,5\n0,001;2,5\n",
)


@cache
def targets() -> tuple[Target, ...]:
    """Return the targets of this file."""
    return tuple(_targets())


def _targets() -> Iterator[Target]:
    motors = tuple((ROOT / "bench" / "motors" / f"{name}.toml").read_bytes() for name in shipped_motors())
    yield Target("motor-file", "motor files", motor_file, ERRORS, motors)
    stations = ((EXAMPLES / "station.toml").read_bytes(), *_STATIONS)
    yield Target("station-file", "station files", station_file, ERRORS, stations)
    answers = tuple(path.read_bytes() for path in sorted(EXAMPLES.glob("answers*.toml")))
    yield Target("answers-file", "typed readings", answers_file, ERRORS, answers)
    yield Target("fault-file", "faults, from a file and from a flag", fault_file, ERRORS, _FAULTS)
    seeds = (b"repeats=3", b"stator-resistance.frequency=20.0", b"can://socketcan/can0?node=5&bitrate=500000", b"all")
    yield Target("typed", "settings, procedures and addresses as they are typed", typed, ERRORS, seeds)
    yield Target("eol-plan", "plans of an end-of-line station", eol_plan, ERRORS, (_PLAN,))
    seeds = (b'time = "25ppm"\n[CH1]\ngain = 0.02\noffset = 0.01\n', b'current = "1% + 20mA"\n')
    yield Target("accuracy-file", "stated accuracies of a capture", accuracy_file, ERRORS, seeds)
    yield Target("capture", "captures as text", capture, ERRORS, CSV)
    yield Target("rotor-sweep", "captures over an angle", angles, ERRORS, CSV)
    ramp = StoredWaveform(_numbers(), _numbers(), "V", 0.01)
    image = file_image({"channel1": ramp, "channel2": ramp})[8:]
    yield Target("capture-hdf5", "captures as HDF5", hdf5_capture, ERRORS, (image,))
    yield Target("journal", "journals, byte by byte", journal_bytes, ERRORS, (_small_run(),))
    lines = b"\n".join(json.dumps([kind, data]).encode() for kind, data in _EVENTS)
    yield Target("journal-events", "journals whose chain is right", journal_events, ERRORS, (lines,))
    end = json.dumps({"status": "completed", "journal": {"events": len(_EVENTS), "sha256": "00" * 32}}).encode()
    yield Target("result-file", "result.json beside a whole journal", result_file, ERRORS, (end, b"{}"))


def _numbers() -> Any:
    import numpy as np

    return np.linspace(0.0, 1.0, 50)


_STATIONS = (
    b"""[station]
name = "Bench 1"
overdue = "refuse"
way_down = []
[instruments.supply]
driver = "keysight-e36300"
address = "TCPIP0::1.2.3.4::hislip0::INSTR"
channel = 1
maximum_current = 10.0
[instruments.supply.calibration]
date = 2026-01-01
due = 2027-01-01
certificate = "K-1"
[instruments.inverter]
driver = "cia402-inverter"
address = "can://socketcan/can0?node=5"
maximum_current = 30.0
maximum_frequency = 1000.0
current_scale = 1.4142
velocity_unit = "0.1 rpm"
field_current = { object = "0x2031:00", type = "u32", scale = 0.001 }
current_accuracy = { gain = 0.02, source = "x" }
[instruments.oscilloscope]
driver = "keysight-infiniivision"
address = "x"
probes = { 1 = { kind = "V", attenuation = 10.0 } }
""",
)
_PLAN = b"""[plan]
name = "LG line"
motor = "lg-400w"
serial_pattern = "SN-[0-9]{4}"
[[procedure]]
name = "stator-resistance"
on_failure = "retry"
retries = 2
settings = { repeats = 1 }
[[limit]]
parameter = "stator_resistance"
low = 0.014
high = 0.018
[[limit]]
parameter = "inertia"
percent = 10.0
of = "golden"
[golden]
inertia = 6.0e-5
"""
_FAULTS = (
    b'[[faults]]\nfault = "silence"\nrole = "supply"\npattern = "MEAS"\nat = 1.0\n',
    b"supply: silence on MEAS:CURR at step 3.2.2/3 after 0.5 for 2",
    b"lcr_meter: garbage when supply OUTP for 1s",
)
