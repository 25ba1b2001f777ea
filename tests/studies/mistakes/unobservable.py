"""What of a driver's module cannot be told from outside, whatever it is: a study of mistakes leaves it as it is.

- **Messages**: what stands in `text(…)`, in `raise` and in `add_note(…)`, and what serves nothing else: a local name, a function of
  the module, a constant (a bit that chooses the proposed remedy) or a table looked up by `.get` whose every use stands in a message
  (names of error codes, a figure that the message shows), a property that the drivers read in messages only, what a method of their
  own returns that they call in `text(…)` only, what a method of their own is given for messages only or puts into an error that it
  returns, but not what that asks the instrument.
- **Annotations**, decorators, imports and protocols, of which nothing is made.
- **Pauses of a loop that looks again**: the `sleep` in a `while` loop, the interval of `polls`, and a constant whose every use is in
  such. How often one looks changes nothing that is found.
- **Defaults that nobody leaves out**: of a parameter that every call in the drivers' modules gives, also the `open` of a base, and of
  classes that are derived without an `__init__` of their own.
- **Lengths of pieces**: a constant that is nothing but the step of a `range` and the end of the slices that begin there. All pieces
  together are the whole, however long each is.
- **`strict=`** of a `zip`: it says what must be so, and changes nothing where it is; `daemon=` and `name=` of a thread that is joined
  where its block ends: they count where the interpreter ends before that.
"""

import ast
import re
from collections.abc import Iterator
from functools import cache
from pathlib import Path
from typing import Any

_DRIVERS = Path(__file__).parents[3] / "drivers"


def ast_nodes(node: ast.AST) -> Iterator[ast.AST]:
    """Give a node and all below it, in one order."""
    waiting = [node]
    while waiting:
        yield (here := waiting.pop())
        waiting += reversed(list(ast.iter_child_nodes(here)))


def unobservable(tree: ast.Module) -> set[int]:
    """Return the nodes (by `id`) of a module's tree that cannot be told from outside."""
    found = {id(each) for node in ast_nodes(tree) for part in _formal(node) for each in ast_nodes(part)}
    messages = {id(each) for node in ast_nodes(tree) for part in _message(node) for each in ast_nodes(part)}
    while more := _only_in_messages(tree, messages) - messages:
        messages |= more
    called = [part for node in ast_nodes(tree) for part in _pauses(node)]
    names = {part.value.func.attr for part in called if isinstance(part, ast.Expr)} - {"sleep"}
    called += [node for node in ast_nodes(tree) if isinstance(node, ast.FunctionDef) and node.name in names]
    pauses = {id(each) for part in called for each in ast_nodes(part)}
    assigned = (node for node in tree.body if isinstance(node, ast.Assign))
    for name, value in (scalar for node in assigned for scalar in _scalars(node)):
        uses = _uses(tree, name)
        if uses and name not in _imported() and all(id(use) in pauses for use in uses):
            pauses |= {id(each) for each in ast_nodes(value)}
    defaults = {id(each) for part in _given_defaults(tree) for each in ast_nodes(part)}
    pieces = {id(each) for part in _pieces(tree) for each in ast_nodes(part)}
    return found | messages | pauses | defaults | pieces


def _formal(node: ast.AST) -> Iterator[ast.AST]:
    match node:
        case ast.Import() | ast.ImportFrom():
            yield node
        case ast.FunctionDef():
            yield from _annotations(node)
            yield from node.decorator_list
            if any(_is_join(each) for each in ast_nodes(node)):
                threads = [each for each in ast_nodes(node) if isinstance(each, ast.Call) and _name(each) == "Thread"]
                yield from (one.value for each in threads for one in each.keywords if one.arg in ("daemon", "name"))
        case ast.ClassDef():
            yield from node.decorator_list
            if any(ast.unparse(base) == "Protocol" for base in node.bases):
                yield from node.body
        case ast.AnnAssign():
            yield from _annotations(node)
        case ast.keyword(arg="strict"):
            yield node.value
        case ast.JoinedStr():
            # What is formatted into a command is behaviour; a format is no part of the tree that can be changed alone.
            yield from (p.format_spec for p in node.values if isinstance(p, ast.FormattedValue) and p.format_spec)


