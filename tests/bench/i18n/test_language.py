import ast
import re
from collections.abc import Iterator
from pathlib import Path
from string import Formatter

import pytest

from bench.i18n.errors import UsageError
from bench.i18n.language import catalogue, language_of, translator
from bench.i18n.phrasebook import translate_said
from drivers.interfaces.text import text
from procedures.core.actions import ALIGN_D
from procedures.core.bench import Role

ROOT = Path(__file__).parents[3]


def literals(node: ast.expr | None) -> Iterator[str]:
    if isinstance(node, ast.Constant) and isinstance(node.value, str):
        yield node.value
    elif isinstance(node, ast.IfExp):
        yield from literals(node.body)
        yield from literals(node.orelse)


def phrases_at(node: ast.AST) -> Iterator[str]:
    """Estimators and conventions of parameters, which reports show: keywords of calls, and constants of these names."""
    if isinstance(node, ast.Call):
        for word in node.keywords:
            if word.arg in ("estimator", "convention"):
                yield from literals(word.value)
    if isinstance(node, ast.Assign) and ast.unparse(node.targets[0]) in ("CONVENTION", "DERIVED", "convention"):
        yield from literals(node.value)


def templates_at(node: ast.AST) -> Iterator[str]:
    """Templates are the first argument of text(…), the second of a step's decorator, and a class's title."""
    if isinstance(node, ast.Call) and isinstance(node.func, ast.Name):
        position = {"text": 0, "step": 1}.get(node.func.id)
        if position is not None and len(node.args) > position:
            yield from literals(node.args[position])
    if isinstance(node, ast.ClassDef):
        for statement in node.body:
            if isinstance(statement, ast.AnnAssign) and ast.unparse(statement.target) == "title":
                yield from literals(statement.value)


def described_at(node: ast.AST) -> Iterator[str]:
    """What a setting or a file's key takes: the description of its field, which a value that is not right is answered with."""
    if isinstance(node, ast.Call) and isinstance(node.func, ast.Name) and node.func.id in ("Field", "number"):
        for word in node.keywords:
            if word.arg == "description":
                assert not isinstance(word.value, ast.JoinedStr), ast.unparse(node)
                yield from literals(word.value)


def spoken_at(node: ast.AST) -> Iterator[str]:
    """What a driver used by hand says: the text of confirm(…), quantity and context of a reading, figures as {0}, {1} …"""
    if isinstance(node, ast.Assign) and ast.unparse(node.targets[0]) == "quantity":
        yield from literals(node.value)
    if not (
        isinstance(node, ast.Call)
        and isinstance(node.func, ast.Attribute)
        and node.func.attr in ("confirm", "ask", "_reading")
    ):
        return
    for argument in (node.args[0], *node.args[4:], *(word.value for word in node.keywords if word.arg == "context")):
        if isinstance(argument, ast.Constant):
            yield argument.value
        elif isinstance(argument, ast.JoinedStr):
            count = 0
            words = ""
            for part in argument.values:
                if isinstance(part, ast.Constant):
                    words += str(part.value)
                else:
                    words += f"{{{count}}}"
                    count += 1
            yield words


def templates() -> dict[str, str]:
    found: dict[str, str] = {}
    for folder, finder in ((name, templates_at) for name in ("procedures", "reports", "bench", "drivers")):
        for path in sorted((ROOT / folder).rglob("*.py")):
            for node in ast.walk(ast.parse(path.read_text(encoding="utf-8"))):
                found_here = [*finder(node), *described_at(node), *(phrases_at(node) if folder == "procedures" else ())]
                for template in filter(None, found_here):
                    found.setdefault(template, str(path.relative_to(ROOT)))
    for path in sorted((ROOT / "drivers" / "manual").rglob("*.py")):
        if path.name == "prompt.py":
            continue
        for node in ast.walk(ast.parse(path.read_text(encoding="utf-8"))):
            for template in spoken_at(node):
                found.setdefault(template, str(path.relative_to(ROOT)))
    return found | {role.value: "procedures/core/bench.py" for role in Role}


def fields(template: str) -> list[str]:
    return sorted(name for _, name, _, _ in Formatter().parse(template) if name is not None)


def test_everything_that_people_read_has_its_chinese() -> None:
    chinese = catalogue("zh")
    missing = {template: where for template, where in templates().items() if template not in chinese}
    assert not missing, "\n".join(f"{where}: {template!r}" for template, where in missing.items())


def test_translations_take_the_same_values() -> None:
    for english, chinese in catalogue("zh").items():
        assert fields(english) == fields(chinese), english


def test_translations_are_chinese() -> None:
    same = {"u", "u, %", "{terminal} → {socket}", "{terminal} ({colour}) → {socket}", "{instrument}, {quantity}"}
    for english, chinese in catalogue("zh").items():
        if english not in same:
            assert re.search(r"[、：（一-鿿]", chinese), english


def test_no_template_is_left_over() -> None:
    known = templates()
    colours = {"white", "green", "black", "red", "yellow", "blue", "brown", "grey", "orange", "purple", "pink"}
    assert set(catalogue("zh")) - set(known) <= colours


def test_a_sentence_with_values_inside_values() -> None:
    said = [line.render(translator("zh")) for line in ALIGN_D.lines({"A": "white"})]
    assert "白" in said[1]
    assert "正" in said[1]


def test_what_a_driver_says_is_recognised_with_its_figures() -> None:
    chinese = catalogue("zh")
    said = translate_said(
        "Set the supply to 1.5 V, current limit 2.9 A; over-current protection on where it has one.", chinese
    )
    assert "1.5 V" in said
    assert "2.9 A" in said
    assert "supply" not in said
    assert translate_said("Something else entirely.", chinese) == "Something else entirely."
    assert translate_said("Switch the supply on now.", {}).startswith("Switch the supply")


@pytest.mark.parametrize(
    ("wish", "environment", "language"),
    [
        ("en", {"LANG": "zh_CN.UTF-8"}, "en"),
        ("zh", {}, "zh"),
        ("auto", {"LANG": "zh_CN.UTF-8"}, "zh"),
        ("auto", {"LC_ALL": "C", "LANG": "zh_CN.UTF-8"}, "en"),
        ("auto", {"LC_MESSAGES": "zh_TW"}, "zh"),
        ("auto", {}, "en"),
    ],
)
def test_the_language_follows_the_wish_then_the_locale(wish: str, environment: dict[str, str], language: str) -> None:
    assert language_of(wish, environment) == language


def test_an_unknown_language_is_refused() -> None:
    with pytest.raises(UsageError, match="--language de: allowed are en, zh and auto"):
        language_of("de")


def test_english_is_the_template_itself() -> None:
    assert text("{a} V", a=1).render(translator("en")) == "1 V"
