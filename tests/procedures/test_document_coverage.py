"""Every step of the document stands in exactly one place of exactly one procedure."""

import tomllib
from collections import Counter
from pathlib import Path

import pytest

from bench.plugins.catalogues import installed

DOCUMENT = tomllib.loads((Path(__file__).parents[1] / "data" / "document_steps.toml").read_text())
SPECIFICATION = Path(__file__).parents[3] / "shared" / "spec" / "steps.toml"


def test_every_procedure_has_the_steps_of_the_document_in_its_order():
    assert {name: [s.identifier for s in cls.steps()] for name, cls in installed().procedures.items()} == {
        name: list(DOCUMENT[name]) for name in installed().procedures
    }
    assert set(installed().procedures) == set(DOCUMENT)


def test_no_step_stands_twice():
    counts = Counter(s.identifier for cls in installed().procedures.values() for s in cls.steps())
    assert {identifier: n for identifier, n in counts.items() if n != 1} == {}


def test_the_list_of_steps_is_the_specification_s():
    if not SPECIFICATION.exists():
        pytest.skip("the specification's list of steps is not beside this checkout")
    specified = tomllib.loads(SPECIFICATION.read_text())
    assert {name.replace("_", "-"): set(steps) for name, steps in specified.items()} == {
        name: set(steps) for name, steps in DOCUMENT.items() if not any(step[0] in "LMS" for step in steps)
    }


def test_steps_that_hands_do_are_marked():
    if not SPECIFICATION.exists():
        pytest.skip("the specification's list of steps is not beside this checkout")
    specified = tomllib.loads(SPECIFICATION.read_text())
    by_hand = {i for steps in specified.values() for i, words in steps.items() if "(hand" in words}
    marked = {s.identifier for cls in installed().procedures.values() for s in cls.steps() if s.by_hand}
    assert by_hand - marked == set()