def _annotations(node: ast.AST) -> Iterator[ast.AST]:
    match node:
        case ast.FunctionDef():
            yield from (each.annotation for each in node.args.args + node.args.kwonlyargs if each.annotation)
            yield from [node.returns] if node.returns else []
        case ast.AnnAssign():
            yield node.annotation


def _name(call: ast.Call) -> str:
    """Return the last part of what is called."""
    return ast.unparse(call.func).rpartition(".")[2]


def _is_join(node: ast.AST) -> bool:
    return isinstance(node, ast.Call) and ast.unparse(node) == "thread.join()"


def _message(node: ast.AST) -> Iterator[ast.AST]:
    if isinstance(node, ast.Call) and isinstance(node.func, ast.Name) and node.func.id in ("text", "Text"):
        yield node
    elif isinstance(node, ast.Raise):
        yield from ast.iter_child_nodes(node)
    elif isinstance(node, ast.Expr) and isinstance(node.value, ast.Call) and "add_note" in ast.unparse(node.value.func):
        yield node


def _only_in_messages(tree: ast.Module, messages: set[int]) -> set[int]:
    """Return what is computed for messages alone."""
    found: set[int] = set()
    parents = {id(child): node for node in ast_nodes(tree) for child in ast.iter_child_nodes(node)}
    for node in tree.body:
        if isinstance(node, ast.FunctionDef) and node.name not in _imported():
            uses = _uses(tree, node.name)
            if uses and all(id(use) in messages for use in uses):
                found |= {id(each) for part in node.body for each in ast_nodes(part)}
        if isinstance(node, ast.Assign) and (name := _target(node)) and name not in _imported():
            uses = _uses(tree, name)
            if uses and all(id(use) in messages and _is_get(parents[id(use)]) for use in uses):
                found |= {id(each) for each in ast_nodes(node.value)}
        if isinstance(node, ast.Assign):
            for name, value in _scalars(node):
                uses = _uses(tree, name)
                if uses and name not in _imported() and all(id(use) in messages for use in uses):
                    found |= {id(each) for each in ast_nodes(value)}
    for function in (each for each in ast_nodes(tree) if isinstance(each, ast.FunctionDef)):
        if any(ast.unparse(one) == "property" for one in function.decorator_list) and function.name in _shown():
            found |= {id(each) for part in function.body for each in ast_nodes(part)}
        elif function.name.startswith("_") and function.name in _shown(texts=True):
            asked = [node for node in ast_nodes(function) if isinstance(node, ast.Call) and _asks(node)]
            kept = {id(each) for node in asked for each in ast_nodes(node)}
            returned = [node for node in ast_nodes(function) if isinstance(node, ast.Return) and node.value is not None]
            for node in returned:
                whole = ast_nodes(node.value if _asks(node.value) else node)  # type: ignore[arg-type]
                found |= {id(each) for each in whole} - kept
        elif function.name.startswith("_") and function.name in _shown():
            found |= {id(each) for part in _told_by(function) for each in ast_nodes(part)}
        found |= {id(each) for part in _said_only(tree, function, messages) for each in ast_nodes(part)}
        for node in ast_nodes(function):
            if isinstance(node, ast.Assign) and (names := _targets(node)) and not _asks(node.value):
                uses = [use for name in names for use in _uses(function, name)]
                if uses and all(id(use) in messages for use in uses):
                    found |= {id(each) for each in ast_nodes(node.value)}
    return found


def _told_by(function: ast.FunctionDef) -> Iterator[ast.AST]:
    """Give what a method puts into the error that it returns, which is raised where it is called."""
    for node in ast_nodes(function):
        if isinstance(node, ast.Return) and isinstance(node.value, ast.Call) and _name(node.value).endswith("Error"):
            parts = [*node.value.args, *(one.value for one in node.value.keywords)]
            yield from (part for part in parts if not _asks(part))


