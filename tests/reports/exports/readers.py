"""Readers of the exported files, written from the targets' own formats; none shares a line with the writers."""

import ast
import csv
import io
import json
import re
import xml.etree.ElementTree as ET
from collections.abc import Callable

Values = dict[str, float]


def vesc(content: str) -> Values:
    root = ET.fromstring(content)  # noqa: S314  written by ourselves a moment ago
    assert root.tag == "MCConfiguration"
    return {child.tag: float(child.text or "") for child in root}


def python_assignments(content: str) -> Values:
    """`a.b.c = 1.0` a line, as odrivetool executes it."""
    found = {}
    for statement in ast.parse(content).body:
        assert isinstance(statement, ast.Assign)
        found[ast.unparse(statement.targets[0]).removeprefix("odrv0.axis0.")] = float(ast.literal_eval(statement.value))
    return found


def without_c_comments(content: str) -> str:
    return re.sub(r"/\*.*?\*/", " ", content, flags=re.DOTALL)


def c_defines(content: str) -> Values:
    found = {}
    for line in without_c_comments(content).splitlines():
        words = line.split()
        if not words or words[0] in ("#ifndef", "#endif") or words == ["#define", "MOTOR_PARAMETERS_H"]:
            continue
        directive, name, value = words
        assert directive == "#define"
        found[name] = float(value.strip("()").removesuffix("f"))
    return found


def simplefoc(content: str) -> Values:
    bare = " ".join(without_c_comments(content).split())
    matched = re.fullmatch(r"BLDCMotor motor = BLDCMotor\((.*)\);", bare)
    assert matched
    return dict(zip(("pp", "R", "KV", "Lq", "Ld"), (float(v) for v in matched[1].split(",")), strict=True))


def moteus(content: str) -> Values:
    """As moteus_tool --restore-config reads it: cut at the hash, the rest is `conf set`'s arguments."""
    found = {}
    for line in content.splitlines():
        bare = line[: line.index("#")].rstrip() if "#" in line else line.rstrip()
        if bare:
            name, value = bare.split(" ")
            found[name] = float(value)
    return found


def matlab(content: str) -> Values:
    found = {}
    for line in content.splitlines():
        if line.startswith("%"):
            continue
        matched = re.fullmatch(r"pmsm\.(\w+) = (?:'((?:[^']|'')*)'|([^;']+));(?: %.*)?", line)
        assert matched, line
        if matched[3]:
            found[matched[1]] = float(matched[3])
    return found


def motulator(content: str) -> Values:
    call = ast.parse(content).body[-1]
    assert isinstance(call, ast.Assign)
    assert isinstance(call.value, ast.Call)
    assert ast.unparse(call.value.func) == "SynchronousMachinePars"
    return {str(word.arg): float(ast.literal_eval(word.value)) for word in call.value.keywords}


def dictionary(content: str) -> Values:
    (statement,) = ast.parse(content).body
    assert isinstance(statement, ast.Assign)
    return {name: float(value) for name, value in ast.literal_eval(statement.value).items()}


def json_object(content: str) -> Values:
    return {name: entry["value"] for name, entry in json.loads(content)["parameters"].items()}


def csv_rows(content: str) -> Values:
    return {row["parameter"]: float(row["value"]) for row in csv.DictReader(io.StringIO(content, newline=""))}


READERS: dict[str, Callable[[str], Values]] = {
    "vesc": vesc,
    "odrive": python_assignments,
    "odrive-0.6": python_assignments,
    "simplefoc": simplefoc,
    "moteus": moteus,
    "ti": c_defines,
    "st": c_defines,
    "mathworks": matlab,
    "motulator": motulator,
    "gym-electric-motor": dictionary,
    "json": json_object,
    "csv": csv_rows,
    "mdf4": csv_rows,
    "c-header": c_defines,
}
