"""Events as lines of a journal: what is written is read again, and the schema says what stands there."""

import dataclasses
import gzip
import json
import typing
from collections.abc import Mapping, Sequence
from functools import cache
from pathlib import Path
from types import NoneType, UnionType
from typing import Annotated, Any, Union

import pytest
from hypothesis import given
from hypothesis import strategies as st
from jsonschema import Draft202012Validator

from bench.journal.codec import KINDS, RecordedEvent, UnknownEvent, decode, encode, event_of
from bench.journal.events.run import SCHEMA
from bench.journal.schema import DIALECT, journal_schema
from drivers.interfaces.text import Text, text
from procedures.core.actions import Action
from procedures.core.events import ActionStarted, Event, UnknownAction
from procedures.core.parameter_definition import ParameterDefinition
from procedures.core.result import Notice

RUNS = Path(__file__).parents[2] / "data" / "runs"
JOURNALS = sorted(path.relative_to(RUNS).as_posix() for path in RUNS.glob("*/*.jsonl*"))

WORDS = st.text(max_size=8)
NUMBERS = st.floats(allow_nan=False, allow_infinity=False) | st.just(float("inf"))
JSON = st.recursive(
    st.none() | st.booleans() | st.integers() | st.floats(allow_nan=False, allow_infinity=False) | WORDS,
    lambda inner: st.lists(inner, max_size=2) | st.dictionaries(WORDS, inner, max_size=2),
    max_leaves=4,
)
NOTICES = st.builds(Notice, WORDS, st.builds(lambda share: Text("{share}", {"share": share}), st.integers() | WORDS))

OWN = ParameterDefinition("own_figure", "x", "F", text("A figure of its own"), reader_unit="s/Ω")


def lines_of(name: str) -> list[bytes]:
    content = (RUNS / name).read_bytes()
    return (gzip.decompress(content) if name.endswith(".gz") else content).splitlines()


@cache
def values(hint: Any) -> st.SearchStrategy[Any]:
    """Return a strategy for what a field of this type may hold."""
    origin, arguments = typing.get_origin(hint), typing.get_args(hint)
    if hint in (Any, Text, Notice, str, int, float, bool, NoneType):
        known = {Any: JSON, Text: st.builds(Text, st.just("quantity")), Notice: NOTICES, str: WORDS, int: st.integers()}
        known |= {float: NUMBERS, bool: st.booleans(), NoneType: st.none()}
        return known[hint]
    if origin is Annotated:
        return values(arguments[0])
    if origin in (Union, UnionType):
        return st.one_of(*(values(each) for each in arguments if each is not UnknownAction))
    if origin in (Sequence, list):
        return st.lists(values(arguments[0]), max_size=2)
    if origin is tuple:
        each = [values(argument) for argument in arguments if argument is not ...]
        return st.lists(each[0], max_size=2).map(tuple) if ... in arguments else st.tuples(*each)
    if origin is Mapping:
        return st.dictionaries(values(arguments[0]), values(arguments[1]), max_size=2)
    return built(hint) if dataclasses.is_dataclass(hint) else st.sampled_from(hint)


def built(made: Any) -> st.SearchStrategy[Any]:
    hints = typing.get_type_hints(made, include_extras=True)
    if "definition" not in hints:
        return st.builds(made, **{each.name: values(hints[each.name]) for each in dataclasses.fields(made)})
    # A definition is of the figure that it stands with; one that is not in the table stands in the record.
    chosen = {each.name: values(hints[each.name]) for each in dataclasses.fields(made) if each.name != "definition"}
    own = {"name": st.just(OWN.name), "unit": st.just(OWN.unit), "definition": st.just(OWN)}
    return st.builds(made, **chosen) | st.builds(made, **chosen | {k: v for k, v in own.items() if k in hints})


@st.composite
def events(draw: st.DrawFn) -> Event:
    event: Event = draw(values(KINDS[draw(st.sampled_from(sorted(KINDS)))]))
    if isinstance(event, ActionStarted):
        details: Action = draw(values(Action))
        return dataclasses.replace(event, action=type(details).__name__, details=details)
    return event


@cache
def validator() -> Draft202012Validator:
    return Draft202012Validator(journal_schema())


