"""The tables of commands and their sources: complete, without a row too many, and the page made of them."""

import ast
import re
import tokenize
from collections.abc import Collection, Iterator
from pathlib import Path
from typing import Any

import pytest

from bench.plugins.catalogues import installed
from bench.station.command_table import markdown_tables, packages_with_commands
from bench.testing.conformance import check_driver, stand
from bench.traffic.messages import message_of
from drivers.catalogue import Surroundings
from drivers.command_sources import CommandSource, SourcedCommand, declared_commands, sourced_commands
from drivers.transport.wire import Carrier, Direction, Wire
from tests.bench.testing.conformance.own_drivers import FOUND, OPTIONS, VARIANTS, driver_named
from tests.drivers.dialogue import DIALOGUES

ROOT = Path(__file__).parents[2]
TABLES = {name: declared_commands(package, name) for name, package in packages_with_commands(installed()).items()}

#: The modules in which a driver's commands stand: those of its folder that only others of it use are left out.
MODULES = {
    "keysight-e36300": ("keysight/e36300*.py", "bases/scpi_supply.py", "bases/supply_*.py"),
    "keysight-e4980a": ("keysight/e4980a*.py",),
    "keysight-infiniivision": ("keysight/infiniivision*.py", "bases/*oscilloscope*.py"),
    "keysight-34461a": ("keysight/dmm_34461a*.py",),
    "keysight-34970a": ("keysight/switch_unit_34970a.py",),
    "gwinstek-gpt9800": ("gwinstek/*.py",),
    "delta-dyn200": ("delta/*.py",),
    "lutron-tachometer": ("lutron/*.py",),
    "cia402-inverter": ("cia402/*.py", "transport/can/*.py"),
    "cia402-six-step": ("cia402/*.py", "transport/can/*.py"),
    "cia402-rotor-actuator": ("cia402/*.py", "transport/can/*.py"),
    "beckhoff-bk9000": ("beckhoff/*.py",),
    "modbus-input": ("interlocks/modbus.py",),
    "can-frame": ("interlocks/can.py",),
    "mjbots-moteus": ("mjbots/*.py",),
}
SCPI = tuple(name for name in MODULES if name.startswith(("keysight", "gwinstek")))
CAN = tuple(name for name in MODULES if name.startswith("cia402"))
#: What every SCPI session asks, besides the modules above.
_SESSION = ("transport/visa/session.py",)

_HEADER = re.compile(r"(?:\*[A-Z]{3,}|:?[A-Z]{3,}[0-9n<>]*(?::[A-Z]+[0-9n<>]*)*)\??")


def rows(name: str) -> list[str]:
    return [one.command for one in TABLES[name]]


def files_of(name: str) -> list[Path]:
    patterns = (*MODULES[name], *(_SESSION if name in SCPI else ()))
    found = [file for pattern in patterns for file in sorted((ROOT / "drivers").glob(pattern))]
    assert found, name
    return found


def header(message: str) -> str:
    """A message's header, its numbers as <n>."""
    word = message.strip().split(" ")[0]
    return re.sub(r"(?<=[A-Z])[0-9]+(?=:|\?|$)", "<n>", word)


def literals(file: Path) -> Iterator[str]:
    """The texts in a module but its docstrings; what is put into one stands as <n>."""
    tree = ast.parse(file.read_text(encoding="utf-8"))
    inside = {id(part) for node in ast.walk(tree) if isinstance(node, ast.JoinedStr) for part in node.values}
    said = {id(node.value) for node in ast.walk(tree) if isinstance(node, ast.Expr)}
    for node in ast.walk(tree):
        if isinstance(node, ast.JoinedStr):
            yield "".join(str(part.value) if isinstance(part, ast.Constant) else "<n>" for part in node.values)
        elif isinstance(node, ast.Constant) and isinstance(node.value, str) and not {id(node)} & (inside | said):
            yield node.value


