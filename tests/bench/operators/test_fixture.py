"""A fixture in place of hands: what each action has matrix and actuator do, and what it refuses."""

import math
from collections.abc import Collection
from typing import Any

import pytest
from hypothesis import given
from hypothesis import strategies as st

from bench.operators.fixture import FixtureOperator
from bench.operators.rest import RestFinder
from drivers.bases.crosspoints import conflict
from drivers.interfaces import Accuracy, CrosspointError, Reading
from drivers.interfaces.text import text
from procedures.core.actions import (
    ALIGN_D,
    ALL_OPEN,
    Connect,
    ConnectProbes,
    ConnectVoltmeter,
    CoupleDynamometer,
    CurrentProbe,
    DisconnectVoltmeter,
    DoByHand,
    EnterReading,
    LockRotor,
    MarkRestPositions,
    Mend,
    Node,
    ReleaseRotor,
    SeparateMeterLeads,
    ShortMeterLeads,
    Socket,
    StartTurning,
    StopTurning,
    Terminal,
    TurnToRest,
    UncoupleDynamometer,
    VoltageProbe,
    meter_across,
)
from procedures.core.bench import ProcedureError, Role
from tests.bench.conftest import Clock
from tests.bench.operators.asking import Asking
from tests.journals import event


class Matrix:
    """Remembers what it was told to have closed."""

    def __init__(self) -> None:
        terminals = ("A", "B", "C")
        sockets = [socket.value for socket in Socket if socket is not Socket.OPEN]
        self.crosspoints = frozenset(
            [f"{terminal}:{socket}" for terminal in terminals for socket in sockets]
            + [f"{terminal}:voltmeter{sign}" for terminal in terminals for sign in "+-"]
            + [f"{node}:channel{channel}{sign}" for node in ("A", "B", "N") for channel in (1, 2) for sign in "+-"]
            + ["leads:short"]
        )
        self.fixed = frozenset({"A:channel4~", "C:channel3+"})
        self.closed: frozenset[str] = frozenset()
        self.failing = False
        self.history: list[frozenset[str]] = []

    def connect(self, crosspoints: Collection[str]) -> None:
        if self.failing:
            raise CrosspointError("switch_matrix", "no")
        assert conflict(crosspoints) is None
        assert self.crosspoints >= set(crosspoints)
        self.closed = frozenset(crosspoints)
        self.history.append(self.closed)


class Actuator:
    """A shaft that snaps to evenly spaced rests, or stays where friction holds it."""

    maximum_speed = 6.0

    def __init__(self, clock: Clock, pairs: int = 4, offset: float = 0.3, friction: float = 0.02) -> None:
        self.clock = clock
        self.pitch = 2.0 * math.pi / pairs
        self.offset = offset
        self.dead = friction * self.pitch  # so far (rad) from a rest friction holds the shaft
        self.where = offset
        self.speed = 0.0
        self.calls: list[tuple[Any, ...]] = []
        self.moved = 0

    def angle(self) -> Reading:
        return Reading(self.where + self.speed * self.clock.now(), "rad", Accuracy(), self.clock.now())

    def move_by(self, angle: float) -> None:
        self.moved += 1
        self.where += angle
        rest = self.offset + round((self.where - self.offset) / self.pitch) * self.pitch
        if abs(self.where - rest) > self.dead:
            self.where = rest

    def __getattr__(self, name: str) -> Any:
        return lambda *given: self.calls.append((name, *given))


@pytest.fixture
def matrix() -> Matrix:
    return Matrix()


@pytest.fixture
def actuator(clock: Clock) -> Actuator:
    return Actuator(clock)


@pytest.fixture
def fixture(clock: Clock, matrix: Matrix, actuator: Actuator) -> Asking:
    made = FixtureOperator(clock, lambda: 23.5)
    instruments: Any = {Role.SWITCH_MATRIX: matrix, Role.ROTOR_ACTUATOR: actuator}
    made.take(instruments)
    return Asking(made, clock)


PROBES = ConnectProbes((VoltageProbe(1, Node.A, Node.STAR_POINT), CurrentProbe(4, Terminal.A)))
ALIGNED = {"A:supply+", "B:supply-", "C:supply-"}
PROBED = {"A:channel1+", "N:channel1-"}


