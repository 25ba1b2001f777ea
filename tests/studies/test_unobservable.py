"""What the study of mistakes leaves as it is, and what it does not."""

import ast

import pytest

from tests.studies.mistakes.mutants import path_of
from tests.studies.mistakes.unobservable import ast_nodes, unobservable

SOURCE = """
NAMES = {1: "one"}
LIMITS = {2: "two"}
PIECE = 16
SHOWN, BIT = 32, 33 << 34

class Meter:
    def __init__(self, *, name: str = "meter", wide: bool = 3 > 4):
        self.name = name

    def wait(self):
        self.clock.sleep(5)
        while self.busy():
            self.clock.sleep(6)

    def _remaining(self):
        if self.wide > 10:
            return self.read(11) * 12
        return 13

    def _named(self, what, value):
        if value > 25:
            raise ValueError(text("{what} is {value}", what=what, value=value))
        return value

    def check(self, value):
        self._named(26, value + 27)
        for start in range(0, 14, PIECE):
            self.write(value[start : start + PIECE])
        self.error.add_note(str(15))
        shown = value * 7
        low, high = (value * 17, 18) if value else (19, 20)
        asked = self.read(8)
        if value > LIMITS.get(9) and value & BIT:
            raise ValueError(
                text("{shown} {name}", shown=shown, name=NAMES.get(value), low=low, high=high, left=self._remaining(), bit=value & SHOWN),
                command=asked,
            )
        thread = Thread(target=self.wait, daemon=24 > 21, name=str(22))
        thread.start()
        thread.join(23)
        thread.join()
        while self.clock.now() < 28:
            if value:
                self.clock.sleep(29)
        while value:
            if value:
                self.clock.sleep(30)
        for last in polls(self.clock, 35, 36):
            pass

class Reads(Protocol):
    def read(self, *, size: int = 31): ...
"""


def left_alone(source: str) -> set[int]:
    tree = ast.parse(source)
    excluded = unobservable(tree)
    nodes = [node for node in ast_nodes(tree) if isinstance(node, ast.Constant) and isinstance(node.value, int)]
    return {node.value for node in nodes if id(node) in excluded and isinstance(node.value, int)}


def test_tables_and_figures_of_messages_and_pauses_that_look_again_are_left_alone() -> None:
    assert left_alone(SOURCE) == {1, 6, 7, 12, 13, 15, 16, 17, 18, 19, 20, 21, 22, 24, 26, 29, 31, 32, 36}


@pytest.mark.parametrize("number", [2, 4, 5, 8, 9, 10, 11, 14, 23, 25, 27, 28, 30, 33, 34, 35])
def test_what_can_be_told_from_outside_is_changed(number: int) -> None:
    assert number not in left_alone(SOURCE)


def test_a_default_that_every_call_gives_is_left_alone_where_its_class_is_also_named_as_a_type() -> None:
    tree = ast.parse(path_of("drivers.mjbots.controller").read_text(encoding="utf-8"))
    excluded = unobservable(tree)
    (made,) = (node for node in ast_nodes(tree) if isinstance(node, ast.FunctionDef) and node.name == "__init__")
    assert {ast.unparse(each) for each in made.args.kw_defaults if id(each) in excluded} == {
        "0", "None", "UNWATCHED", "False",
    }  # fmt: skip


def test_a_default_that_the_opening_of_a_base_gives_is_left_alone() -> None:
    tree = ast.parse(path_of("drivers.keysight.dmm_34461a").read_text(encoding="utf-8"))
    excluded = unobservable(tree)
    (made,) = (node for node in ast_nodes(tree) if isinstance(node, ast.FunctionDef) and node.name == "__init__")
    assert {ast.unparse(each) for each in made.args.kw_defaults if id(each) in excluded} == {"'voltmeter'", "False"}


def test_what_an_error_is_told_with_is_left_alone_and_not_that_it_is_one() -> None:
    tree = ast.parse(path_of("drivers.gwinstek.gpt9800").read_text(encoding="utf-8"))
    excluded = unobservable(tree)
    (told,) = (node for node in ast_nodes(tree) if isinstance(node, ast.FunctionDef) and node.name == "_unusable")
    (returned,) = (node for node in told.body if isinstance(node, ast.Return) and isinstance(node.value, ast.Call))
    assert id(returned) not in excluded
    assert isinstance(returned.value, ast.Call)
    assert all(id(one.value) in excluded for one in returned.value.keywords)
