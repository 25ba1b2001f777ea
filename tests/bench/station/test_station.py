from pathlib import Path
from typing import Any

import pytest

from bench.i18n.errors import InputError
from bench.journal.journal import Journal
from bench.journal.journal_file import read_journal
from bench.motor.motor_file import load_motor
from bench.operators.answers import Answers, AnswersPrompt
from bench.safety.station_instruments import StationInstruments
from bench.station.clock import ReplayClock, SystemClock
from bench.station.station_file import Station, load_station
from bench.station.visa_library import StationVisa
from bench.virtual.virtual_station import describe, virtual_station
from drivers.bases.oscilloscope_data import OscilloscopeOptions
from drivers.interfaces import CommunicationError, InstrumentError, Waveform
from procedures.core.bench import Role
from sim_instruments.bench import ROLES

GOOD = """
[station]
name = "Bench 1"

[instruments.supply]
driver = "keysight-e36300"
address = "TCPIP0::192.0.2.7::inst0::INSTR"
channel = 2
maximum_current = 5.0

[instruments.oscilloscope]
driver = "keysight-infiniivision"
address = "TCPIP0::192.0.2.8::inst0::INSTR"
[instruments.oscilloscope.probes.1]
kind = "V"
attenuation = 10
[instruments.oscilloscope.probes.4]
kind = "A"
attenuation = 20.0
gain = 0.01

[instruments.tachometer]
driver = "manual"
accuracy = { resolution = 0.1, source = "manual" }
"""


def read(path: Path, content: str) -> Station:
    path.write_text(content, encoding="utf-8")
    return load_station(path)


def test_what_is_no_file_that_a_person_wrote_is_refused() -> None:
    with pytest.raises(InputError, match="larger than 16 MiB; no station file is that large"):
        load_station(Path("/dev/zero"))
    with pytest.raises(InputError, match="is not the name of a station file"):
        load_station(Path("a\0b"))
    with pytest.raises(InputError, match="the name is too long"):
        load_station(Path("x" * 300))


def test_a_station_is_read(tmp_path: Path) -> None:
    station = read(tmp_path / "station.toml", GOOD)
    assert station.name == "Bench 1"
    supply: Any = station.entries[Role.SUPPLY].options
    assert (supply.channel, supply.maximum_current, supply.maximum_voltage) == (2, 5.0, None)
    scope = station.entries[Role.OSCILLOSCOPE].options
    assert isinstance(scope, OscilloscopeOptions)
    assert scope.probes[4].kind.value == "A"
    assert scope.probes[4].gain == 0.01
    tachometer: Any = station.entries[Role.TACHOMETER].options
    assert tachometer.accuracy.source == "manual"


@pytest.mark.parametrize(
    ("old", "new", "parts"),
    [
        ("[instruments.supply]", "[instruments.suply]", ["unknown key instruments.suply", "did you mean supply"]),
        ("keysight-e36300", "keysight-e3630", ["instruments.supply.driver", "did you mean keysight-e36300"]),
        ("maximum_current = 5.0", "maximum_curent = 5.0", ["instruments.supply.maximum_curent", "maximum_current"]),
        ("maximum_current = 5.0", 'maximum_current = "5 A"', ["instruments.supply.maximum_current = '5 A'"]),
        ("channel = 2", "channel = 2.5", ["instruments.supply.channel = 2.5"]),
        ('address = "TCPIP0::192.0.2.7::inst0::INSTR"', "", ["instruments.supply.address is missing"]),
        ('kind = "V"', 'kind = "volt"', ["instruments.oscilloscope.probes", "kind = 'volt'", "'V' or 'A'"]),
        ("gain = 0.01", "gian = 0.01", ["instruments.oscilloscope.probes", "gian", "did you mean gain"]),
        ("probes.1]", "probes.A]", ["instruments.oscilloscope.probes is given for each channel by its number"]),
        ("resolution = 0.1", "gain = 0.5", ["accuracy.gain = 0.5; allowed is", "below 0.2", "0.005 is 0.5 %"]),
        ("gain = 0.01", "gain = 1", ["instruments.oscilloscope.probes", "below 0.2", "0.005 is 0.5 %"]),
        ("resolution = 0.1", "resolutoin = 0.1", ["instruments.tachometer.accuracy.resolutoin", "resolution"]),
        ("[station]\nname", "[station]\nnam", ["station.name is missing", "did you mean name"]),
        ("[station]", "[stations]", ["unknown key stations; did you mean station"]),
    ],
)
def test_each_fault_is_named(tmp_path: Path, old: str, new: str, parts: list[str]) -> None:
    assert old in GOOD
    path = tmp_path / "station.toml"
    with pytest.raises(InputError) as error:
        read(path, GOOD.replace(old, new, 1))
    for part in [str(path), *parts]:
        assert part in str(error.value)


