import json

import pytest

from bench.journal.encoding import dumps
from bench.journal.stored_action import restore_action
from drivers.interfaces.text import text
from procedures.core.actions import (
    ALIGN_Q,
    Action,
    ChangeSetup,
    ConnectProbes,
    ConnectVoltmeter,
    CurrentProbe,
    DoByHand,
    EnterReading,
    LockRotor,
    MarkRestPositions,
    Mend,
    Node,
    StartTurning,
    Terminal,
    VoltageProbe,
)
from procedures.core.setup import BenchSetup, metered, wired
from procedures.core.setup_order import ordered_changes

THERE = BenchSetup(rotor_locked=True).having(wired(ALIGN_Q.terminals) | metered(Terminal.B, Terminal.C))


@pytest.mark.parametrize(
    "action",
    [
        ALIGN_Q,
        ConnectProbes((VoltageProbe(1, Node.A, Node.ARTIFICIAL_STAR), CurrentProbe(4, Terminal.C))),
        ConnectVoltmeter(Terminal.A, Terminal.B),
        LockRotor(),
        ChangeSetup(ordered_changes(BenchSetup(), THERE), BenchSetup(), THERE),
        MarkRestPositions(2),
        StartTurning(0.5),
        EnterReading("winding_temperature", text("the winding's temperature"), "°C", -60.0, 250.0, (5.0, 45.0)),
        DoByHand(text("Shut the hatch")),
        Mend(text("A is open"), (text("Connect the motor's terminals:"), text("A → supply, plus"))),
    ],
)
def test_an_action_comes_back_from_the_journal_as_it_was(action: Action) -> None:
    line = dumps({"action": type(action).__name__, "details": action})
    assert restore_action(json.loads(line)) == action


@pytest.mark.parametrize(
    "event",
    [
        {},
        {"action": "Weld", "details": {}},
        {"action": "Connect", "details": {}},
        {"action": "Connect", "details": {"terminals": {"D": "supply+"}}},
        {"action": "LockRotor"},
    ],
)
def test_what_is_no_action_is_refused_in_words(event: dict[str, object]) -> None:
    with pytest.raises(ValueError, match=r"the journal's action|is not a valid"):
        restore_action(event)
