"""What is no serial port, or cannot be opened, is said in one sentence with what to do, whatever speaks over it."""

import errno
import fcntl
import os
from collections.abc import Callable
from pathlib import Path
from typing import Any

import pytest
import serial

from drivers.catalogue import Surroundings
from drivers.interfaces import CommunicationError
from drivers.lutron.options import LutronTachometerOptions
from drivers.lutron.tachometer import LutronTachometer
from drivers.transport.can.buses import CanBuses
from drivers.transport.modbus.line import open_line
from drivers.transport.serial.port_errors import reason_and_remedy
from tests.command_line import Call

LISTED = "Give a serial port; motorbench station scan lists those of this computer"
ABSENT = "Connect the adapter; motorbench station scan lists the serial ports of this computer"


def modbus(path: str, clock: Any) -> Any:
    return open_line(f"rtu://{path}?baudrate=19200", "drive")


def tachometer(path: str, clock: Any) -> Any:
    return LutronTachometer.open(path, LutronTachometerOptions(), Surroundings(clock), "tachometer")


def can_adapter(path: str, clock: Any) -> Any:
    return CanBuses().node(f"can://slcan/{path}?node=5", "inverter")


@pytest.fixture(params=[modbus, tachometer, can_adapter])
def opening(request: pytest.FixtureRequest) -> Callable[[str, Any], Any]:
    made: Callable[[str, Any], Any] = request.param
    return made


def said(opening: Callable[[str, Any], Any], path: str, clock: Any) -> str:
    with pytest.raises(CommunicationError) as refused:
        opening(path, clock)
    return str(refused.value)


def test_a_device_that_is_no_serial_port(opening: Callable[[str, Any], Any], clock: Any) -> None:
    told = said(opening, "/dev/null", clock)
    assert "/dev/null" in told
    assert told.endswith(f"(it is no serial port). {LISTED}")


def test_a_file_and_a_folder(opening: Callable[[str, Any], Any], clock: Any, tmp_path: Path) -> None:
    plain = tmp_path / "plain"
    plain.touch()
    assert said(opening, str(plain), clock).endswith(f"(it is no serial port). {LISTED}")
    assert said(opening, str(tmp_path), clock).endswith(f"(it is a folder, not a serial port). {LISTED}")


def test_nothing_there(opening: Callable[[str, Any], Any], clock: Any) -> None:
    assert said(opening, "/dev/nothing", clock).endswith(f"(there is no such file or folder). {ABSENT}")


def test_a_port_that_another_program_has(clock: Any) -> None:
    ours, theirs = os.openpty()
    fcntl.flock(theirs, fcntl.LOCK_EX)
    try:
        told = said(modbus, os.ttyname(theirs), clock)
    finally:
        os.close(ours)
        os.close(theirs)
    assert told.endswith("(another program has it open). End the program that has it open")


def test_a_port_that_the_user_may_not_open() -> None:
    error = serial.SerialException(errno.EACCES, "could not open port /dev/ttyUSB0: [Errno 13] Permission denied")
    reason, remedy = reason_and_remedy(error)
    assert str(reason) == "permission denied"
    assert str(remedy) == "Add yourself to the group of the port (often dialout) and log in anew"


@pytest.mark.parametrize("words", [("--serial", "/dev/null"), ("--modbus", "/dev/null"), ("--can", "slcan//dev/null")])
def test_a_scan_says_it_too_and_asks_once(call: Call, words: tuple[str, str]) -> None:
    code, out, _ = call("station", "scan", *words, "--named-only", "--language", "en")
    assert code == 0
    assert "it is no serial port" in out
    assert "ioctl" not in out
    assert out.count("units 1 to 16") == (words[0] == "--modbus")
