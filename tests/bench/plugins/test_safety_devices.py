"""Relays with a watchdog and interlock contacts of one's own: in a plug-in file, by the same catalogue as drivers."""

import json
import queue
import threading
from pathlib import Path

import pytest

from bench.safety.interlocks import Interlocks
from bench.station.interlock_entries import InterlockEntry
from drivers.interfaces.text import Text
from drivers.safety_devices import InterlockDriver
from tests.command_line import Call

PLUGIN = """
from dataclasses import dataclass
from pathlib import Path
from drivers.interfaces import Watchdog, WhenSilent
from drivers.safety_devices import InterlockDriver, RelayDriver

@dataclass(frozen=True)
class DoorOptions:
    file: str = "door"

class Door:
    def __init__(self, address, options, *, name):
        self._file = Path(options.file)
    def closed(self):
        return self._file.exists()
    def close(self):
        pass

class Relay:
    watchdog = Watchdog(1.0, WhenSilent.CONTACT_OPENS, "fixed")
    def __init__(self, address, options, *, name):
        pass
    def picked_up(self):
        return False
    def pick_up(self):
        pass
    def feed(self):
        pass
    def drop_out(self):
        pass
    def close(self):
        pass

DOOR = InterlockDriver("acme-door", DoorOptions, Door, ("acme",))
RELAY = RelayDriver("acme-relay", DoorOptions, Relay)
"""
STATION = """
[station]
name = "bench"
[plugins]
files = ["plugin.py"]
[interlocks.door]
address = "acme://door1"
[watchdog_relays.enable]
driver = "acme-relay"
address = "acme://relay1"
roles = ["supply"]
[instruments.supply]
driver = "manual"
maximum_voltage = 60.0
maximum_current = 5.0
"""


@pytest.fixture
def station(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    monkeypatch.setenv("MOTORBENCH_STATE", str(tmp_path / "state"))
    (tmp_path / "plugin.py").write_text(PLUGIN, encoding="utf-8")
    (tmp_path / "station.toml").write_text(STATION, encoding="utf-8")
    return tmp_path / "station.toml"


def test_they_are_listed_checked_and_work(call: Call, station: Path) -> None:
    told = json.loads(call("station", "drivers", "--station", "station.toml", "--json")[1])
    origins = {one["name"]: one["from"]["name"] for kind in ("interlocks", "watchdog_relays") for one in told[kind]}
    assert origins == {
        "acme-door": str(station.parent / "plugin.py"),
        "acme-relay": str(station.parent / "plugin.py"),
        "beckhoff-bk9000": "motorbench",
        "can-frame": "motorbench",
        "modbus-input": "motorbench",
    }
    assert "interlock acme" in call("station", "drivers", "--station", "station.toml")[1]
    checked = json.loads(call("station", "check", "station.toml", "--json")[1])
    assert checked["interlocks"]["door"]["error"] == "it is open"
    assert checked["watchdog_relays"]["enable"] == {"address": "acme://relay1", "picked_up": False, "error": None}
    (station.parent / "door").touch()
    assert json.loads(call("station", "check", "station.toml", "--json")[1])["interlocks"]["door"]["error"] is None


@pytest.mark.parametrize(
    ("old", "new", "said"),
    [
        (
            'address = "acme://door1"',
            'address = "acme://door1"\ndriver = "acme-dor"',
            "interlocks.door.driver = 'acme-dor' is no driver",
        ),
        ('address = "acme://door1"', 'address = "acme://door1"\ndriver = "acme-dor"', "did you mean acme-door?"),
        ("acme://door1", "acne://door1", "or name the driver of another kind of contact"),
        ('"acme-relay"', '"acme-rely"', "did you mean acme-relay?"),
        ('address = "acme://door1"', 'address = "x"\ndriver = "modbus-input"\nnumber = 3', "'x' is no Modbus address"),
    ],
)
def test_one_that_there_is_not_is_refused(call: Call, station: Path, old: str, new: str, said: str) -> None:
    station.write_text(STATION.replace(old, new), encoding="utf-8")
    code, out, err = call("station", "check", "station.toml")
    assert code != 0
    assert said in out + err


@pytest.mark.parametrize(
    ("old", "new", "said"),
    [
        (
            'InterlockDriver("acme-door", DoorOptions, Door, ("acme",))',
            'InterlockDriver("modbus-input", DoorOptions, Door)',
            "the name is taken by motorbench",
        ),
        ("def closed", "def is_closed", "what driver acme-door makes, Door, is no Interlock: it has no closed"),
        ("def drop_out", "def drop", "what driver acme-relay makes, Relay, is no WatchdogRelay: it has no drop_out"),
    ],
)
def test_a_broken_one_is_named_in_a_sentence(call: Call, station: Path, old: str, new: str, said: str) -> None:
    (station.parent / "plugin.py").write_text(PLUGIN.replace(old, new), encoding="utf-8")
    code, out, err = call("station", "check", "station.toml")
    assert code != 0
    code, _, named = call("station", "drivers", "--station", "station.toml")
    assert code == 0
    assert said in " ".join((out + err + named).split())


@pytest.mark.parametrize(
    ("old", "new", "said"),
    [
        ("return self._file.exists()", "self._file.stat()", "driver acme-door: FileNotFoundError: "),
        ("return self._file.exists()", "raise SystemExit(3)", "driver acme-door: SystemExit: 3"),
        ("self._file = Path(options.file)", "raise OSError('no such port')", "driver acme-door: OSError: no such port"),
        ("        return False", "        raise OSError('no answer')", "driver acme-relay: OSError: no answer"),
    ],
)
def test_one_that_raises_anything_is_told_of(call: Call, station: Path, old: str, new: str, said: str) -> None:
    (station.parent / "plugin.py").write_text(PLUGIN.replace(old, new, 1), encoding="utf-8")
    code, out, err = call("station", "check", "station.toml")
    assert code != 0
    assert said in " ".join((out + err).split())


@pytest.mark.parametrize("error", [FileNotFoundError("the file is gone"), SystemExit(3), ZeroDivisionError()])
def test_a_contact_that_raises_anything_trips(error: BaseException) -> None:
    class Contact:
        def __init__(self, address: str, options: object, *, name: str) -> None:
            """Nothing is connected."""

        def closed(self) -> bool:
            if failing.is_set():
                raise error
            return True

        def close(self) -> None:
            """Nothing is connected."""

    failing, told = threading.Event(), queue.SimpleQueue[tuple[str, Text]]()
    driver = InterlockDriver("own", object, Contact)
    interlocks = Interlocks([InterlockEntry("door", driver, "own://door", object())])
    interlocks.watch(lambda name, how: told.put((name, how)))
    failing.set()
    name, how = told.get(timeout=10.0)
    interlocks.close()
    assert name == "door"
    assert f"silent, which counts as open (interlocks.door: driver own: {type(error).__name__}: " in str(how)
