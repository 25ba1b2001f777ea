"""What goes to a moteus and back is recorded frame by frame, without its serial number, and repeated through its driver."""

import json
import re
from pathlib import Path
from typing import Any

from tomli_w import dumps

from bench.motor.motor_file import load_motor
from bench.traffic.anonymity import InstrumentSerials
from bench.traffic.traffic_file import TrafficLine
from drivers.interfaces import Role
from sim_instruments.catalogue import SimulatedUnit, find
from sim_instruments.server.served_bench import ServedBench
from tests.command_line import Call


def test_a_moteus_is_recorded_and_repeated(call: Call, tmp_path: Path) -> None:
    motor = load_motor("lg-400w").virtual_motor()
    unit = SimulatedUnit(find("mjbots-moteus"), "inverter", {"maximum_current": 20.0})
    station, file = tmp_path / "station.toml", tmp_path / "moteus.traffic"
    with ServedBench(motor, speedup=20.0, seed=4, units=(unit,)) as served:
        where: Any = served.addresses()["inverter"]["can"]
        address = f"can://{where['interface']}/{where['channel']}?node={where['node_id']}"
        table = {"driver": "mjbots-moteus", "address": address, "maximum_current": 5.0}
        station.write_text(dumps({"station": {"name": "x"}, "instruments": {"inverter": table}}), encoding="utf-8")
        assert call("station", "record", str(station), "--out", str(file))[0] == 0
    content = file.read_text(encoding="utf-8")
    (identity,) = re.findall(r"< [0-9A-F]+##1(2A8102[0-9A-F]{16}2BA002[0-9A-F]{24})", content)
    assert identity.endswith("2BA002" + 24 * "0")
    status, out, _ = call("station", "replay", str(file), "--json")
    assert status == 0, out
    assert json.loads(out)["good"] is True


def test_an_fdcanusb_s_lines_are_crossed_out_as_well() -> None:
    line = TrafficLine(
        0.0, Role.INVERTER, "<", b"rcv 110 2a810204030100050000002ba002c9c32359f4d5e930b142736a50 E B F\r\n"
    )
    assert InstrumentSerials().crossed_out(line).content == (
        b"rcv 110 2a810204030100050000002ba002" + 24 * b"0" + b"50 E B F\r\n"
    )
