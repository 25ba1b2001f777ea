import ast
import re
from collections.abc import Iterator
from functools import cache
from pathlib import Path
from string import Formatter

import pytest

from bench.i18n.errors import UsageError
from bench.i18n.language import catalogue, former, language_of, translator
from bench.journal.verification import Integrity
from drivers.interfaces.text import text
from procedures.core.actions import ALIGN_D
from procedures.core.bench import Role
from procedures.core.parameters import PARAMETERS
from tests.bench.i18n.help_pages import asked_for

ROOT = Path(__file__).parents[3]


def dotted(node: ast.AST) -> str:
    """A name as it is written; whatever else it may be is taken apart by ast, which takes a hundred times as long."""
    if isinstance(node, ast.Name):
        return node.id
    return f"{dotted(node.value)}.{node.attr}" if isinstance(node, ast.Attribute) else ast.unparse(node)


def literals(node: ast.expr | None) -> Iterator[str]:
    if isinstance(node, ast.Constant) and isinstance(node.value, str):
        yield node.value
    elif isinstance(node, ast.IfExp):
        yield from literals(node.body)
        yield from literals(node.orelse)


def phrases_at(node: ast.AST) -> Iterator[str]:
    """Estimators of parameters, which reports show: keywords of calls, and constants of this name."""
    if isinstance(node, ast.Call):
        for word in node.keywords:
            if word.arg == "estimator":
                yield from literals(word.value)
    if isinstance(node, ast.Assign) and dotted(node.targets[0]) == "DERIVED":
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


def terms_at(node: ast.AST) -> Iterator[str]:
    """A set point's name and whose limit it passes, which an error takes in by themselves; keys of a file stay as they are."""
    if isinstance(node, ast.Call) and dotted(node.func) in SET_POINTS:
        for position in [position for position in (1, 6) if position < len(node.args)]:
            yield from (
                term for term in literals(node.args[position]) if term.islower() and not re.search("_|^0x", term)
            )


def meanings_at(node: ast.AST) -> Iterator[str]:
    """What the operating system's error numbers mean."""
    if isinstance(node, ast.Assign) and dotted(node.targets[0]) in ("MEANINGS", "_UNKNOWN_HOST"):
        for value in node.value.values if isinstance(node.value, ast.Dict) else (node.value,):
            yield from literals(value)


#: What names an input of a budget by its first argument, and what passes one on.
INPUTS = (
    "statistical",
    "limit",
    "standard",
    "one_sided",
    "instrument",
    "estimate",
    "with_errors",
    "_mean",
    "_torque",
    "_backwards",
    "_quantities",
)


def inputs_at(node: ast.AST) -> Iterator[str]:
    """The inputs of budgets: names of what is uncertain, and what an accuracy rests on; a document's title stays as it is."""
    if isinstance(node, ast.Call) and isinstance(node.func, ast.Attribute) and node.func.attr in INPUTS:
        for argument in node.args[:2]:
            yield from literals(argument)
    if isinstance(node, ast.Call) and dotted(node.func) == "_Kind":
        yield from literals(node.args[1])
    if isinstance(node, ast.Call) and dotted(node.func) in ("Accuracy", "OscilloscopeData", "replace"):
        yield from (
            said for word in node.keywords if (word.arg or "").endswith("source") for said in whole_parts(word.value)
        )
    if isinstance(node, ast.Assign) and dotted(node.targets[0]).endswith(
        ("SOURCE", "FULL_SCALE_READING", "_SKEW", "_ESTIMATORS")
    ):
        for value in node.value.values if isinstance(node.value, ast.Dict) else (node.value,):
            yield from whole_parts(value)


def written_from_at(node: ast.AST) -> Iterator[str]:
    """What a driver was written from."""
    made = [w.value for w in node.keywords if w.arg == "sources"] if isinstance(node, ast.Call) else []
    if isinstance(node, ast.Assign) and dotted(node.targets[0]).endswith("_SOURCES"):
        made.append(node.value)
    yield from (said for one in made if isinstance(one, ast.Tuple) for each in one.elts for said in literals(each))


def slugs_at(node: ast.AST) -> Iterator[str]:
    """Short names of procedures and findings: they are typed as they stand, and told in the reader's words."""
    if isinstance(node, ast.AnnAssign) and dotted(node.target) == "name" and "ClassVar" in ast.unparse(node.annotation):
        yield from literals(node.value)
    if isinstance(node, ast.ClassDef) and node.name == "Cause":
        yield from (said for one in node.body if isinstance(one, ast.Assign) for said in literals(one.value))
    if isinstance(node, ast.Assign) and dotted(node.targets[0]).endswith("_WARNING"):
        yield from literals(node.value)
    if isinstance(node, ast.Call) and dotted(node.func) == "Notice" and node.args:
        yield from (given for given in literals(node.args[0]) if given.islower())


def whole_parts(node: ast.expr) -> Iterator[str]:
    """What stands between semicolons, without what is filled in."""
    if isinstance(node, ast.JoinedStr):
        said = "".join(str(p.value) if isinstance(p, ast.Constant) else "\0" for p in node.values)
        yield from (part for part in said.split("; ") if "\0" not in part)
    else:
        yield from (part for given in literals(node) for part in given.split("; "))


#: Their second argument is a parameter's name.
SET_POINTS = ("check_setpoint", "SetpointError", "NotOfferedError")


