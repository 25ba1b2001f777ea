"""What a guardian is charged with, and who needs one."""

from pathlib import Path

import pytest

from bench.i18n.errors import InputError
from bench.safety.guardian.guarded_instruments import is_shared, needs_guardian
from bench.safety.guardian.protocol import GuardianTask, charge_of, decode
from bench.station.station_file import load_station
from procedures.core.bench import Role


def test_a_charge_goes_through_the_pipe() -> None:
    charge = GuardianTask("station.toml", '[station]\nname = "Prüfstand"\n', ("drive", "supply"), "/runs/1", 0.6, 60.0)
    assert charge_of(decode(charge.line())) == charge
    with pytest.raises(ValueError, match="no message"):
        decode(b"[1]\n")


@pytest.mark.parametrize(
    ("address", "shared"),
    [
        ("TCPIP0::192.0.2.7::inst0::INSTR", True),
        ("TCPIP0::192.0.2.7::5025::SOCKET", True),
        ("tcp://192.0.2.7:502", True),
        ("can://socketcan/can0?node=5", True),
        ("can://udp_multicast/239.74.163.2?node=5", True),
        ("can://slcan/socket://192.0.2.7:3333?node=5", True),
        ("can://slcan//dev/ttyACM0?node=5", False),
        ("can://pcan/PCAN_USBBUS1?node=5", False),
        ("rtu:///dev/ttyUSB0?baudrate=9600", False),
        ("USB0::0x2A8D::0x1202::MY61000000::0::INSTR", False),
        ("GPIB0::5::INSTR", False),
    ],
)
def test_what_a_second_process_may_hold(address: str, shared: bool) -> None:
    assert is_shared(address) is shared


STATION = """
[station]
name = "Bench 1"
[guardian]
heartbeat = 1.5
[instruments.supply]
driver = "keysight-e36300"
address = "TCPIP0::192.0.2.7::inst0::INSTR"
[instruments.dynamometer]
driver = "manual"
maximum_speed = 100.0
maximum_torque = 1.0
[instruments.voltmeter]
driver = "keysight-34461a"
address = "TCPIP0::192.0.2.8::inst0::INSTR"
"""


def test_who_needs_one(tmp_path: Path) -> None:
    path = tmp_path / "station.toml"
    path.write_text(STATION, encoding="utf-8")
    station = load_station(path)
    assert (station.guardian.heartbeat, station.guardian.stalled) == (1.5, 60.0)
    assert needs_guardian(station, {Role.SUPPLY, Role.VOLTMETER})
    # What a person sets, and what feeds nothing, needs nobody.
    assert not needs_guardian(station, {Role.DYNAMOMETER, Role.VOLTMETER})
    path.write_text(STATION.replace("1.5", "0.01"), encoding="utf-8")
    with pytest.raises(InputError, match=r"guardian\.heartbeat = 0\.01; allowed is a number of at least 0\.2"):
        load_station(path)