def scpi_in(file: Path) -> set[str]:
    """The headers among the texts of a module: with a colon, a star or a question mark, as plain words are not.

    Where a query is put together, its header stands without the question mark.
    """
    found = set()
    for said in literals(file):
        for part in re.sub(r"^<n>(?=:)", ":CHAN<n>", said).split(";"):
            word = header(part)
            if _HEADER.fullmatch(word) and (set(word) & set(":*?")):
                found.add(word)
    return found


def numbers_in(file: Path) -> set[int]:
    """The numbers that a module writes in hexadecimal, in its code."""
    with file.open("rb") as opened:
        return {
            int(token.string, 16)
            for token in tokenize.tokenize(opened.readline)
            if token.type == tokenize.NUMBER and token.string.startswith("0x")
        }


class Sent:
    """Hears what a driver sends, as rows of a table would have it."""

    def __init__(self, name: str) -> None:
        self.name = name
        self.commands: set[str] = set()

    def __call__(self, carrier: Any, direction: str, data: bytes) -> None:
        if direction == ">":
            self.commands.update(_named(self.name, carrier, data))


def _named(name: str, carrier: Any, data: bytes) -> Iterator[str]:
    message = message_of(carrier, data)
    if carrier == "visa":
        yield from (header(part) for part in message.decode("ascii").split(";"))
    elif carrier == "can":
        yield from _can(message)
    elif carrier.startswith("modbus"):
        yield from _modbus(name, message)
    else:
        yield repr(data)


def _fd(data: bytes) -> Iterator[str]:
    """Registers and lines of a stream in a frame of CAN FD, its flags before it."""
    while data:
        kind, data = data[0], data[1:]
        if kind == 0x40:
            line = data[2 : 2 + data[1]].decode("ascii").strip()
            words = line.split(" ")
            whole = words[:2] in (["conf", "get"], ["tel", "get"])
            yield " ".join(words if whole else words[:2])
            return
        if kind in (0x42, 0x50):
            return
        register = data[0] if data[0] < 0x80 else data[0] & 0x7F | data[1] << 7
        data = data[1 if data[0] < 0x80 else 2 :]
        yield from (f"0x{register + place:03X}" for place in range(kind & 3))
        data = data[(kind & 3) * (1, 2, 4, 4)[kind >> 2 & 3] if kind < 0x10 else 0 :]


def _can(message: bytes) -> Iterator[str]:
    identifier, _, content = message.decode("ascii").partition("#")
    if content.startswith("#"):
        yield from (found for found in _fd(bytes.fromhex(content[2:])) if found)
        return
    code = int(identifier, 16) & 0x780
    if code == 0x600:
        # A download's or an upload's first frame; further segments name no object.
        if int(content[:2], 16) >> 5 in (1, 2):
            index = int(content[4:6] + content[2:4], 16)
            # Each PDO has its own objects.
            yield f"0x{index & 0xFFE0 if index >> 9 in (0xC, 0xD) else index:04X}"
    elif content == "R":
        yield "node guarding"
    else:
        yield {0x000: "NMT", 0x080: "SYNC", 0x700: "heartbeat"}.get(code, message.decode("ascii"))


def _modbus(name: str, message: bytes) -> Iterator[str]:
    unit, function, address = message[0], message[1], int.from_bytes(message[2:4])
    count = int.from_bytes(message[4:6]) if function in (3, 16) else 1
    if function in (1, 5):
        yield f"{'transducer ' if name == 'delta-dyn200' else ''}coil {address}"
    elif name == "delta-dyn200" and unit == OPTIONS[name].get("transducer_unit", 2):
        yield from (f"transducer {place:02X}H" for place in range(address, address + count, 2))
    else:
        yield from (f"drive {place:04X}H" for place in range(address, address + count))


