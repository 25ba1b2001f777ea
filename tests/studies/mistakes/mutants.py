"""Mistakes in the modules of our drivers, one at a time: what is changed, where, and what is left as it is.

Not changed is what nobody can observe but by reading a message, or at all: see `unobservable`.
"""

import ast
import copy
from collections import Counter
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np

from tests.studies.mistakes.unobservable import ast_nodes, unobservable

ROOT = Path(__file__).parents[3]
_CIA402 = ("cia402-inverter", "cia402-rotor-actuator", "cia402-six-step")
_BASES = ("always", "found_state", "identification", "scpi_driver")
_SCOPES = ("keysight-infiniivision", "rigol-ds1000z")
_DELTA = ("c2000_watchdog", "found_settings", "recognition", "shaft", "transducer_scales")
_OF_CIA402 = (
    "found_objects",
    "motor_ratings",
    "node_identity",
    "opening",
    "stated_objects",
    "velocity_unit",
    "watchdog",
)
_MJBOTS = (
    "configuration", "controller", "diagnostics", "identity", "inverter", "multiplex", "power_stage", "readings", "strokes", "telemetry",
)  # fmt: skip
#: The modules that are changed, and the drivers that are made of each. `drivers.delta.framing` has no role, and so no check of the kit.
TARGETS: Mapping[str, Sequence[str]] = {
    "drivers.bases.scpi_supply": ("keysight-e36300", "scpi-supply"),
    "drivers.bases.supply_output": ("keysight-e36300", "scpi-supply"),
    "drivers.keysight.e36300": ("keysight-e36300",),
    "drivers.keysight.e36300_protection": ("keysight-e36300",),
    "drivers.keysight.e4980a": ("keysight-e4980a",),
    "drivers.keysight.dmm_34461a": ("keysight-34461a",),
    "drivers.keysight.infiniivision": ("keysight-infiniivision",),
    "drivers.bases.scpi_oscilloscope": _SCOPES,
    "drivers.bases.oscilloscope_dialogue": _SCOPES,
    "drivers.bases.waveform": _SCOPES,
    "drivers.delta.dynamometer": ("delta-dyn200",),
    "drivers.delta.c2000": ("delta-dyn200",),
    "drivers.delta.dyn200": ("delta-dyn200",),
    "drivers.lutron.tachometer": ("lutron-tachometer",),
    "drivers.lutron.frame": ("lutron-tachometer",),
    "drivers.cia402.inverter": ("cia402-inverter",),
    "drivers.cia402.node": _CIA402,
    "drivers.cia402.power_state": _CIA402,
    "drivers.cia402.velocity": ("cia402-inverter", "cia402-six-step"),
    "drivers.cia402.six_step": ("cia402-six-step",),
    "drivers.cia402.rotor_actuator": ("cia402-rotor-actuator",),
    "drivers.keysight.switch_unit_34970a": ("keysight-34970a",),
    "drivers.bases.crosspoints": ("keysight-34970a",),
    "drivers.gwinstek.gpt9800": ("gwinstek-gpt9800",),
}
#: What serves these: how an instrument is recognised, found and set up, and what others of its family have.
SUPPORTING: Mapping[str, Sequence[str]] = {
    **dict.fromkeys((f"drivers.bases.{each}" for each in _BASES), ("keysight-e4980a", "keysight-e36300")),
    "drivers.bases.found_state": ("keysight-e4980a", "keysight-e36300", "delta-dyn200"),
    "drivers.bases.set_points": ("keysight-e4980a", *_SCOPES),
    "drivers.keysight.e36300_settings": ("keysight-e36300",),
    "drivers.keysight.e4980a_settings": ("keysight-e4980a",),
    "drivers.keysight.infiniivision_settings": ("keysight-infiniivision",),
    **dict.fromkeys((f"drivers.delta.{each}" for each in _DELTA), ("delta-dyn200",)),
    **dict.fromkeys((f"drivers.cia402.{each}" for each in _OF_CIA402), _CIA402),
    **dict.fromkeys((f"drivers.mjbots.{each}" for each in _MJBOTS), ("mjbots-moteus",)),
    "drivers.gwinstek.gpt9800_settings": ("gwinstek-gpt9800",),
}
#: A module in which nothing new is met so often has no more.
_TRIES = 200
_FACTORS = (("× 2", 2.0), ("× √3", 3.0**0.5), ("÷ 1000", 1e-3))
_FLIPPED: Mapping[type[ast.cmpop], type[ast.cmpop]] = {
    ast.Lt: ast.GtE, ast.LtE: ast.Gt, ast.Gt: ast.LtE, ast.GtE: ast.Lt, ast.Eq: ast.NotEq, ast.NotEq: ast.Eq,
    ast.Is: ast.IsNot, ast.IsNot: ast.Is, ast.In: ast.NotIn, ast.NotIn: ast.In,
}  # fmt: skip
_SWAPPED: Mapping[type[ast.operator], type[ast.operator]] = {
    ast.Add: ast.Sub, ast.Sub: ast.Add, ast.Mult: ast.Div, ast.Div: ast.Mult,
}  # fmt: skip


@dataclass(frozen=True)
class Mutant:
    """A change: of which module, which kind of it, at which line, and the whole of the changed source."""

    module: str
    kind: str
    line: int
    was: str
    source: str

    @property
    def name(self) -> str:
        """What it is, in one line."""
        return f"{self.module}:{self.line} {self.kind}: {self.was}"


