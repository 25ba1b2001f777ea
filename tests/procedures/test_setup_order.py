"""Careful hands: what comes off, what stays and what goes on first, over any order of what procedures want."""

from collections.abc import Sequence
from typing import Any, cast

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from drivers.interfaces import Role
from drivers.interfaces.text import text
from procedures.core.actions import (
    ALIGN_D,
    ALIGN_Q,
    ALL_OPEN,
    ALL_SHORTED,
    DRIVE,
    INVERTER,
    STEP_NEGATIVE,
    ChangeSetup,
    Connect,
    ConnectProbes,
    ConnectVoltmeter,
    ConnectVoltmeterToSupply,
    CoupleDynamometer,
    CurrentProbe,
    DisconnectVoltmeter,
    DoByHand,
    HandWork,
    LockRotor,
    Node,
    ReleaseRotor,
    SeparateMeterLeads,
    ShortMeterLeads,
    Socket,
    Terminal,
    UncoupleDynamometer,
    VoltageProbe,
    Wanted,
    meter_across,
    meter_series_parallel,
    phases_on,
    supply_across,
)
from procedures.core.bench import Bench, ProcedureError
from procedures.core.setup import BenchSetup
from sim_instruments.clock.virtual_clock import VirtualClock
from tests.studies.hands import Watch, carried_out, random_plan
from tests.studies.worlds.measured_motor import NoRecord

A, B, C = Terminal
INSULATION = Connect(dict.fromkeys(Terminal, Socket.INSULATION_HIGH))
STEP_PROBES = ConnectProbes((VoltageProbe(1, Node.A, Node.B), CurrentProbe(4, A)))
PROBED = (ConnectProbes(phases_on((1, 2, 3))), ConnectProbes(phases_on((1, 2, 3), 1)), STEP_PROBES, ConnectProbes(()))
#: What a short circuit over speed wants, and load points: the current probe goes round one wire after the other.
ROUND = tuple(ConnectProbes((*phases_on((1, 2, 3)), CurrentProbe(4, terminal))) for terminal in Terminal)
PAIRS = ((A, B), (B, C), (C, A), (B, A))
SUPPLIED = (ALIGN_D, ALIGN_Q, STEP_NEGATIVE, *(supply_across(*pair) for pair in PAIRS))
BRIDGED = (meter_series_parallel(), *(meter_across(*pair) for pair in PAIRS))
SHAFT = (LockRotor(), ReleaseRotor(), UncoupleDynamometer())
#: What procedures want at a time, and more than they do.
WANTS: Sequence[tuple[Wanted, ...]] = (
    *((connect, *beside) for connect in SUPPLIED for beside in ((), SHAFT[1:], (ConnectVoltmeter(A, B),), (STEP_PROBES,))),
    *((connect, *beside) for connect in BRIDGED for beside in ((), SHAFT[1:])),
    (ConnectVoltmeter(B, C), supply_across(B, C)),
    (ConnectVoltmeter(C, A), supply_across(C, A)),
    *((connect, ReleaseRotor(), CoupleDynamometer()) for connect in (ALL_OPEN, INVERTER)),
    *((connect, ReleaseRotor(), UncoupleDynamometer()) for connect in (INVERTER, DRIVE)),
    (ReleaseRotor(), CoupleDynamometer()),
    (ShortMeterLeads(),),
    (SeparateMeterLeads(),),
    (DisconnectVoltmeter(),),
    (ALL_OPEN,),
    *((connect, ReleaseRotor(), CoupleDynamometer(), probes) for connect in (ALL_SHORTED, INVERTER) for probes in ROUND),
    (ALL_SHORTED, ReleaseRotor(), CoupleDynamometer(), ConnectProbes((CurrentProbe(4, B),))),
    (ALL_SHORTED,),
    (LockRotor(), INSULATION),
    *((ALL_OPEN, probes) for probes in PROBED),
    (ALL_OPEN, ConnectVoltmeterToSupply()),
    *((each,) for each in SHAFT),
)  # fmt: skip


class Hands:
    """Keeps what it is asked for."""

    def __init__(self) -> None:
        self.asked: list[ChangeSetup] = []

    def perform(self, action: HandWork) -> None:
        assert isinstance(action, ChangeSetup)
        self.asked.append(action)


