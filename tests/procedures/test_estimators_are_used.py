"""An estimator or a technique that no measurement uses proves nothing: each public name has a user outside the tests."""

import ast
import re
from collections.abc import Iterator
from pathlib import Path

import pytest

ROOT = Path(__file__).parents[2]
CHECKED = ("estimation", "techniques", "plausibility")
Name = tuple[str, str]


def imported(tree: ast.Module) -> dict[str, str]:
    """Return what each imported name stands for, as a dotted path."""
    return {
        alias.asname or alias.name: f"{node.module}.{alias.name}"
        for node in ast.walk(tree)
        if isinstance(node, ast.ImportFrom)
        for alias in node.names
    }


def names_used(module: str, node: ast.AST, paths: dict[str, str]) -> Iterator[Name]:
    """Give (module, name) of all that code may refer to: names of its own module, imported ones, attributes of imported modules."""
    for part in ast.walk(node):
        if isinstance(part, ast.Name):
            where, _, name = paths.get(part.id, f"{module}.{part.id}").rpartition(".")
            yield where, name
        elif isinstance(part, ast.Attribute) and isinstance(part.value, ast.Name) and part.value.id in paths:
            yield paths[part.value.id], part.attr


def unused(sources: dict[str, str], checked: set[str]) -> set[Name]:
    """Return the public functions and classes of the checked modules that no other code reaches."""
    bodies: dict[Name, set[Name]] = {}
    reached: set[Name] = set()
    for module, source in sources.items():
        tree = ast.parse(source)
        paths = imported(tree)
        for node in tree.body:
            used = set(names_used(module, node, paths))
            if module in checked and isinstance(node, ast.FunctionDef | ast.ClassDef):
                bodies[module, node.name] = used
            else:
                reached |= used
    waiting = list(reached)
    while waiting:
        more = bodies.get(waiting.pop(), set()) - reached
        reached |= more
        waiting += more
    return {name for name in bodies if name not in reached and not name[1].startswith("_")}


def test_every_estimator_has_a_user():
    uses = re.compile(rf"procedures\.({'|'.join(CHECKED)})\b")
    sources, checked = {}, set()
    for path in (path for part in ("bench", "procedures", "reports") for path in (ROOT / part).rglob("*.py")):
        module, source = ".".join(path.relative_to(ROOT).with_suffix("").parts), path.read_text(encoding="utf-8")
        if uses.match(module):
            checked.add(module)
        if uses.match(module) or uses.search(source):
            sources[module] = source
    assert len(checked) > 40
    assert unused(sources, checked) == set()


@pytest.mark.parametrize(
    ("user", "left"),
    [
        ("from a.b import f\nf()", {("a.b", "g")}),
        ("from a import b\nb.g()", set()),
        ("from a import b as c\nc.f()", {("a.b", "g")}),
        ("f = 1\ng = f", {("a.b", "f"), ("a.b", "g")}),
    ],
)
def test_what_counts_as_a_use(user, left):
    estimators = "def f():\n    return 1\n\ndef g():\n    return f()\n"
    assert unused({"a.b": estimators, "user": user}, {"a.b"}) == left