@given(events(), st.integers(1, 10**9), st.floats(0.0, 1e9))
def test_what_is_written_is_read_again_and_fits_the_schema(event: Event, number: int, time: float) -> None:
    line = encode(RecordedEvent(number, "2026-11-22T12:00:00+00:00", time, event), "00" * 32)
    read = decode(line)
    assert read is not None
    assert (type(read[0].event), read[0].number, read[0].time, read[1]) == (type(event), number, time, "00" * 32)
    assert encode(read[0], read[1]) == line
    validator().validate(json.loads(line))


def test_every_event_that_may_be_written_can_be_read() -> None:
    def below(kind: type) -> set[type]:
        return {kind}.union(*(below(each) for each in kind.__subclasses__()))

    assert {each for each in below(Event) if each.kind} == set(KINDS.values())
    assert all(each.__dataclass_params__.frozen for each in KINDS.values())


@pytest.mark.parametrize("name", JOURNALS)
def test_the_bytes_of_older_runs_stay_and_fit_the_schema(name: str) -> None:
    lines = lines_of(name)
    for line in lines:
        read = decode(line)
        assert read is not None
        assert not isinstance(read[0].event, UnknownEvent), read
        assert encode(*read) == line
    # The demo's readings are one like another.
    for line in lines[:: 1 + len(lines) // 40]:
        validator().validate(json.loads(line))


def test_the_schema_is_a_schema_with_a_version_and_tells_what_is_durable() -> None:
    schema: Any = validator().schema
    Draft202012Validator.check_schema(schema)
    assert (schema["$schema"], schema["version"]) == (DIALECT, SCHEMA)
    kinds = {each["properties"]["kind"]["const"]: each for each in schema["oneOf"]}
    assert kinds.keys() == KINDS.keys()
    assert {kind for kind, each in kinds.items() if each["x-durable"]} == {
        "run_started", "run_resumed", "run_finished", "procedure_finished", "partial_result", "procedure_failed", "step_finished",
        "step_failed", "energising", "commanding", "record_failed", "guardian_ready",
    }  # fmt: skip
    assert {kind for kind, each in kinds.items() if each["x-closing"]} == {
        "instrument_error", "de_energising", "de_energised", "way_down_started", "step_failed", "procedure_failed",
        "made_safe", "record_failed", "run_finished",
    }  # fmt: skip


@pytest.mark.parametrize(
    "line",
    [
        '{"n":1,"wall":"","time":0.0,"kind":"reading","data":{"instrument":"supply"},"previous":""}',
        '{"n":1,"wall":"","time":0.0,"kind":"raeding","data":{},"previous":""}',
        '{"n":0,"wall":"","time":0.0,"kind":"lease_ended","data":{"faults":[]},"previous":""}',
    ],
)
def test_the_schema_refuses_what_no_run_writes(line: str) -> None:
    assert not validator().is_valid(json.loads(line))


def test_a_kind_of_a_newer_version_is_kept_as_it_stands() -> None:
    line = b'{"n":7,"wall":"w","time":1.5,"kind":"motor_sang","data":{"key":"A","notes":[1,2.0]},"previous":"ab"}'
    read = decode(line)
    assert read is not None
    assert read[0].event == UnknownEvent("motor_sang", {"key": "A", "notes": [1, 2.0]})
    assert encode(*read) == line


def test_a_newer_versions_field_is_passed_over() -> None:
    found = event_of("step_finished", {"step": "1/1", "time": 1.0, "mood": "good"})
    assert found == KINDS["step_finished"](step="1/1", time=1.0)


def test_data_that_do_not_fit_their_kind_say_why() -> None:
    found = event_of("step_finished", {"step": 5})
    assert isinstance(found, UnknownEvent)
    assert "step" in found.misfit
    assert found.data == {"step": 5}


def test_hand_work_of_a_newer_version_keeps_its_words() -> None:
    data = {"action": "PolishShaft", "details": {"grit": 400}, "text": ["Polish the shaft"]}
    found = event_of("action", data)
    assert found == ActionStarted(action="PolishShaft", details=UnknownAction({"grit": 400}), text=["Polish the shaft"])
    assert RecordedEvent(1, "", 0.0, found).data == data