class Supplying:
    maximum_voltage = 25.0


def bench_of(hands: Hands, recorder: NoRecord | None = None) -> Bench:
    instruments: Any = {
        Role.SUPPLY: Supplying(), Role.DYNAMOMETER: None, Role.INSULATION_TESTER: type("Tester", (), {"maximum_voltage": 500.0})(),
    }  # fmt: skip
    bench = Bench(instruments, hands, VirtualClock(), recorder or NoRecord())
    bench.state.motor_voltage = 24.0
    return bench


@settings(max_examples=150)
@given(st.lists(st.sampled_from(WANTS), min_size=1, max_size=12), st.sampled_from([None, frozenset(), frozenset(Role)]))
def test_any_order_of_wants_keeps_the_rules_at_every_single_change(
    plan: list[tuple[Wanted, ...]], in_use: frozenset[Role] | None
) -> None:
    hands, watch = Hands(), Watch()
    bench = bench_of(hands, watch)
    bench.state.in_use = in_use
    for wants in plan:
        bench.perform(*wants)
        asked = len(hands.asked)
        bench.perform(*wants)
        # What is so already is not asked for again.
        assert len(hands.asked) == asked
    assert watch.violations == []


def said(*plan: tuple[Wanted, ...]) -> list[str]:
    """Return the lines of the last instruction."""
    hands = Hands()
    bench = bench_of(hands)
    for wants in plan:
        bench.perform(*wants)
    return [str(line) for line in hands.asked[-1].lines({"A": "white"})]


def test_the_bridge_comes_off_before_the_voltmeter_and_then_the_supply_go_on() -> None:
    assert said((meter_across(A, B),), (supply_across(A, B), ConnectVoltmeter(A, B))) == [
        "Connect, in this order:",
        "Take the LCR meter off A (white) and B",
        "Put the voltmeter on, nearer to the motor than the supply's clamps: high on A (white), low on B",
        "Put the supply's plus on A (white)",
        "Put the supply's minus on B",
    ]


def test_poles_change_places_without_meeting() -> None:
    assert said((supply_across(A, B),), (supply_across(B, A),))[1:] == [
        "Take the supply's plus off A (white)",
        "Move the supply's minus from B to A (white)",
        "Put the supply's plus on B",
    ]


def test_everything_is_off_before_the_shaft_is_coupled() -> None:
    before = (supply_across(A, B), ConnectVoltmeter(A, B), UncoupleDynamometer(), LockRotor())
    assert said(before, (ReleaseRotor(), CoupleDynamometer()))[1:] == [
        "Take the supply off A (white) and B",
        "Take the voltmeter off A (white) and B",
        "Unlock the shaft and turn it a little by hand: it moves freely",
        "Couple the motor's shaft to the dynamometer",
    ]


def test_probes_stay_beside_a_supply_of_a_procedure_that_uses_them_and_leave_with_it() -> None:
    hands = Hands()
    bench = bench_of(hands)
    bench.state.in_use = {Role.SUPPLY, Role.OSCILLOSCOPE}
    bench.perform(ALIGN_D, STEP_PROBES)
    bench.perform(STEP_NEGATIVE)
    assert bench.state.setup.probes == STEP_PROBES.probes
    bench.state.in_use = {Role.SUPPLY}
    bench.perform(ALIGN_D)
    assert bench.state.setup.probes == ()


def test_a_meter_that_is_used_stays_only_where_it_withstands_what_comes() -> None:
    hands = Hands()
    bench = bench_of(hands)
    bench.perform(ALL_OPEN, STEP_PROBES, UncoupleDynamometer())
    # Extra-low voltage any probe takes; of more nobody knows.
    bench.state.motor_voltage = 400.0
    bench.perform(CoupleDynamometer())
    assert bench.state.setup.contacts == ()


class Meter:
    maximum_voltage = 10.0