def _said_only(tree: ast.Module, function: ast.FunctionDef, messages: set[int]) -> Iterator[ast.AST]:
    """Give what the module's calls hand to a method of its own for messages alone."""
    if not function.name.startswith("_") or not function.args.args or function.args.args[0].arg != "self":
        return
    calls = [
        each
        for each in ast_nodes(tree)
        if isinstance(each, ast.Call) and ast.unparse(each.func) == f"self.{function.name}"
    ]
    for place, argument in enumerate(function.args.args[1:]):
        uses = _uses(function, argument.arg)
        if uses and all(id(use) in messages for use in uses):
            yield from (call.args[place] for call in calls if len(call.args) > place and not _asks(call.args[place]))


def _target(node: ast.Assign) -> str:
    """Return the one name that is assigned, empty where it is another thing."""
    only = node.targets[0]
    return only.id if len(node.targets) == 1 and isinstance(only, ast.Name) else ""


def _targets(node: ast.Assign) -> list[str]:
    """Return the names that are assigned, none where other things are."""
    only = node.targets[0]
    parts = only.elts if isinstance(only, ast.Tuple) else node.targets
    names = [each.id for each in parts if isinstance(each, ast.Name)]
    return names if len(names) == len(parts) else []


def _scalars(node: ast.Assign) -> Iterator[tuple[str, ast.expr]]:
    """Give the constants that an assignment names, one or several: numbers and texts, or what is worked out of such."""
    values = node.value.elts if isinstance(node.value, ast.Tuple) else [node.value]
    for name, value in zip(_targets(node), values, strict=False):
        if all(isinstance(each, ast.Constant | ast.BinOp | ast.operator) for each in ast_nodes(value)):
            yield name, value


def _asks(value: ast.expr) -> bool:
    """Tell whether a value is got by a method of the driver: what it asks the instrument is told from outside."""
    return any(
        isinstance(each, ast.Call)
        and any(isinstance(part, ast.Name) and part.id == "self" for part in ast_nodes(each.func))
        for each in ast_nodes(value)
    )


def _uses(where: ast.AST, name: str) -> list[ast.Name]:
    return [
        each
        for each in ast_nodes(where)
        if isinstance(each, ast.Name) and each.id == name and isinstance(each.ctx, ast.Load)
    ]


def _is_get(parent: ast.AST) -> bool:
    return isinstance(parent, ast.Attribute) and parent.attr == "get"


def _pauses(node: ast.AST) -> Iterator[Any]:
    if isinstance(node, ast.While):
        # One that looks at the clock ends by it, wherever in it one pauses; another may count its looks.
        for each in ast_nodes(node) if ".now()" in ast.unparse(node) else node.body:
            if isinstance(each, ast.Expr) and isinstance(each.value, ast.Call):
                called = each.value.func
                if isinstance(called, ast.Attribute) and called.attr in ("sleep", "_pause"):
                    yield each
    elif isinstance(node, ast.Call) and ast.unparse(node.func) == "polls":
        yield node.args[2]


def _pieces(tree: ast.Module) -> Iterator[ast.AST]:
    for node in tree.body:
        name = _target(node) if isinstance(node, ast.Assign) else ""
        loops = [each for each in ast_nodes(tree) if isinstance(each, ast.For) and name in ast.unparse(each.iter)]
        if not name or name in _imported() or not loops:
            continue
        start = ast.unparse(loops[0].target)
        steps = ast.unparse(loops[0].iter).startswith("range(0, ") and ast.unparse(loops[0].iter).endswith(f", {name})")
        slices = [each for each in ast_nodes(loops[0]) if isinstance(each, ast.Slice)]
        whole = all(ast.unparse(each) == f"{start}:{start} + {name}" for each in slices)
        if len(loops) == 1 and steps and slices and whole and len(_uses(tree, name)) == len(slices) + 1:
            yield node


def _given_defaults(tree: ast.Module) -> Iterator[ast.AST]:
    for owner in (each for each in tree.body if isinstance(each, ast.ClassDef)):
        for made in (each for each in owner.body if isinstance(each, ast.FunctionDef) and each.name == "__init__"):
            calls = _calls_of(owner.name)
            made_here = [] if calls is None else [*calls, *_made_by_bases(owner)]
            for argument, default in zip(made.args.kwonlyargs, made.args.kw_defaults, strict=True):
                given = [any(one.arg == argument.arg for one in call.keywords) for call in made_here]
                if default is not None and given and all(given):
                    yield default


