"""`motorbench doctor`: is everything there that a bench needs? Nothing is sent over any network."""

import os
import platform
import sys
from collections.abc import Sequence
from importlib.metadata import PackageNotFoundError, version
from pathlib import Path
from typing import Any

from bench.cli.options import Json, Language
from bench.cli.output import print_json
from bench.i18n.errors import InputError
from bench.i18n.language import language_of, translator
from bench.plugins.catalogues import installed
from bench.plugins.requirements import unmet_requirements
from bench.run.console import console_on
from bench.safety.guardian.scope import Scope, guardian_scope
from bench.safety.ownership.owner import holders
from bench.safety.ownership.state_folder import state_folder
from bench.station.computer import Computer
from bench.station.connections import problems
from bench.station.station_file import load_station
from drivers.interfaces.text import Text, Translate, text, word

_LIBRARIES = (
    "motorbench", "numpy", "scipy", "GTC", "pydantic", "PyVISA", "PyVISA-py", "pyserial", "pymodbus", "python-can",
    "canopen", "h5py", "matplotlib", "Babel", "cyclopts", "rich",
)  # fmt: skip

#: What may be done with a device.
_STATES = {
    str(state): state
    for state in (
        text("usable"),
        text("no permission"),
        text("up"),
        text("down"),
        text("vendor's VISA library"),
    )
}


def doctor(
    station: Path | None = None, /, *, json: Json = False, language: Language = "auto", runs: Path = Path("runs")
) -> int:
    """Report versions of libraries, the VISA backends found, USB, serial and CAN devices, permissions, and where a guardian would live.

    Parameters
    ----------
    station
        A station file. Checks whether this computer can reach each of its addresses. Nothing is opened; `station check` opens
        the instruments.
    runs
        Folder of the runs, which must be writable.

    """
    translate = translator(language_of(language))
    computer, guardian = Computer(), guardian_scope()
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
        "guardian": guardian.about(),
    }
    stands = [] if station is None else list(problems(load_station(station), computer))
    if station is not None:
        found["station"] = [
            {"instrument": name, "address": address, "problems": [str(said) for said in told]}
            for name, address, told in stands
        ]
    wrong = _problems(found, [(name, address, said) for name, address, told in stands for said in told], runs)
    found["problems"] = [str(said) for said in wrong]
    if json:
        print_json(found)
    else:
        _print(found, wrong, guardian, translate)
    return 1 if wrong else 0


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


def _problems(found: dict[str, Any], stands: Sequence[tuple[str, str, Text]], runs: Path) -> list[Text]:
    messages = [
        text("the library {name} is missing; run uv sync", name=name)
        for name, has in found["libraries"].items()
        if has is None
    ]
    messages += unmet_requirements(installed())
    if not found["visa_backends"]:
        messages.append(text("no VISA backend; install PyVISA-py or the instrument maker's VISA"))
    messages += [
        text("you have no permission to use {port}; add yourself to its group (often dialout or plugdev)", port=port)
        for port, state in found["serial_ports"].items()
        if state != "usable"
    ]
    messages += [
        text("{name} at {address}: {said}", name=name, address=address, said=said) for name, address, said in stands
    ]
    if found["state_problem"]:
        messages.append(Text("{said}", {"said": found["state_problem"]}))
    place = runs if runs.exists() else runs.absolute().parent
    if not os.access(place, os.W_OK):
        messages.append(
            text("you have no permission to write to {place}; choose another folder with --runs", place=place)
        )
    return messages


def _print(found: dict[str, Any], wrong: Sequence[Text], guardian: Scope, translate: Translate) -> None:
    console = console_on(sys.stdout)

    def say(said: Text | str, before: str = "") -> None:
        console.print(before + (said if isinstance(said, str) else said.render(translate)), markup=False)

    say(text("Python {version} on {system}", version=found["python"], system=found["system"]))
    for name, has in found["libraries"].items():
        say(has or text("missing"), f"  {name:<12}")
    nothing = text("none")
    for title, key in (
        (text("VISA backends"), "visa_backends"),
        (text("Serial ports"), "serial_ports"),
        (text("USB devices"), "usb_devices"),
        (text("CAN interfaces"), "can_interfaces"),
    ):
        say(text("{place}: {said}", place=title, said="" if found[key] else nothing))
        for name, told in found[key].items():
            say(_STATES.get(told, word(told)), f"  {name}  ")
    say(text("State folder: {folder}", folder=found["state_folder"] or nothing))
    for one in found["in_use"]:
        values = {"user": one["user"], "what": one["what"], "pid": one["pid"], "since": one["since"]}
        say(
            text(
                "{user}: {what} (process {pid}, which has ended; its guardian has not), since {since}",
                **values,
            )
            if one["ended"]
            else text("{user}: {what} (process {pid}), since {since}", **values),
            "  ",
        )
        say(", ".join(one["instruments"]), "      ")
    say(text("Guardian: {said}", said=guardian.said))
    for one in found.get("station", ()):
        if not one["problems"]:
            say(text("{name} at {address}", name=one["instrument"], address=one["address"]), "✓ ")
    for problem in wrong:
        say(problem, "✗ ")
    if not wrong:
        say(text("Nothing is missing."), "✓ ")
        if "station" not in found:
            say(text("To check the addresses of a station file: motorbench doctor STATION.toml"), "  ")