def test_connections_probes_and_sense_leads_are_one_set(fixture: Asking, matrix: Matrix) -> None:
    fixture.perform(ALIGN_D)
    assert matrix.closed == ALIGNED
    fixture.perform(PROBES)
    assert matrix.closed == ALIGNED | PROBED
    fixture.perform(ConnectVoltmeter(Terminal.A, Terminal.B))
    assert matrix.closed == ALIGNED | PROBED | {"A:voltmeter+", "B:voltmeter-"}
    fixture.perform(ConnectVoltmeter(Terminal.B, Terminal.C))
    assert matrix.closed == ALIGNED | PROBED | {"B:voltmeter+", "C:voltmeter-"}
    fixture.perform(DisconnectVoltmeter())
    assert matrix.closed == ALIGNED | PROBED


def test_relays_follow_the_order_of_careful_hands(fixture: Asking, matrix: Matrix) -> None:
    fixture.perform(meter_across(Terminal.A, Terminal.B))
    matrix.history.clear()
    fixture.perform(ConnectVoltmeter(Terminal.A, Terminal.B), ALIGN_D)
    sensed = {"A:voltmeter+", "B:voltmeter-"}
    assert matrix.history == [frozenset(), sensed, sensed | ALIGNED]
    matrix.history.clear()
    fixture.perform(meter_across(Terminal.A, Terminal.B))
    # Nothing is left beside the bridge.
    assert matrix.history == [frozenset(), {"A:lcr_high", "B:lcr_low"}]


def test_the_bridges_leads(fixture: Asking, matrix: Matrix) -> None:
    fixture.perform(meter_across(Terminal.A, Terminal.B))
    fixture.perform(ShortMeterLeads())
    assert matrix.closed == {"leads:short"}
    fixture.perform(SeparateMeterLeads())
    assert matrix.closed == frozenset()


def test_nothing_else_is_on_the_voltage_of_an_insulation_test(fixture: Asking, matrix: Matrix) -> None:
    fixture.perform(PROBES)
    fixture.perform(ConnectVoltmeter(Terminal.A, Terminal.B))
    fixture.perform(Connect(dict.fromkeys(Terminal, Socket.INSULATION_HIGH)))
    assert matrix.closed == {"A:insulation_high", "B:insulation_high", "C:insulation_high"}


def test_leads_that_are_fixed_are_not_switched(fixture: Asking, matrix: Matrix) -> None:
    matrix.fixed |= {"B:channel3-"}
    fixture.perform(ConnectProbes((VoltageProbe(3, Node.C, Node.B),)))
    assert matrix.closed == frozenset()


def test_a_crosspoint_that_there_is_not_is_named(fixture: Asking, matrix: Matrix) -> None:
    with pytest.raises(ProcedureError, match=r"no crosspoint B:channel3-; wire it and give it a channel"):
        fixture.perform(ConnectProbes((VoltageProbe(3, Node.C, Node.B),)))
    assert matrix.closed == frozenset()


def test_a_current_probe_is_there_or_refused(fixture: Asking) -> None:
    fixture.perform(ConnectProbes((CurrentProbe(4, Terminal.A),)))
    with pytest.raises(ProcedureError, match=r'channel 4 round the wire of B\. .* put "B:channel4~" into fixed'):
        fixture.perform(ConnectProbes((CurrentProbe(4, Terminal.B),)))


def test_what_failed_is_not_taken_for_connected(fixture: Asking, matrix: Matrix) -> None:
    fixture.perform(PROBES)
    matrix.failing = True
    with pytest.raises(CrosspointError):
        fixture.perform(ALIGN_D)
    matrix.failing = False
    fixture.perform(ConnectVoltmeter(Terminal.A, Terminal.B))
    # Nobody knows what is closed: all relays open before others close.
    assert matrix.history[-2:] == [frozenset(), {"A:voltmeter+", "B:voltmeter-"}]


@pytest.mark.parametrize("source", ["supply", "inverter", "drive"])
def test_no_relay_is_switched_under_power(fixture: Asking, matrix: Matrix, source: str) -> None:
    fixture.perform(ALIGN_D)
    fixture.hear(event("energising", instrument=source))
    for action in (ALL_OPEN, PROBES, ConnectVoltmeter(Terminal.A, Terminal.B), ShortMeterLeads()):
        with pytest.raises(ProcedureError, match="switches no relay while"):
            fixture.perform(action)
    assert matrix.closed == ALIGNED
    fixture.hear(event("de_energised", instrument=source))
    fixture.perform(ALL_OPEN)
    assert matrix.closed == frozenset()