def sent(name: str, monkeypatch: pytest.MonkeyPatch) -> Collection[str]:
    """What a driver sends in the conformance checks: found states, use, ends, limits, trips, disturbed lines."""
    hears = Sent(name)

    def heard(clock: Any, *, wire: Wire | None, **named: Any) -> Surroundings:
        def both(carrier: Carrier, direction: Direction, data: bytes) -> None:
            for each in (hears, wire) if wire else (hears,):
                each(carrier, direction, data)

        return Surroundings(clock, wire=both, **named)

    monkeypatch.setattr(stand, "Surroundings", heard)
    check_driver(driver_named(name), options=OPTIONS[name], found=FOUND.get(name), variants=VARIANTS.get(name, ()))
    return hears.commands


def test_every_driver_that_is_spoken_to_has_a_table() -> None:
    ours = [driver for roles in installed().drivers.values() for driver in roles if driver.needs_address]
    assert {driver.name for driver in ours} <= set(TABLES)
    assert set(TABLES) == set(MODULES)


#: Whose procedures take the most; a few others are always tried.
_LONG = (
    "cia402-inverter",
    "cia402-rotor-actuator",
    "cia402-six-step",
    "delta-dyn200",
    "keysight-e36300",
    "keysight-e4980a",
    "keysight-infiniivision",
    "mjbots-moteus",
)


@pytest.mark.parametrize(
    "name",
    [pytest.param(n, marks=pytest.mark.slow if n in _LONG else ()) for n in sorted(set(MODULES) & set(OPTIONS))],
)
def test_whatever_is_sent_is_in_the_table(name: str, monkeypatch: pytest.MonkeyPatch) -> None:
    commands = sent(name, monkeypatch)
    stated = {f"0x{one.index:04X}" for _, one in _stated(name)}
    assert sorted(set(commands) - set(rows(name)) - stated) == []
    if name != "lutron-tachometer":
        assert commands


def _stated(name: str) -> list[Any]:
    """Objects of the maker's own, which the station names and no table can."""
    (driver,) = installed().drivers[name]
    made = driver.options(**OPTIONS[name])
    return list(made.stated_objects()) if hasattr(made, "stated_objects") else []


@pytest.mark.parametrize("file", sorted(DIALOGUES.glob("*.traffic")), ids=lambda file: file.stem)
def test_whatever_a_recording_sends_is_in_the_table(file: Path) -> None:
    content = file.read_text(encoding="utf-8")
    name = re.search(r'driver = "(.*)"', content)[1]  # type: ignore[index]
    messages = re.findall(r"^ +[0-9.]+ \w+ [>~] (.*?)(?:\\r)?\\n$", content, re.MULTILINE)
    assert messages
    assert {header(part) for message in messages for part in message.split(";")} <= set(rows(name))


@pytest.mark.parametrize("name", SCPI)
def test_every_header_in_the_code_is_in_the_table_and_the_other_way_round(name: str) -> None:
    files = files_of(name)
    table = set(rows(name))
    for file in files:
        assert sorted(scpi_in(file) - table - _left_out(file, files, table)) == [], file
    code = {found for file in files for found in scpi_in(file)}
    plain = {header(said) for file in files for said in literals(file)}
    # What is put into a text may be a word as well as a number.
    held = [
        re.escape(one).replace("<n>", "(?:<n>|[A-Z]+)") + r"\??" for one in code | plain if re.search("[A-Z]{3}", one)
    ]
    assert [row for row in rows(name) if not any(re.fullmatch(one, row) for one in held)] == []


def _left_out(file: Path, files: list[Path], table: set[str]) -> set[str]:
    """Texts of a module that are no commands of this driver."""
    if file.parent.name == "bases":
        # Queries are put together there: their headers stand without the question mark.
        return {":CHAN<n>", *(one.removesuffix("?") for one in table)}
    if file.name == "session.py":
        waits = any(".complete(" in one.read_text(encoding="utf-8") for one in files if one != file)
        return set() if waits else {"*OPC?"}
    # What the commands of a channel begin with.
    return {":CHAN<n>"}