def _made_by_bases(owner: ast.ClassDef) -> Iterator[ast.Call]:
    """Give the calls by which the methods of what a class is derived from make one of it."""
    names = [ast.unparse(base).rpartition(".")[2] for base in owner.bases]
    for base in (each for tree in _modules() for each in tree.body if isinstance(each, ast.ClassDef)):
        if base.name in names:
            yield from _made_by_bases(base)
            for method in (each for each in base.body if isinstance(each, ast.FunctionDef)):
                same = {"cls"}
                for node in ast_nodes(method):
                    if isinstance(node, ast.AnnAssign) and node.value is not None and ast.unparse(node.value) == "cls":
                        same.add(ast.unparse(node.target))
                    elif isinstance(node, ast.Call) and ast.unparse(node.func) in same:
                        yield node


@cache
def _modules() -> tuple[ast.Module, ...]:
    return tuple(ast.parse(path.read_text(encoding="utf-8")) for path in sorted(_DRIVERS.rglob("*.py")))


@cache
def _words() -> tuple[frozenset[str], ...]:
    """Return the words of each of the drivers' modules: most have a name in a few of them only."""
    paths = sorted(_DRIVERS.rglob("*.py"))
    return tuple(frozenset(re.findall(r"\w+", path.read_text(encoding="utf-8"))) for path in paths)


@cache
def _shown(*, texts: bool = False) -> frozenset[str]:
    """Return the attributes that the drivers' modules read in messages only, or only in their `texts`."""
    shown, other = set(), set()
    for tree in _modules():
        said = (part for node in ast_nodes(tree) for part in _message(node) if not texts or isinstance(node, ast.Call))
        messages = {id(each) for part in said for each in ast_nodes(part)}
        for node in ast_nodes(tree):
            if isinstance(node, ast.Attribute) and isinstance(node.ctx, ast.Load):
                (shown if id(node) in messages else other).add(node.attr)
    return frozenset(name for name in shown - other if not _of_interfaces(name))


def _of_interfaces(name: str) -> bool:
    """Tell whether an attribute is one of an instrument, which others read as well."""
    interfaces = _DRIVERS / "interfaces"
    return any(f"def {name}(" in path.read_text(encoding="utf-8") for path in interfaces.glob("*.py"))


@cache
def _imported() -> frozenset[str]:
    """Return the names that a driver's module has from another."""
    imports = (node for tree in _modules() for node in ast_nodes(tree) if isinstance(node, ast.ImportFrom))
    return frozenset(alias.name for node in imports for alias in node.names)


def _is_init(node: ast.AST) -> bool:
    return isinstance(node, ast.FunctionDef) and node.name == "__init__"


@cache
def _calls_of(name: str) -> tuple[ast.Call, ...] | None:
    """Return the calls that make one of a class, None where it is also handed on or derived from."""
    calls: list[ast.Call] = []
    for tree in (each for each, words in zip(_modules(), _words(), strict=True) if name in words):
        places = [(tree, name)]
        places += [(owner, "cls") for owner in tree.body if isinstance(owner, ast.ClassDef) and owner.name == name]
        for place, called in places:
            here = [
                each
                for each in ast_nodes(place)
                if isinstance(each, ast.Call) and isinstance(each.func, ast.Name) and each.func.id == called
            ]
            derived = [
                node
                for node in ast_nodes(place)
                if isinstance(node, ast.ClassDef) and called in map(ast.unparse, node.bases)
            ]
            # What is only named as a type is neither made nor handed on.
            types = {id(each) for node in ast_nodes(place) for part in _annotations(node) for each in ast_nodes(part)}
            others = [use for use in _uses(place, called) if id(use) not in types]
            made = [
                each
                for node in derived
                for each in ast_nodes(node)
                if isinstance(each, ast.Call) and ast.unparse(each.func) == "super().__init__"
            ]
            plain = [node for node in derived if not any(_is_init(each) for each in node.body)]
            of_plain = [_calls_of(node.name) for node in plain]
            if None in of_plain or len(made) + len(plain) != len(derived) or len(here) + len(derived) != len(others):
                return None
            calls += here + made + [call for each in of_plain for call in each or ()]
    return tuple(calls)
