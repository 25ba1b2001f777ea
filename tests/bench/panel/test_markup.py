"""What files and people write never becomes markup, a script or a string of properties: the panel's source is read for it."""

import ast
import re
from collections.abc import Iterator
from importlib.util import find_spec
from pathlib import Path

import pytest

PANEL = Path(__file__).parents[3] / "bench" / "panel"
#: Takes strings apart into properties or runs them in the browser: only what stands in the source goes in.
CONSTANT_ONLY = {
    "props",
    "style",
    "classes",
    "default_props",
    "default_style",
    "default_classes",
    "add_head_html",
    "add_body_html",
    "add_css",
    "add_scss",
    "add_sass",
    "run_javascript",
    "run_method",
}
#: Makes markup of strings; there is none.
NEVER = {"html", "markdown", "mermaid", "restructured_text", "interactive_image", "set_content", "add_slot", "svg"}


def constants_of(tree: ast.Module) -> set[str]:
    """Return the names of a module's constants that are made of literals alone."""
    result: set[str] = set()
    for node in tree.body:
        if isinstance(node, ast.Assign) and isinstance(node.targets[0], ast.Name) and is_constant(node.value, result):
            result.add(node.targets[0].id)
    return result


def is_constant(node: ast.expr, constants: set[str]) -> bool:
    match node:
        case ast.Constant():
            return True
        case ast.Name():
            return node.id in constants
        case ast.IfExp():
            return is_constant(node.body, constants) and is_constant(node.orelse, constants)
        case ast.BinOp():
            return is_constant(node.left, constants) and is_constant(node.right, constants)
    return False


def offences(source: str) -> Iterator[str]:
    tree = ast.parse(source)
    constants = constants_of(tree)
    for node in ast.walk(tree):
        if isinstance(node, ast.Call) and isinstance(node.func, ast.Attribute):
            name = node.func.attr
            if name in NEVER:
                yield f"line {node.lineno}: {name}(...)"
            given = node.args if name in CONSTANT_ONLY else []
            given = given + [word.value for word in node.keywords if name in CONSTANT_ONLY or word.arg == "js_handler"]
            if not all(is_constant(argument, constants) for argument in given):
                yield f"line {node.lineno}: {name} of what is no constant"
        # A property whose name begins with a colon is evaluated in the browser.
        if isinstance(node, ast.Subscript) and ast.unparse(node.value).endswith("props"):
            known = isinstance(node.slice, ast.Constant) and not str(node.slice.value).startswith(":")
            # The drawing's attributes are named by the drawing's own code.
            if not known and ast.unparse(node) != "element.props[name]":
                yield f"line {node.lineno}: a property that is named by a value"
        if isinstance(node, ast.Attribute) and node.attr in ("_props", "_head_html", "_body_html"):
            yield f"line {node.lineno}: {node.attr}"


@pytest.mark.parametrize("path", sorted(PANEL.rglob("*.py")), ids=lambda path: str(path.relative_to(PANEL)))
def test_the_source_of_a_page(path: Path) -> None:
    assert list(offences(path.read_text(encoding="utf-8"))) == []


@pytest.mark.parametrize(
    "source",
    [
        "box.props(f'aria-label=\"{name}\"')",
        "box.props('aria-label=' + name)",
        "box.props('a={}'.format(name))",
        "box.style(replace=colour)",
        "ui.html('<b>x</b>')",
        "ui.add_head_html(STYLE)",
        "ui.run_javascript(f'go({name})')",
        "field.on('click', js_handler=handler)",
        "box.props[name] = value",
        "box.props[':label'] = value",
        "table.add_slot('body', '<td>')",
    ],
)
def test_what_would_be_found(source: str) -> None:
    assert list(offences(source))


def test_every_class_has_a_rule() -> None:
    """Nothing makes rules of names in the browser. What begins with mb- may be there for its name alone."""
    sources = [path.read_text(encoding="utf-8") for path in PANEL.rglob("*.py")]
    nicegui = find_spec("nicegui")
    assert nicegui is not None
    sheets = [*(Path(str(nicegui.origin)).parent / "static").glob("quasar.*.prod.css"), *PANEL.glob("assets/*.css")]
    rules = {
        name
        for rule in [*sources, *(path.read_text(encoding="utf-8") for path in sheets)]
        for name in re.findall(r"\.([a-z][\w-]*)(?=[^;{}]*\{)", rule)
    }
    used = {
        name
        for source in sources
        for call in ast.walk(ast.parse(source))
        if isinstance(call, ast.Call) and isinstance(call.func, ast.Attribute) and call.func.attr == "classes"
        for given in [*call.args, *(word.value for word in call.keywords)]
        for node in ast.walk(given)
        if isinstance(node, ast.Constant) and isinstance(node.value, str)
        for name in re.findall(r"[a-z]\S*", node.value)
        if not name.startswith("mb-")
    }
    assert used
    assert used - rules == set()