def test_the_virtual_bench_is_a_station_like_any_other() -> None:
    roles = list(ROLES)
    station = virtual_station(dict.fromkeys(roles, "somewhere"))
    assert {role.value for role in station.entries} == set(ROLES)
    assert (
        describe({"inverter": {"interface": "virtual", "channel": "c", "node_id": 5}})["instruments"]["inverter"][
            "address"
        ]
        == "can://virtual/c?node=5"
    )
    # Addresses differ from start to start, and a run is resumed all the same.
    assert station.sha256 == virtual_station(dict.fromkeys(roles, "elsewhere")).sha256


class NoVisa(StationVisa):
    def manager(self) -> Any:
        raise CommunicationError("VISA", "no library")


class Nowhere:
    def store(self, name: str, waveform: Waveform) -> str:
        return ""


def instruments_of(station: Station, journal: Journal, answers: dict[str, Any], *, trace: bool = False) -> Any:
    given = Answers(answers, "answers.toml")
    return StationInstruments(
        station,
        load_motor("lg-400w").nameplate,
        ReplayClock(),
        journal,
        Nowhere(),
        NoVisa("@py"),
        lambda role: AnswersPrompt(given, role.value),
        trace=trace,
    )


def test_instruments_open_when_first_used(tmp_path: Path) -> None:
    station = read(tmp_path / "station.toml", GOOD)
    journal = Journal(tmp_path / "journal.jsonl", lambda: 0.0)
    instruments = instruments_of(station, journal, {"tachometer": {"speed": [1600]}})
    handed = instruments.available()
    assert set(handed) == {Role.SUPPLY, Role.OSCILLOSCOPE, Role.TACHOMETER}
    assert instruments.opened() == {}
    assert handed[Role.TACHOMETER].measure_speed().value == pytest.approx(167.55, abs=0.01)
    assert list(instruments.opened()) == [Role.TACHOMETER]
    instruments.open(Role.LCR_METER)
    with pytest.raises(InstrumentError, match="no library"):
        instruments.open(Role.SUPPLY)
    assert instruments.close() == []
    journal.close()
    kinds = [event.kind for event in read_journal(tmp_path / "journal.jsonl").events]
    assert kinds == ["instrument_opened", "reading", "instrument_error"]


def test_one_that_cannot_be_closed_does_not_keep_the_next_open(tmp_path: Path, kit: Any, trace: list[str]) -> None:
    station = read(tmp_path / "station.toml", GOOD)
    journal = Journal(tmp_path / "journal.jsonl", lambda: 0.0)
    instruments = instruments_of(station, journal, {})
    first, second = kit.FakeInstrument("supply", trace), kit.FakeInstrument("oscilloscope", trace)
    first.failing["close"] = OSError("gone")
    instruments._opened = {Role.SUPPLY: first, Role.OSCILLOSCOPE: second}
    assert instruments.close() == ["supply could not be closed: gone"]
    assert trace == ["supply.close", "oscilloscope.close"]
    journal.close()


def test_clocks_count() -> None:
    replay, system = ReplayClock(), SystemClock()
    replay.sleep(3600.0)
    assert replay.now() == 3600.0
    before = system.now()
    system.sleep(0.0)
    system.sleep(1e-4)
    assert system.now() >= before + 1e-4


DOWN = """
[[way_down]]
do = "voltage_decayed"
role = "supply"
below = 2.5
[[way_down]]
do = "output_off"
role = "supply"
"""


def test_a_station_has_its_way_down(tmp_path: Path) -> None:
    usual = read(tmp_path / "usual.toml", GOOD).way_down
    assert usual.by_hand == {Role.TACHOMETER}
    assert Role.TACHOMETER in {item.role for item in usual.items}
    own = read(tmp_path / "own.toml", GOOD + DOWN).way_down
    assert next((item.do.value, item.role, item.below, item.within) for item in own.items) == (
        "voltage_decayed", Role.SUPPLY, 2.5, 5.0,
    )  # fmt: skip


@pytest.mark.parametrize(
    ("old", "new", "parts"),
    [
        ('do = "output_off"', 'do = "output_of"', ["way_down[1].do = 'output_of'", "'output_off'"]),
        ('do = "output_off"', 'do = "disable"', ["way_down[1]: disable is not possible for supply", "inverter, drive"]),
        ('[[way_down]]\ndo = "output_off"\nrole = "supply"', "", ["leaves [instruments.supply] energised"]),
        ("below = 2.5", "below = -1", ["way_down[0].below = -1", "above 0"]),
        ("below = 2.5", "belw = 1", ["way_down[0].belw", "did you mean below"]),
        ('role = "supply"\nbelow = 2.5', 'role = "voltmeter"', ["way_down[0].role", "no [instruments.voltmeter]"]),
    ],
)
def test_each_fault_of_a_way_down_is_named(tmp_path: Path, old: str, new: str, parts: list[str]) -> None:
    with pytest.raises(InputError) as refused:
        read(tmp_path / "station.toml", (GOOD + DOWN).replace(old, new))
    assert all(part in str(refused.value) for part in parts), str(refused.value)