def test_a_turning_dynamometer_is_no_power_on_the_terminals(fixture: Asking, matrix: Matrix) -> None:
    fixture.hear(event("energising", instrument="dynamometer"))
    fixture.perform(PROBES)
    assert matrix.closed == PROBED


def test_after_the_way_down_nothing_comes_back_by_itself(fixture: Asking, matrix: Matrix) -> None:
    fixture.perform(ALIGN_D)
    fixture.hear(event("made_safe", instrument="switch_matrix", item="open"))
    fixture.perform(PROBES)
    assert matrix.closed == PROBED


@pytest.mark.parametrize(
    ("action", "calls"),
    [
        (LockRotor(), [("lock",)]),
        (ReleaseRotor(), [("release",)]),
        (StartTurning(0.6), [("turn", 0.6)]),
        (StopTurning(), [("stop",)]),
        (CoupleDynamometer(), [("couple_dynamometer",)]),
        (UncoupleDynamometer(), [("uncouple_dynamometer",)]),
    ],
)
def test_what_the_shaft_is_done_to(
    fixture: Asking, actuator: Actuator, action: Any, calls: list[tuple[Any, ...]]
) -> None:
    assert fixture.perform(action) is None
    assert actuator.calls == calls


def test_a_turning_shaft_is_waited_for(fixture: Asking, actuator: Actuator, clock: Clock) -> None:
    actuator.speed = 1.0
    with pytest.raises(ProcedureError, match="has not come to rest within 600 s"):
        fixture.perform(LockRotor())
    assert actuator.calls == []
    assert fixture.hand_time == pytest.approx(600.0, abs=0.2)


def test_a_nudge_gets_the_shaft_to_its_rest(fixture: Asking, actuator: Actuator) -> None:
    actuator.where = actuator.offset + 0.01
    fixture.perform(TurnToRest())
    assert actuator.where == actuator.offset


@given(st.integers(1, 50), st.floats(-3.0, 3.0), st.floats(0.0, 0.05), st.integers(1, 2))
def test_every_rest_is_marked_and_the_first_once_more(pairs: int, offset: float, friction: float, turns: int) -> None:
    clock = Clock()
    shaft = Actuator(clock, pairs, offset, friction)
    marks = RestFinder(shaft, clock).mark(turns)
    wanted = [offset + number * shaft.pitch for number in range(turns * pairs + 1)]
    assert marks == pytest.approx(wanted, abs=2.0 * shaft.dead + 1e-9)
    # Once the distance is known, one movement finds each rest.
    assert shaft.moved <= turns * pairs + 12


def test_the_action_gives_the_marks(fixture: Asking) -> None:
    marks: Any = fixture.perform(MarkRestPositions())
    assert len(marks) == 5
    assert marks[-1] - marks[0] == pytest.approx(2.0 * math.pi)


def test_a_shaft_that_nothing_holds_has_no_rests(fixture: Asking, actuator: Actuator) -> None:
    actuator.dead = math.inf
    with pytest.raises(ProcedureError, match="snaps in at no other position"):
        fixture.perform(MarkRestPositions())


def test_readings(clock: Clock, fixture: Asking) -> None:
    temperature = EnterReading("winding_temperature", text("the winding's temperature"), "°C", -60.0, 250.0)
    assert fixture.perform(temperature) == 23.5
    with pytest.raises(ProcedureError, match=r"winding_temperature of \[fixture\] in the station file"):
        FixtureOperator(clock).perform(temperature)
    with pytest.raises(ProcedureError, match="no value for maximum_current"):
        fixture.perform(EnterReading("maximum_current", text("the maximum current"), "A", 0.0, 1.0))


def test_a_fixture_mends_nothing(fixture: Asking) -> None:
    assert fixture.perform(Mend(text("A and B are interchanged"), ())) is False


def test_what_only_a_person_can_do_is_refused(fixture: Asking) -> None:
    with pytest.raises(ProcedureError, match="a fixture cannot do this: Plug the thermistor in; use --operator"):
        fixture.perform(DoByHand(text("Plug the thermistor in")))


def test_a_fixture_without_an_actuator(clock: Clock, matrix: Matrix) -> None:
    half = FixtureOperator(clock)
    instruments: Any = {Role.SWITCH_MATRIX: matrix}
    half.take(instruments)
    asking = Asking(half, clock)
    asking.perform(ALIGN_D)
    with pytest.raises(ProcedureError, match=r"add \[instruments.rotor_actuator\] to the station file"):
        asking.perform(LockRotor())