def sentences_at(node: ast.AST) -> Iterator[ast.expr]:
    """What a driver's error says and advises, and what is asked of a person who sets and reads an instrument."""
    if not isinstance(node, ast.Call):
        return
    called = dotted(node.func)
    name = called.split(".")[-1]
    keywords = {word.arg: word.value for word in node.keywords}
    if name.endswith("Error") and name not in (*SET_POINTS, "KeyError", "TypeError"):
        yield from node.args[0 if name == "ValueError" else 1 : 2]
        yield from (keywords[key] for key in ("what", "remedy") if key in keywords)
    if name in SET_POINTS:
        yield from (one for one in node.args[1:2] if not isinstance(one, ast.Constant))
    if called.endswith(("_questions.confirm", "_questions.ask", "_questions.stated", "self._reading")):
        yield from node.args[1 if name == "stated" else 0 :][:1]
        yield from (*node.args[4:5], *(keywords[key] for key in ("context", "stated_of") if key in keywords))


def bare(node: ast.expr) -> bool:
    """Whether it is a finished sentence, which no catalogue can translate."""
    if isinstance(node, ast.IfExp):
        return bare(node.body) or bare(node.orelse)
    if isinstance(node, ast.Call):
        return dotted(node.func) in ("str", "repr") or dotted(node.func).endswith((".join", ".format"))
    return isinstance(node, ast.JoinedStr | ast.BinOp) or (isinstance(node, ast.Constant) and bool(node.value))


def said_at(node: ast.AST, where: str) -> Iterator[str]:
    """What people read of a piece of the file `where`."""
    yield from filter(None, (*templates_at(node), *described_at(node)))
    folder = where.split("/")[0]
    if folder == "procedures":
        yield from filter(None, phrases_at(node))
    if folder == "drivers":
        yield from (*terms_at(node), *meanings_at(node), *written_from_at(node))
    if where.startswith(("procedures/", "drivers/", "bench/analysis/", "bench/virtual/")):
        named = (*inputs_at(node), *(slugs_at(node) if folder == "procedures" else ()))
        yield from (name for name in named if re.search("[a-z]{2}", name))


#: Pieces of code that may say something; a million others are passed over.
SAYING = frozenset((ast.Call, ast.ClassDef, ast.Assign, ast.AnnAssign))


@cache
def templates() -> dict[str, str]:
    found: dict[str, str] = {}
    for folder in ("procedures", "reports", "bench", "drivers"):
        for path in sorted((ROOT / folder).rglob("*.py")):
            where = str(path.relative_to(ROOT))
            for node in ast.walk(ast.parse(path.read_text(encoding="utf-8"))):
                if type(node) in SAYING:
                    found |= {template: where for template in said_at(node, where) if template not in found}
    for piece, where in asked_for().items():
        found.setdefault(piece, where)
    found |= {each.value: "bench/journal/verification.py" for each in Integrity}
    found |= dict.fromkeys(("completed", "failed", "aborted", "interrupted"), "bench/journal/run_view.py")
    found |= {each.convention: "procedures/core/parameters.py" for each in PARAMETERS.values() if each.convention}
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


def test_sentences_of_older_journals_keep_their_chinese() -> None:
    older = former("zh")
    assert not set(older) & set(templates())
    for english, chinese in older.items():
        assert fields(english) == fields(chinese), english
    assert translator("zh")("'{typed}' may be {one} or {other}; type one of them").startswith("“{typed}”")
    assert translator("zh")("no version ever said {this}") == "no version ever said {this}"


def test_translations_are_chinese() -> None:
    same = {
        "u",
        "u, %",
        "· {procedure}",
        "{terminal} → {socket}",
        "{terminal} ({colour}) → {socket}",
        "{instrument}, {quantity}",
        "{finding}. {remedy}",
    }
    for english, chinese in catalogue("zh").items():
        if english not in same:
            assert re.search(r"[、：；（一-鿿]", chinese), english


def test_no_template_is_left_over() -> None:
    known = templates()
    colours = {"white", "green", "black", "red", "yellow", "blue", "brown", "grey", "orange", "purple", "pink"}
    assert set(catalogue("zh")) - set(known) <= colours


def test_one_word_for_one_thing() -> None:
    page = (ROOT / "docs" / "reference" / "chinese-terms.md").read_text(encoding="utf-8")
    ruled_out = [word for words in re.findall(r"\| not ([^;|(]*)", page) for word in words.strip().split(", ")]
    assert "流程" in ruled_out
    assert not [said for said in catalogue("zh").values() if any(word in said for word in ruled_out)]


def test_a_sentence_with_values_inside_values() -> None:
    said = [line.render(translator("zh")) for line in ALIGN_D.lines({"A": "white"})]
    assert "白" in said[1]
    assert "正" in said[1]


def test_no_driver_says_a_finished_sentence() -> None:
    said = [
        f"{path.relative_to(ROOT)}:{sentence.lineno}: {ast.unparse(sentence)}"
        for path in sorted((ROOT / "drivers").rglob("*.py"))
        # What a catalogue refuses is a mistake of the program that asks it, not of a person.
        if path.name != "catalogue.py"
        for node in ast.walk(ast.parse(path.read_text(encoding="utf-8")))
        for sentence in sentences_at(node)
        if bare(sentence)
    ]
    assert not said, "\n".join(said)


@pytest.mark.parametrize(
    "code",
    [
        'MeasurementError(self._name, f"{voltage} V is too much")',
        'ReportedError(self._name, text("the output stays on"), remedy="Press the emergency stop")',
        'ValueError("no reading of a test")',
        "CommunicationError(name, str(error))",
        'self._questions.confirm("Press Single.")',
        'self._questions.ask(text("speed"), "rpm", 0.0, 9.0, "of the shaft")',
        'check_setpoint(name, f"range of channel {channel}", value, "V", low, high, whose)',
    ],
)
def test_a_finished_sentence_is_noticed(code: str) -> None:
    call = ast.parse(code).body[0]
    assert isinstance(call, ast.Expr)
    assert any(bare(sentence) for sentence in sentences_at(call.value))


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