def test_a_meter_that_states_less_than_what_comes_is_refused_and_not_left_on() -> None:
    hands = Hands()
    bench = bench_of(hands)
    bench._instruments[Role.VOLTMETER] = cast("Any", Meter())
    with pytest.raises(ProcedureError, match="voltmeter withstands 10 V, and supply brings up to 25 V"):
        bench.perform(supply_across(A, B), ConnectVoltmeter(A, B))
    assert hands.asked == []
    bench.perform(ALL_OPEN, ConnectVoltmeter(A, B))
    bench.state.in_use = frozenset(Role)
    bench.perform(supply_across(A, B))
    assert bench.state.setup.voltmeter is None


def test_hands_whose_work_broke_off_begin_anew() -> None:
    class Broken(Hands):
        def perform(self, action: HandWork) -> None:
            raise ProcedureError(cast("Any", action).lines({})[0])

    hands = Hands()
    bench = bench_of(hands)
    bench.perform(ALIGN_D, LockRotor())
    bench._operator = Broken()
    with pytest.raises(ProcedureError):
        bench.perform(ALIGN_Q)
    assert bench.state.setup == BenchSetup()
    assert bench.state.connection is None
    assert not bench.state.rotor_locked


def test_two_that_do_not_go_together_are_refused_before_a_hand_moves() -> None:
    hands = Hands()
    bench = bench_of(hands)
    for wants, found in (
        ((Connect({A: Socket.METER_HIGH, B: Socket.SUPPLY_NEGATIVE}),), "lcr_meter, supply would be on the motor together"),
        ((meter_across(A, B), ConnectVoltmeter(A, B)), "voltmeter would be on the motor beside lcr_meter"),
        ((INSULATION, STEP_PROBES), "oscilloscope would be on the motor beside insulation_tester"),
    ):  # fmt: skip
        with pytest.raises(ProcedureError, match=found):
            bench.perform(*wants)
    assert hands.asked == []


class On:
    """Something is on, and has turned the shaft."""

    roles: Sequence[Role] = (Role.SUPPLY,)
    turned = True

    def stands(self) -> None:
        self.turned = False


def test_no_lead_is_touched_while_something_is_on_and_a_turning_shaft_is_waited_for() -> None:
    hands, on = Hands(), On()
    bench = Bench(cast("Any", {}), hands, VirtualClock(), NoRecord(), feeding=on)
    with pytest.raises(ProcedureError, match="supply is on: switch it off before any lead or coupling is touched"):
        bench.perform(ALIGN_D)
    with pytest.raises(ProcedureError, match="supply is on: switch it off"):
        bench.perform(DoByHand(text("Plug the thermistor in")))
    assert hands.asked == []
    on.roles = ()
    bench.perform(ALIGN_D)
    assert str(hands.asked[0].lines({})[1]) == "Wait until the shaft stands still"
    on.roles = (Role.SUPPLY,)
    # An aligned rotor is locked under current: no lead is touched.
    bench.perform(LockRotor())
    assert [str(line) for line in hands.asked[1].lines({})] == ["Lock the shaft where it stands, without turning it"]


@pytest.mark.parametrize("index", [pytest.param(0, marks=pytest.mark.slow), 1])
def test_plans_in_random_order_on_the_virtual_bench(index: int) -> None:
    """A few of the study's plans: `python -m tests.studies.hands` makes hundreds."""
    watch, ended, _ = carried_out(random_plan(np.random.default_rng([7, index]), 5), index)
    assert watch.violations == []
    assert watch.changes > 10
    assert watch.switched_on > 10
    assert ended


def test_the_watch_sees_what_it_looks_for() -> None:
    class Careless(Watch):
        def do(self, *wants: Wanted) -> None:
            hands = Hands()
            bench = bench_of(hands)
            bench.perform(*wants)
            (asked,) = hands.asked
            self._follow(ChangeSetup(asked.changes[1:], asked.before, asked.after))

    watch = Careless(known=True)
    watch.do(meter_across(A, B))
    watch.do(supply_across(A, B))
    assert any("two sources" in words for words in watch.violations)
    assert any("two leads on one terminal" in words for words in watch.violations)
    watch._look("dynamometer")
    watch.coupled = True
    before = len(watch.violations)
    watch._look("dynamometer")
    assert len(watch.violations) == before + 4
