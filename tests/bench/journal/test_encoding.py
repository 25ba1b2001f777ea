"""What is printed and kept of a result is JSON, whatever it holds."""

import json
import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from enum import Enum, IntEnum
from types import MappingProxyType
from typing import Any

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from bench.journal.encoding import indented, plain
from drivers.interfaces.text import Text
from procedures.core.result import Notice


class Colour(Enum):
    RED = "red"


class Number(IntEnum):
    ONE = 1


class Word(str):
    __slots__ = ()


class Marked(float):
    __slots__ = ()


@dataclass(frozen=True)
class Pair:
    first: Any
    second: Any


LEAVES = (
    st.none() | st.booleans() | st.integers() | st.floats() | st.text(max_size=8)
    | st.sampled_from(
        [Colour.RED, Number.ONE, Word("word"), Marked(0.1), 1 + 2j, b"\x01", np.float64(math.nan), np.int32(7), Text("{a}", {"a": 1}),
         Notice("name", Text("words")), np.arange(3.0), "\ud800", "\u2028\x7f\"\\"]
    )
)  # fmt: skip
KEYS = st.text(max_size=4) | st.integers(0, 3) | st.just(Colour.RED) | st.just("1")
VALUES = st.recursive(
    LEAVES,
    lambda inner: (
        st.lists(inner, max_size=3)
        | st.tuples(inner, inner)
        | st.dictionaries(KEYS, inner, max_size=3)
        | st.dictionaries(KEYS, inner, max_size=2).map(MappingProxyType)
        | st.builds(Pair, inner, inner)
    ),
    max_leaves=12,
)


def by_the_library(value: object) -> str:
    return json.dumps(plain(value), ensure_ascii=False, allow_nan=False, indent=2)


@given(VALUES)
def test_the_text_over_several_lines_is_the_library_s_of_the_plain_value(value: object):
    assert indented(value) == by_the_library(value)


def nested(depth: int) -> Mapping[str, Any] | Sequence[Any]:
    value: Any = {"deepest": (1.0,)}
    for level in range(depth):
        value = [value] if level % 2 else {"in": value, "beside": {}}
    return value


@pytest.mark.parametrize("depth", range(12, 22))
def test_deep_values_are_told_from_the_same_depth_on(depth):
    assert indented(nested(depth)) == by_the_library(nested(depth))


def test_what_contains_itself_comes_to_an_end():
    ring: list[Any] = [1]
    ring.append(ring)

    assert indented(ring) == by_the_library(ring)