@pytest.mark.parametrize("name", CAN)
def test_every_object_in_the_table_is_in_the_code(name: str) -> None:
    held = {number for file in files_of(name) for number in numbers_in(file)}
    assert [row for row in rows(name) if row.startswith("0x") and int(row, 16) not in held] == []
    assert {row for row in rows(name) if not row.startswith("0x")} <= {
        "NMT", "SYNC", "heartbeat", "node guarding",
    }  # fmt: skip


def test_every_object_in_the_code_of_the_drives_is_in_a_table() -> None:
    held = {number for file in (ROOT / "drivers" / "cia402").glob("*.py") for number in numbers_in(file)}
    # Error codes are from 0x2000 on and from 0x7000 on.
    objects = {f"0x{number:04X}" for number in held if 0x1000 <= number < 0x2000 or 0x6000 <= number < 0x7000}
    assert sorted(objects - {row for name in CAN for row in rows(name)}) == []


def test_every_register_in_the_tables_is_in_the_code_and_the_other_way_round() -> None:
    for name, place in (("delta-dyn200", "delta"), ("beckhoff-bk9000", "beckhoff")):
        held = {number for file in (ROOT / "drivers" / place).glob("*.py") for number in numbers_in(file)}
        registers = {int(found[1], 16) for row in rows(name) if (found := re.search(r"([0-9A-F]+)H$", row))}
        assert sorted(f"{number:X}" for number in registers - held - _READ_ALONG[name]) == []
        assert sorted(f"{number:X}" for number in held - registers - _NO_REGISTERS[name]) == []


#: Calls that ask for bits, and the row of each.
_BITS = {
    "read_coil(": "coil <n>",
    "write_coil(": "coil <n>",
    "read_coils": "coil <n>",
    "read_discrete_inputs": "discrete input <n>",
}


@pytest.mark.parametrize("name", ["beckhoff-bk9000", "modbus-input"])
def test_the_bits_in_the_tables_are_those_in_the_code(name: str) -> None:
    code = "".join(file.read_text(encoding="utf-8") for file in files_of(name))
    assert {row for row in rows(name) if row.endswith("<n>")} == {row for call, row in _BITS.items() if call in code}


def test_what_only_listens_has_no_command() -> None:
    assert rows("can-frame") == []
    assert rows("lutron-tachometer") == ["frame"]


#: Read in one block with what the code names: speed and power behind the torque, the current behind the frequency.
_READ_ALONG = {"delta-dyn200": {0x02, 0x04, 0x2104}, "beckhoff-bk9000": set()}
#: Masks, highest values and reset words.
_NO_REGISTERS = {"delta-dyn200": {0xFF}, "beckhoff-bk9000": {0x8000, 0xFFFF, 0xBECF, 0xAFFE}}


def test_what_rests_on_one_source_says_so() -> None:
    manual, program = CommandSource("manual", "a manual", "–"), CommandSource("program", "a program", "–")
    copy = CommandSource("copy", "a program after the manual", "–", after=("manual",))
    sister = CommandSource("sister", "a program for its sister", "–", of_relative=True)
    known = ((), (sister,), (manual,), (copy,), (manual, copy), (manual, sister), (manual, program))
    said = [str(SourcedCommand("VOLT", sources).words) for sources in known]
    assert said == ["no source", "no source", *("one source",) * 4, "two sources or more"]


def test_a_package_without_a_table_has_no_rows() -> None:
    assert sourced_commands("drivers.manual", "manual") == ()
    assert sourced_commands("drivers.keysight", "acme") == ()


def test_the_page_is_made_of_the_tables() -> None:
    page = (ROOT / "docs" / "reference" / "instrument-commands.md").read_text(encoding="utf-8")
    made = markdown_tables(TABLES, lambda message: message)
    assert page.endswith(made), (
        "docs/reference/instrument-commands.md is stale; its first lines say which command makes it"
    )
