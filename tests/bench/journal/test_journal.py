import hashlib
import json
import math
import os
import threading
from decimal import Decimal
from enum import Enum
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from bench.i18n.errors import InputError
from bench.journal.codec import RecordedEvent, event_of
from bench.journal.encoding import dumps
from bench.journal.journal import Journal
from bench.journal.journal_file import read_journal
from bench.journal.run_view import view_of
from drivers.interfaces.text import text
from procedures.core.actions import ALIGN_D
from procedures.core.events import WarningGiven
from tests.journals import event


class Colour(Enum):
    RED = "red"


class Nasty:
    def __str__(self) -> str:
        raise RuntimeError("no words")


odd = st.recursive(
    st.one_of(
        st.none(),
        st.booleans(),
        st.integers(),
        st.floats(allow_nan=True, allow_infinity=True),
        st.complex_numbers(),
        st.text(alphabet=st.characters(exclude_categories=())),
        st.binary(max_size=20),
        st.sampled_from(
            [Colour.RED, Nasty(), ALIGN_D, text("{a}", a=1), text("{missing}"), np.float64("nan"), Decimal(1)]
        ),
        st.just(np.arange(3)),
    ),
    lambda inner: st.one_of(
        st.lists(inner, max_size=4),
        st.tuples(inner),
        st.dictionaries(st.one_of(st.text(), st.integers(), st.sampled_from(Colour)), inner, max_size=4),
    ),
    max_leaves=8,
)


@settings(max_examples=60, deadline=None)
@given(st.dictionaries(st.text(), odd, max_size=4))
def test_nothing_breaks_a_line(data: dict[str, Any]) -> None:
    line = dumps({"data": data})
    assert "\n" not in line
    raw = json.loads(line, parse_constant=lambda word: pytest.fail(f"{word} is not JSON"))
    assert set(raw) == {"data"}


@settings(max_examples=40, deadline=None)
@given(st.lists(st.dictionaries(st.text(), odd, max_size=3), max_size=6), st.data())
def test_a_journal_cut_anywhere_is_read_up_to_the_cut(
    tmp_path_factory: pytest.TempPathFactory, readings: list[dict[str, Any]], data: st.DataObject
) -> None:
    path = tmp_path_factory.mktemp("cut") / "journal.jsonl"
    journal = Journal(path, lambda: 0.0)
    for value in readings:
        journal.record(event("reading", value=value))
    journal.close()
    content = path.read_bytes()
    cut = data.draw(st.integers(0, len(content)))
    path.write_bytes(content[:cut])
    read = read_journal(path)
    whole = content[:cut].count(b"\n")
    assert len(read.events) == whole
    assert read.torn == (cut > 0 and content[cut - 1 : cut] != b"\n")
    # And it can be written on where it was cut.
    again = Journal(path, lambda: 1.0, previous=read)
    again.record(event("lease_ended"))
    again.close()
    continued = read_journal(path)
    assert [event.kind for event in continued.events] == ["reading"] * whole + ["lease_ended"]
    assert not continued.torn


def test_an_event_is_with_the_system_when_the_call_returns(tmp_path: Path) -> None:
    path = tmp_path / "journal.jsonl"
    journal = Journal(path, lambda: 2.5)
    journal.record(event("reading", instrument="lcr_meter", call="measure", value={"value": math.nan, "unit": "Ω"}))
    (line,) = path.read_bytes().splitlines()
    raw = json.loads(line)
    assert (raw["n"], raw["time"], raw["kind"]) == (1, 2.5, "reading")
    assert raw["data"] == {"instrument": "lcr_meter", "call": "measure", "value": {"value": "NaN", "unit": "Ω"}}
    journal.record(event("warning"))
    assert json.loads(path.read_bytes().splitlines()[1])["previous"] == hashlib.sha256(line).hexdigest()
    journal.close()
    journal.close()


def test_durable_kinds_are_forced_to_the_disk(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    journal = Journal(tmp_path / "journal.jsonl", lambda: 0.0)
    synced: list[int] = []
    monkeypatch.setattr(os, "fsync", synced.append)
    journal.record(event("reading"))
    assert synced == []
    journal.record(event("energising"))
    journal.record(event("run_started"))
    assert len(synced) == 2
    journal.close()
    assert len(synced) == 2


@pytest.mark.parametrize("following", ["step_started", "energising"])
def test_a_step_s_end_reaches_the_disk_with_the_event_that_follows(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, following: str
) -> None:
    path = tmp_path / "journal.jsonl"
    journal = Journal(path, lambda: 0.0)
    lines: list[int] = []
    monkeypatch.setattr(os, "fsync", lambda _: lines.append(len(path.read_bytes().splitlines())))
    journal.record(event("step_finished"))
    assert lines == []
    journal.record(event(following))
    assert lines == [2]
    journal.record(event("reading"))
    assert lines == [2]
    journal.record(event("step_finished"))
    journal.close()
    assert lines == [2, 4]


def test_a_changed_line_is_noticed(tmp_path: Path) -> None:
    path = tmp_path / "journal.jsonl"
    journal = Journal(path, lambda: 0.0)
    for value in (1, 2, 3):
        journal.record(event("reading", value=value))
    journal.close()
    path.write_bytes(path.read_bytes().replace(b'"value":2', b'"value":7'))
    with pytest.raises(InputError, match="line 3 does not follow"):
        read_journal(path)
    path.write_bytes(b"not json\n" + path.read_bytes())
    with pytest.raises(InputError, match="line 1 is not an event"):
        read_journal(path)


def test_threads_do_not_mix_their_lines(tmp_path: Path) -> None:
    path = tmp_path / "journal.jsonl"
    journal = Journal(path, lambda: 0.0)
    threads = [
        threading.Thread(target=lambda: [journal.record(event("traffic", content="y" * 200)) for _ in range(50)])
        for _ in range(4)
    ]
    for thread in threads:
        thread.start()
    for thread in threads:
        thread.join()
    journal.close()
    assert len(read_journal(path).events) == 200


def test_listeners_hear_what_was_written(tmp_path: Path) -> None:
    heard = []
    journal = Journal(tmp_path / "journal.jsonl", lambda: 0.0)
    journal.listen(heard.append)
    journal.record(event("warning", id="E1"))
    journal.close()
    assert heard == [WarningGiven(id="E1", message="")]


@pytest.mark.parametrize(
    ("template", "values"),
    [
        ("{a:*1f}", {"a": 1.5}),
        ("{a:>9999999999}", {"a": 1.5}),
        ("{a.__class__}", {"a": 1.5}),
        ("{b}", {"a": 1.5}),
        ("{a:d}", {"a": 1.5}),
        ("{", {}),
        ("{a}", {"a": {"wrong": 1}}),
    ],
)
def test_a_sentence_that_cannot_be_said_is_no_event_of_a_run(template: str, values: dict[str, Any]) -> None:
    data = {"procedure": "", "warning": {"id": "E1", "text": {"template": template, "values": values}}}
    with pytest.raises(InputError, match=r"event 1 \(known_before\) is not as this version of motorbench writes it"):
        view_of([RecordedEvent(1, "", 0.0, event_of("known_before", {**data, "message": ""}))])