def path_of(module: str) -> Path:
    return ROOT / (module.replace(".", "/") + ".py")


def _tree_of(module: str) -> ast.Module:
    return ast.parse(path_of(module).read_text(encoding="utf-8"))


class _Sites:
    """Tells what can be changed at a node of a module's tree."""

    def __init__(self, tree: ast.Module) -> None:
        self._constants = [
            node.targets[0].id
            for node in tree.body
            if isinstance(node, ast.Assign)
            and len(node.targets) == 1
            and isinstance(node.targets[0], ast.Name)
            and isinstance(node.value, ast.Constant)
        ]
        for node in tree.body:
            if isinstance(node, ast.Assign):
                for target in node.targets:
                    if isinstance(target, ast.Tuple) and isinstance(node.value, ast.Tuple):
                        self._constants += [each.id for each in target.elts if isinstance(each, ast.Name)]

    def kinds(self, node: ast.AST) -> Iterator[str]:
        """Give the kinds of change."""
        match node:
            case ast.Constant(value=bool()):
                yield "truth"
            case ast.Constant(value=int() | float()) if node.value:
                yield from (f"number {name}" for name, _ in _FACTORS)
            case ast.BinOp() if type(node.op) in _SWAPPED and not isinstance(node.left, ast.JoinedStr):
                yield "operator"
            case ast.Compare() if len(node.ops) == 1 and type(node.ops[0]) in _FLIPPED:
                yield "comparison"
            case ast.Expr(value=ast.Call()):
                yield "dropped call"
            case ast.Raise():
                yield "dropped raise"
            case ast.Return(value=ast.expr()) if not isinstance(node.value, ast.Constant):
                yield "returned constant"
            case ast.If():
                yield "condition never"
            case ast.Name(id=name, ctx=ast.Load()) if name in self._constants and len(self._constants) > 1:
                yield "swapped constant"
            case ast.UnaryOp(op=ast.USub() | ast.Not()):
                yield "dropped sign"

    def swapped(self, name: str, generator: np.random.Generator) -> str:
        """Return another constant of the module."""
        others = [other for other in self._constants if other != name]
        return others[int(generator.integers(len(others)))]


def sites_of(module: str) -> tuple[ast.Module, list[tuple[str, int]]]:
    """Return a module's tree and what can be changed in it: the kind and the node's place in a walk."""
    tree = _tree_of(module)
    finder = _Sites(tree)
    excluded = unobservable(tree)
    nodes = list(ast_nodes(tree))
    found = [
        (kind, number) for number, node in enumerate(nodes) if id(node) not in excluded for kind in finder.kinds(node)
    ]
    return tree, found


def mutated(module: str, kind: str, number: int, generator: np.random.Generator) -> Mutant:
    """Return the module with one change."""
    tree = _tree_of(module)
    finder = _Sites(tree)
    parents = {child: parent for parent in ast_nodes(tree) for child in ast.iter_child_nodes(parent)}
    node: Any = list(ast_nodes(tree))[number]
    was = ast.unparse(node).splitlines()[0][:90]
    line = getattr(node, "lineno", 0)
    new: ast.AST | None = copy.copy(node)
    change: Any = new
    if kind == "truth":
        change.value = not node.value
    elif kind.startswith("number"):
        factor = dict(_FACTORS)[kind.removeprefix("number ")]
        value = node.value * factor
        change.value = round(value) if isinstance(node.value, int) and factor == 2.0 else value
    elif kind == "operator":
        change.op = _SWAPPED[type(node.op)]()
    elif kind == "comparison":
        change.ops = [_FLIPPED[type(node.ops[0])]()]
    elif kind in ("dropped call", "dropped raise"):
        new = ast.Pass()
    elif kind == "returned constant":
        change.value = ast.Constant(0)
    elif kind == "condition never":
        change.test = ast.Constant(False)
    elif kind == "swapped constant":
        change.id = finder.swapped(node.id, generator)
        kind = f"{kind} {change.id}"
    else:
        new = node.operand
    _replace(parents[node], node, new)
    return Mutant(module, kind, line, was, ast.unparse(ast.fix_missing_locations(tree)))


def _replace(parent: ast.AST, old: ast.AST, new: Any) -> None:
    for name, value in ast.iter_fields(parent):
        if value is old:
            setattr(parent, name, new)
        elif isinstance(value, list) and any(each is old for each in value):
            setattr(parent, name, [new if each is old else each for each in value])


def mutants(count: int, seed: int, modules: Sequence[str] = tuple(TARGETS)) -> list[Mutant]:
    """Return so many mutants, or all that there are: the modules in turn, at random places, of random kinds, none twice."""
    generator = np.random.default_rng(seed)
    places = {module: sites_of(module)[1] for module in modules}
    found: dict[tuple[str, str], Mutant] = {}
    left, tried = list(modules), Counter[str]()
    while left and len(found) < count:
        module = left[len(found) % len(left)]
        kinds = sorted({kind for kind, _ in places[module]})
        kind = kinds[int(generator.integers(len(kinds)))]
        numbers = [number for each, number in places[module] if each == kind]
        mutant = mutated(module, kind, numbers[int(generator.integers(len(numbers)))], generator)
        tried[module] += 1
        if found.setdefault((module, mutant.source), mutant) is mutant:
            tried[module] = 0
        elif tried[module] > _TRIES:
            left.remove(module)
    return list(found.values())
