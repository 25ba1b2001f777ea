"""What tells whose instruments they are is not in a recording unless that is wanted."""

import pytest

from bench.traffic.anonymity import address_of, anonymous
from bench.traffic.replay import replay
from bench.traffic.traffic_file import SessionRecording, TrafficLine
from drivers.interfaces import Role
from tests.bench.traffic.sessions import everything, recorded


@pytest.mark.parametrize(
    ("address", "shown"),
    [
        ("TCPIP0::192.168.1.7::inst0::INSTR", "TCPIP0::lcr-meter::inst0::INSTR"),
        ("tcpip::bridge.example.com::5025::SOCKET", "tcpip::lcr-meter::5025::SOCKET"),
        ("TCPIP0::10.0.0.9", "TCPIP0::lcr-meter"),
        ("USB0::0x2A8D::0x1401::MY57201234::INSTR", "USB0::0x2A8D::0x1401::XXXX::INSTR"),
        ("GPIB0::17::INSTR", "GPIB0::17::INSTR"),
        ("ASRL/dev/ttyUSB0::INSTR", "ASRL/dev/ttyUSB0::INSTR"),
        ("tcp://192.168.1.7:502?framer=rtu", "tcp://lcr-meter:502?framer=rtu"),
        ("rtu:///dev/ttyUSB0?baudrate=9600", "rtu:///dev/ttyUSB0?baudrate=9600"),
        ("can://socketcan/can0?node=5", "can://socketcan/can0?node=5"),
        ("can://slcan/socket://10.0.0.9:2000?node=5", "can://slcan/socket://lcr-meter:2000?node=5"),
    ],
)
def test_addresses_keep_their_kind(address: str, shown: str) -> None:
    assert address_of("lcr_meter", address) == shown


def test_serial_numbers_are_crossed_out_and_the_replay_is_the_same(recording: SessionRecording) -> None:
    known = recorded(everything, identifiable=True)
    assert "MY54101234" in known.text()
    assert "MY54101234" not in recording.text()
    assert anonymous(known).text() == recording.text().replace(recording.about["made"], known.about["made"])
    for one in known, recording:
        assert all(role.difference is None for role in replay(one))


def test_a_serial_number_of_a_canopen_node() -> None:
    lines = [
        TrafficLine(0.0, Role.INVERTER, ">", b"605#4018100400000000"),
        TrafficLine(0.0, Role.INVERTER, "<", b"585#43181004A1B2C3D4"),
        TrafficLine(0.0, Role.INVERTER, "<", b"585#43181003A1B2C3D4"),
    ]
    table = {"driver": "cia402-inverter", "address": "can://socketcan/can0?node=5", "serial_number": "3569595041"}
    made = anonymous(SessionRecording({"inverter": table}, {Role.INVERTER: "can"}, lines))
    assert [line.words for line in made.lines[1:]] == ["585#4318100400000000", "585#43181003A1B2C3D4"]
    assert "serial_number" not in made.tables["inverter"]
