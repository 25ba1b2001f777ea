"""`motorbench doctor`: is everything there that a bench needs? Nothing is sent over any network."""

import os
import platform
import sys
from importlib.metadata import PackageNotFoundError, version
from pathlib import Path
from typing import Any

from bench.cli.output import print_json
from bench.i18n.errors import InputError
from bench.run.console import console_on
from bench.safety.guardian.scope import guardian_scope
from bench.safety.ownership.owner import holders
from bench.safety.ownership.state_folder import state_folder
from bench.station.computer import Computer
from bench.station.connections import problems
from bench.station.station_file import load_station

_LIBRARIES = (
    "motorbench", "numpy", "scipy", "GTC", "pydantic", "PyVISA", "PyVISA-py", "pyserial", "pymodbus", "python-can",
    "canopen", "h5py", "matplotlib", "Babel", "cyclopts", "rich",
)  # fmt: skip


def doctor(station: Path | None = None, /, *, json: bool = False, runs: Path = Path("runs")) -> int:
    """Report versions of libraries, the VISA backends found, USB, serial and CAN devices, permissions, and where a guardian would live.

    Parameters
    ----------
    station
        A station file: can this computer reach each of its addresses? Nothing is opened; `station check` does that.
    json
        Print one JSON object and nothing else.
    runs
        Folder of the runs, which must be writable.

    """
    computer = Computer()
    found: dict[str, Any] = {
        "python": platform.python_version(),
        "system": platform.platform(),
        "libraries": {name: _version(name) for name in _LIBRARIES},
        "visa_backends": _backends(),
        "serial_ports": {
            port: "usable" if usable else "no permission" for port, usable in computer.serial_ports().items()
        },
        "usb_devices": {
            f"0x{device.vendor:04X}::0x{device.product:04X}::{device.serial}": "usable"
            if device.usable
            else "no permission"
            for device in computer.usb_devices()
        },
        "can_interfaces": {name: "up" if up else "down" for name, up in computer.can_interfaces().items()},
        **_state(),
        "guardian": guardian_scope().about(),
    }
    if station is not None:
        found["station"] = [
            {"instrument": name, "address": address, "problems": [said.render() for said in stands]}
            for name, address, stands in problems(load_station(station), computer)
        ]
    found["problems"] = _problems(found, runs)
    if json:
        print_json(found)
    else:
        _print(found)
    return 1 if found["problems"] else 0


def _state() -> dict[str, Any]:
    """Return where it is kept who has which instrument, who has any, and why that cannot be told."""
    try:
        state = state_folder()
        return {
            "state_folder": str(state.path),
            "in_use": [
                {"user": one.user, "pid": one.pid, "what": one.what, "since": one.since, "folder": one.folder}
                | {"ended": one.gone, "instruments": sorted(one.keys)}
                for one in holders(state)
            ],
            "state_problem": "",
        }
    except InputError as error:
        return {"state_folder": "", "in_use": [], "state_problem": str(error)}


def _version(name: str) -> str | None:
    try:
        return version(name)
    except PackageNotFoundError:
        return None


def _backends() -> dict[str, str]:
    """Return the VISA backends by the name a station file gives them (`visa_library`), with what is known of each."""
    backends = {}
    if _version("PyVISA-py"):
        backends["@py"] = f"PyVISA-py {_version('PyVISA-py')}"
    try:
        from pyvisa.ctwrapper.highlevel import IVIVisaLibrary

        backends |= {str(path): "vendor's VISA library" for path in IVIVisaLibrary.get_library_paths()}
    except (ImportError, OSError) as error:
        backends["@ivi"] = f"cannot be looked for: {error}"
    return backends


def _problems(found: dict[str, Any], runs: Path) -> list[str]:
    told = [f"the library {name} is missing; run uv sync" for name, has in found["libraries"].items() if has is None]
    if not found["visa_backends"]:
        told.append("no VISA backend; install PyVISA-py or the instrument maker's VISA")
    told += [
        f"{port} may not be used; add yourself to its group (often dialout or plugdev)"
        for port, state in found["serial_ports"].items()
        if state != "usable"
    ]
    told += [
        f"{one['instrument']} at {one['address']}: {said}"
        for one in found.get("station", ())
        for said in one["problems"]
    ]
    if found["state_problem"]:
        told.append(found["state_problem"])
    place = runs if runs.exists() else runs.absolute().parent
    if not os.access(place, os.W_OK):
        told.append(f"{place} may not be written to; choose another folder with --runs")
    return told


def _print(found: dict[str, Any]) -> None:
    console = console_on(sys.stdout)
    console.print(f"Python {found['python']} on {found['system']}", markup=False)
    for name, has in found["libraries"].items():
        console.print(f"  {name:<12}{has or 'missing'}", markup=False)
    kinds = (
        ("VISA backends", "visa_backends"),
        ("Serial ports", "serial_ports"),
        ("USB devices", "usb_devices"),
        ("CAN interfaces", "can_interfaces"),
    )
    for title, key in kinds:
        console.print(f"{title}: {'' if found[key] else 'none'}", markup=False)
        for name, told in found[key].items():
            console.print(f"  {name}  {told}", markup=False)
    console.print(f"State folder: {found['state_folder'] or 'none'}", markup=False)
    for one in found["in_use"]:
        ended = ", which has ended; its guardian has not" if one["ended"] else ""
        console.print(
            f"  {one['user']}: {one['what']} (process {one['pid']}{ended}), since {one['since']}", markup=False
        )
        console.print(f"      {', '.join(one['instruments'])}", markup=False)
    console.print(f"Guardian: {found['guardian']['said']}", markup=False)
    for one in found.get("station", ()):
        if not one["problems"]:
            console.print(f"✓ {one['instrument']} at {one['address']}", markup=False)
    for problem in found["problems"]:
        console.print(f"✗ {problem}", markup=False)
    if not found["problems"]:
        further = (
            "" if "station" in found else " A station file's addresses are judged by: motorbench doctor STATION.toml"
        )
        console.print(f"✓ Nothing is missing.{further}", markup=False)
