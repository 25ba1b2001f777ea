"""The means of this computer to reach instruments: USB devices, serial ports, CAN interfaces, libraries. Nothing is sent anywhere."""

import ctypes.util
import os
from collections.abc import Mapping
from dataclasses import dataclass
from importlib.util import find_spec
from pathlib import Path

#: ARPHRD_CAN of the Linux kernel's if_arp.h, and IFF_UP of its if.h.
_CAN, _UP = "280", 0x1
#: Class and subclass of an interface for test and measurement.
_USBTMC = ("fe", "03")


@dataclass(frozen=True)
class UsbDevice:
    """A device on the USB: maker's and model's number, serial number, and the node through which libusb opens it.

    `instrument` says that it is one for test and measurement (USBTMC: class FEh, subclass 03h).
    """

    vendor: int
    product: int
    serial: str
    node: Path
    instrument: bool = False

    @property
    def usable(self) -> bool:
        """True if this user may open it."""
        return os.access(self.node, os.R_OK | os.W_OK)


class Computer:
    """The computer that the program runs on, by its files under `root`."""

    def __init__(self, root: Path = Path("/")) -> None:
        self._root = root

    def usb_devices(self) -> list[UsbDevice]:
        """Return what is connected, in order."""
        result = []
        for folder in sorted((self._root / "sys/bus/usb/devices").glob("*")):
            said = {name: _line(folder / name) for name in ("idVendor", "idProduct", "serial", "busnum", "devnum")}
            if said["idVendor"] and said["idProduct"] and said["busnum"] and said["devnum"]:
                node = self._root / f"dev/bus/usb/{int(said['busnum']):03d}/{int(said['devnum']):03d}"
                classes = {
                    (_line(interface / "bInterfaceClass"), _line(interface / "bInterfaceSubClass"))
                    for interface in folder.parent.glob(f"{folder.name}:*")
                }
                vendor, product = int(said["idVendor"], 16), int(said["idProduct"], 16)
                result.append(UsbDevice(vendor, product, said["serial"], node, _USBTMC in classes))
        return result

    def serial_ports(self) -> dict[str, bool]:
        """Return serial and USBTMC nodes by path, each with whether this user may use it."""
        folder = self._root / "dev"
        names = ("ttyUSB*", "ttyACM*", "ttyS[0-9]*", "ttyAMA*", "usbtmc*")
        # A ttyS exists where no hardware does; only those with a driver behind them count.
        ports = sorted(port for name in names for port in folder.glob(name) if self._driven(port))
        return {str(port): os.access(port, os.R_OK | os.W_OK) for port in ports}

    def can_interfaces(self) -> dict[str, bool]:
        """Return the CAN interfaces of the kernel by name, each with whether it is up."""
        result = {}
        for folder in sorted((self._root / "sys/class/net").glob("*")):
            if _line(folder / "type") == _CAN:
                result[folder.name] = bool(int(_line(folder / "flags") or "0", 16) & _UP)
        return result

    def missing(self, modules: Mapping[str, str]) -> list[str]:
        """Return the distributions, by the module each brings, that are not installed."""
        return [distribution for module, distribution in modules.items() if find_spec(module) is None]

    def has_library(self, *names: str) -> bool:
        """Return whether the system has one of these shared libraries."""
        return any(ctypes.util.find_library(name) for name in names)

    def _driven(self, port: Path) -> bool:
        if not port.name.startswith("ttyS"):
            return True
        return _line(self._root / "sys/class/tty" / port.name / "type") not in ("", "0")


def _line(path: Path) -> str:
    try:
        return path.read_text(encoding="utf-8", errors="replace").strip()
    except OSError:
        return ""
