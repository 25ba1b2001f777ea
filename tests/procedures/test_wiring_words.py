"""Every mistake that a check may record has a sentence, and its record is data."""

import json

import pytest

from bench.i18n.language import catalogue, translator
from procedures.core.actions import (
    ALIGN_D,
    ALIGN_Q,
    ALL_OPEN,
    ConnectProbes,
    ConnectVoltmeter,
    CurrentProbe,
    Node,
    Terminal,
    VoltageProbe,
)
from procedures.estimation.emf.probed_phases import patterns
from procedures.estimation.winding.wiring import Kind, SensingLeads, mistakes
from procedures.verification import messages as words
from procedures.verification.check import connection_record, connections_of, mistake_record
from procedures.verification.two_poles import poles_of

COLOURS = {"A": "white", "C": "black"}
TOLD = SensingLeads((0, 1), (0, 1))


def records():
    for connect in (ALIGN_D, ALIGN_Q):
        for channels in ((None, None), (1, 4)):
            yield from (mistake_record(m, TOLD, channels) for m in mistakes(poles_of(connect), TOLD))
    for pattern in patterns():
        yield {
            "kind": pattern.fault.value,
            "terminals": ["ABC"[k] for k in pattern.terminals],
            "channel": pattern.channel,
        }
    yield from (
        {"kind": kind, "terminals": ["C"], "by": "inverter", "channel": 1}
        for kind in ("third", "refused", "order", "no voltage", "tenth", "channel", "contacts")
    )


@pytest.mark.parametrize("language", ["en", "zh"])
def test_every_record_has_its_sentence(language):
    translate = translator(language)
    said = set()
    for record in records():
        if record["kind"] == Kind.NONE.value:
            continue
        assert json.loads(json.dumps(record)) == record
        words_of_it = words.mistake(record, COLOURS).render(translate)
        assert "{" not in words_of_it
        assert words_of_it
        said.add(words_of_it)
    assert len(said) > 40


def test_outcomes_and_reasons_are_translated():
    chinese = catalogue("zh")
    for told in (*words.OUTCOMES.values(), *words.REASONS.values()):
        assert told.template in chinese


def test_a_record_of_another_version_says_so():
    with pytest.raises(ValueError, match="not known to this version"):
        words.mistake({"kind": "melted", "terminals": ["A"]}, {})


def test_alternatives_are_joined_and_said_once():
    joined = {"kind": "joined", "terminals": ["C"]}
    assert str(words.found([joined, joined], COLOURS)) == "C (black) is connected, and should be open"
    two = [{"kind": "open", "terminals": ["A"]}, {"kind": "open", "terminals": ["B"]}]
    assert str(words.found(two, COLOURS)) == "one of these is open (wire off, or phase broken): A (white), B"
    mixed = [joined, {"kind": "exchanged", "terminals": ["A", "B"], "earlier": True}]
    assert str(words.found(mixed, {})) == (
        "C is connected, and should be open, or in the previous connection, A and B are interchanged"
    )


def test_connections_survive_their_record():
    made = [
        ALIGN_D,
        ConnectVoltmeter(Terminal.A, Terminal.C),
        ConnectProbes((VoltageProbe(1, Node.A, Node.ARTIFICIAL_STAR), CurrentProbe(4, Terminal.B))),
    ]
    record = {}
    for connection in made:
        record |= connection_record(connection)
    restored = connections_of(json.loads(json.dumps(record)))
    assert restored[0].complete() == ALIGN_D.complete()
    assert restored[1:] == made[1:]
    assert connections_of(connection_record(ALL_OPEN)) == [ALL_OPEN]
