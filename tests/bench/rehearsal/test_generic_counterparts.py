"""What stands in a rehearsal for drivers that name no simulated instrument of their own."""

import json
from pathlib import Path

from tests.command_line import Call

PLUGIN = """
from dataclasses import dataclass
from drivers.catalogue import Driver
from drivers.interfaces import Role

@dataclass(frozen=True)
class Plain:
    pass

def nobody(*_):
    raise AssertionError("a rehearsal opens nothing of the station")

BRIDGE = Driver("lcr_meter-x", Role.LCR_METER, Plain, nobody, ratings={"maximum_frequency": 1000.0, "maximum_level": 1.0})
SCOPE = Driver("oscilloscope-x", Role.OSCILLOSCOPE, Plain, nobody)
DYNAMOMETER = Driver("dynamometer-x", Role.DYNAMOMETER, Plain, nobody, ratings={"maximum_speed": 300.0})
TACHOMETER = Driver("tachometer-x", Role.TACHOMETER, Plain, nobody)
INVERTER = Driver("inverter-x", Role.INVERTER, Plain, nobody, ratings={"maximum_current": 12.0})
METER = Driver("voltmeter-x", Role.VOLTMETER, Plain, nobody)
SUPPLY = Driver("supply-x", Role.SUPPLY, Plain, nobody)
"""
ROLES = ("lcr_meter", "oscilloscope", "dynamometer", "tachometer", "inverter", "voltmeter", "supply")


def test_every_role_is_rehearsed_and_what_stands_for_it_is_said(call: Call, tmp_path: Path) -> None:
    (tmp_path / "plugin.py").write_text(PLUGIN, encoding="utf-8")
    tables = (f'[instruments.{role}]\ndriver = "{role}-x"\naddress = "TCPIP::192.0.2.1::INSTR"\n' for role in ROLES)
    station = '[station]\nname = "s"\n[plugins]\nfiles = ["plugin.py"]\n' + "".join(tables)
    (tmp_path / "station.toml").write_text(station, encoding="utf-8")
    names = ("dq-inductance-extremes", "pole-pairs-inverter", "back-emf-constant")
    _, out, _ = call("run", *names, "--station", "station.toml", "--motor", "lg-400w", "--rehearse", "--json")
    told = json.loads(out)
    assert told["status"] == "completed", told["cause"]
    said = {role: next(one for one in told["differences"] if one.startswith(role)) for role in ROLES}
    generic = "a generic instrument with its driver's ratings is used instead, at most"
    assert f"{generic} 1000 Hz, 1 V rms; it reads as accurately as keysight-e4980a" in said["lcr_meter"]
    assert f"{generic} 300 rad/s" in said["dynamometer"]
    assert f"{generic} 12 A" in said["inverter"]
    for role in ("oscilloscope", "tachometer", "voltmeter"):
        assert (
            "which ratings cannot describe: name a simulated instrument of its own by Driver(simulated=…)" in said[role]
        )
    assert "declares no ratings" in said["supply"]
    assert "give Driver(ratings=…) maximum_voltage, maximum_current, or name" in said["supply"]
    highest = told["highest"]
    assert highest["dynamometer"]["speed"] == {"value": 300.0, "unit": "rad/s", "limit": 300.0, "whose": "the model"}
    assert highest["lcr_meter"]["frequency"] == {"value": 1000.0, "unit": "Hz", "limit": 1000.0, "whose": "the model"}
    assert highest["inverter"]["current"]["limit"] <= 12.0
