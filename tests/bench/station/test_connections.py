"""What a computer lacks to reach a station's instruments, by a tree of files in place of its own."""

from pathlib import Path

import pytest

from bench.station.computer import Computer
from bench.station.connections import problems
from bench.station.station_file import load_station


class Described(Computer):
    """A computer with the packages and libraries that a test names."""

    def __init__(self, root: Path, *, packages: bool = False) -> None:
        super().__init__(root)
        self.packages = packages

    def missing(self, modules):
        return [] if self.packages else list(modules.values())

    def has_library(self, *names):
        return self.packages


def write(root: Path, files: dict[str, str]) -> None:
    for path, content in files.items():
        (root / path).parent.mkdir(parents=True, exist_ok=True)
        (root / path).write_text(content + "\n", encoding="utf-8")


@pytest.fixture
def root(tmp_path):
    device = "sys/bus/usb/devices/1-2"
    write(
        tmp_path,
        {
            f"{device}/idVendor": "2a8d",
            f"{device}/idProduct": "1202",
            f"{device}/serial": "MY61000000",
            f"{device}/busnum": "1",
            f"{device}/devnum": "7",
            "dev/bus/usb/001/007": "",
            "sys/class/net/can0/type": "280",
            "sys/class/net/can0/flags": "0x40081",
            "sys/class/net/can1/type": "280",
            "sys/class/net/can1/flags": "0x40080",
            "sys/class/net/eth0/type": "1",
            "dev/ttyUSB0": "",
            "dev/ttyS1": "",
            "sys/class/tty/ttyS1/type": "0",
        },
    )
    return tmp_path


def judged(tmp_path: Path, role: str, driver: str, address: str, computer: Computer, further: str = "") -> list[str]:
    path = tmp_path / "station.toml"
    path.write_text(
        f'[station]\nname = "x"\n[instruments.{role}]\ndriver = "{driver}"\naddress = "{address}"\n{further}',
        encoding="utf-8",
    )
    ((name, shown, said),) = problems(load_station(path), computer)
    assert (name, shown) == (role, address)
    return [str(each) for each in said]


SUPPLY = ("supply", "keysight-e36300")
INVERTER = ("inverter", "cia402-inverter")
INVERTER_LIMITS = "maximum_current = 5.0\nmaximum_frequency = 200.0\n"


@pytest.mark.parametrize(
    ("address", "packages", "said"),
    [
        ("TCPIP0::192.0.2.1::inst0::INSTR", False, []),
        ("USB0::0x2A8D::0x1202::MY61000000::0::INSTR", True, []),
        ("USB0::10893::4610::my61000000::INSTR", True, []),
        ("USB0::0x2A8D::0x1202::MY61000000::0::INSTR", False, ["pyusb, libusb-package not installed; run uv sync"]),
        (
            "USB0::0x2A8D::0x1202::MY7::0::INSTR",
            True,
            ["not connected; on the USB there are 0x2A8D::0x1202::MY61000000"],
        ),
        ("USB0::keysight::0x1202::MY7::0::INSTR", True, ["a USB address is USB0::"]),
        ("GPIB0::17::INSTR", True, []),
        ("GPIB0::17::INSTR", False, ["gpib-ctypes not installed", "the GPIB adapter's own library"]),
        ("ASRL/dev/ttyUSB9::INSTR", True, ["/dev/ttyUSB9 does not exist; the ports are {root}/dev/ttyUSB0"]),
    ],
)
def test_visa(tmp_path, root, address, packages, said):
    found = judged(tmp_path, *SUPPLY, address, Described(root, packages=packages))
    assert len(found) == len(said)
    for given, wanted in zip(found, said, strict=True):
        assert wanted.format(root=root) in given


def test_a_node_that_cannot_be_used(tmp_path, root):
    (root / "dev/bus/usb/001/007").unlink()
    (said,) = judged(tmp_path, *SUPPLY, "USB0::0x2A8D::0x1202::MY61000000::0::INSTR", Described(root, packages=True))
    assert "; copy docs/examples/udev" in said


@pytest.mark.parametrize(
    ("address", "said"),
    [
        ("can://socketcan/can0?node=5", []),
        ("can://socketcan/can1?node=5&bitrate=250000", ["sudo ip link set can1 up type can bitrate 250000"]),
        ("can://socketcan/can7?node=5", ["no CAN interface can7 was found; the interfaces are can0, can1"]),
        ("can://socketcan/can0?node=5&bitrat=1", ["unknown key bitrat; is bitrate meant?"]),
        ("can://slcan//dev/ttyACM7?node=5", ["/dev/ttyACM7 does not exist"]),
        ("can://in-process/1?node=5", ["only the virtual bench has such an address"]),
    ],
)
def test_can(tmp_path, root, address, said):
    found = judged(tmp_path, *INVERTER, address, Described(root), INVERTER_LIMITS)
    assert len(found) == len(said)
    for given, wanted in zip(found, said, strict=True):
        assert wanted in given


@pytest.mark.parametrize(
    ("address", "said"),
    [
        ("can://socketcan/can0?node=1", []),
        ("can://socketcan/can1?node=1", ["ip link set can1 up type can bitrate 1000000 dbitrate 5000000 fd on"]),
        ("can://socketcan/can0?node=1&fdd=true", ["unknown key fdd; is fd meant?"]),
        ("fdcanusb:///dev/ttyACM7?node=1", ["/dev/ttyACM7 does not exist"]),
        ("fdcanusb:///dev/null?node=1&baudrat=9600", ["unknown key baudrat; is baudrate meant?"]),
        ("fdcanusb:///dev/null?node=1", []),
    ],
)
def test_a_bus_of_can_fd(tmp_path, root, address, said):
    found = judged(tmp_path, "inverter", "mjbots-moteus", address, Described(root), "maximum_current = 5.0\n")
    assert len(found) == len(said)
    for given, wanted in zip(found, said, strict=True):
        assert wanted in given


def test_a_serial_line_s_framing_and_port(tmp_path, root):
    limits = "maximum_speed = 300.0\nmaximum_torque = 1.0\n"
    path = root / "dev/ttyUSB0"
    path.unlink()
    path.symlink_to("/dev/null")
    said = judged(tmp_path, "dynamometer", "delta-dyn200", f"rtu://{path}?parity=even", Described(root), limits)
    assert [each.partition(";")[0] for each in said] == ["parity=even"]
    assert judged(tmp_path, "tachometer", "lutron-tachometer", str(path), Described(root)) == []
    (said,) = judged(tmp_path, "tachometer", "lutron-tachometer", f"{path}?speed=9600", Described(root))
    assert "unknown key speed" in said


def test_a_file_or_folder_in_a_serial_port_s_place(tmp_path, root):
    for path in (root / "plain", root):
        (root / "plain").touch()
        (said,) = judged(tmp_path, "tachometer", "lutron-tachometer", str(path), Described(root))
        assert said.startswith(f"{path} is not a serial port; the serial ports are ")


def test_what_is_connected(root):
    computer = Computer(root)
    (device,) = computer.usb_devices()
    assert (device.vendor, device.product, device.serial, device.usable) == (0x2A8D, 0x1202, "MY61000000", True)
    assert computer.can_interfaces() == {"can0": True, "can1": False}
    assert computer.serial_ports() == {str(root / "dev/ttyUSB0"): True}
    assert computer.missing({"numpy": "numpy", "no_such_module": "no-such"}) == ["no-such"]
