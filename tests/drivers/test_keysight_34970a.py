"""34970A as a switch matrix: dialogue, break before make, the interlocking, relays that do not follow."""

import re
from collections.abc import Callable, Iterator
from typing import Any

import pytest
from hypothesis import given
from hypothesis import strategies as st

from drivers.bases.crosspoints import check_channels, conflict
from drivers.catalogue import Surroundings
from drivers.interfaces import (
    CommunicationError,
    CrosspointError,
    IdentityError,
    ReportedError,
    SetpointError,
)
from drivers.keysight.options import Keysight34970AOptions
from drivers.keysight.switch_unit_34970a import Keysight34970A
from procedures.core.actions import Node, Socket, Terminal
from tests.drivers.dialogue import played

ADDRESS = "TCPIP0::matrix::inst0::INSTR"
SOCKETS = [
    f"{terminal.value}:{socket.value}" for terminal in Terminal for socket in Socket if socket is not Socket.OPEN
]
LEADS = [f"{node.value}:channel{channel}{sign}" for node in Node for channel in (1, 4) for sign in "+-"]
SENSES = [f"{terminal.value}:voltmeter{sign}" for terminal in Terminal for sign in "+-"]
CHANNELS = {"A:supply+": 111, "A:supply-": 112, "B:supply+": 121, "B:supply-": 122}
EVERY = {name: 101 + number for number, name in enumerate([*SOCKETS, *LEADS, *SENSES, "leads:short"])}


class Relays:
    """The unit's side: modules by slot, closed channels, and channels that do not move."""

    def __init__(self, identity: str = "HEWLETT-PACKARD,34970A,0,13-2-2") -> None:
        self.identity = identity
        self.modules = {"100": "HEWLETT-PACKARD,34904A,0,1.0", "200": "HEWLETT-PACKARD,0,0,0"}
        self.closed = {119}
        self.stuck: set[int] = set()
        self.errors: list[str] = []

    def __call__(self, message: str) -> bytes | None:
        if (answer := self.answer(message)) is not None:
            return answer.encode() + b"\n"
        channels = {int(number) for number in re.findall(r"\d+", message)} - self.stuck
        if message == "SYST:CPON ALL":
            self.closed &= self.stuck
        elif message.startswith("ROUT:OPEN "):
            self.closed -= channels
        elif message.startswith("ROUT:CLOS "):
            self.closed |= channels
        else:
            self.errors.append('-113,"Undefined header"')
        return None

    def answer(self, message: str) -> str | None:
        header, _, rest = message.partition(" ")
        if header == "ROUT:CLOS?":
            return ",".join(str(int(int(number) in self.closed)) for number in re.findall(r"\d+", rest))
        if header == "SYST:CTYP?":
            return self.modules[rest]
        if header == "SYST:ERR?":
            return self.errors.pop(0) if self.errors else '+0,"No error"'
        return self.identity if header == "*IDN?" else None


@pytest.fixture
def relays() -> Relays:
    return Relays()


@pytest.fixture
def wire(connect: Callable[..., Any], relays: Relays) -> Any:
    return connect(ADDRESS, relays)


@pytest.fixture
def matrix(manager: Any, wire: Any, clock: Any) -> Iterator[Keysight34970A]:
    made = Keysight34970A.open(
        ADDRESS, Keysight34970AOptions(CHANNELS, settling=0.02), Surroundings(clock, lambda: manager), "switch_matrix"
    )
    wire.sent.clear()
    yield made
    made.close()


def test_dialogue(clock: Any) -> None:
    with played("keysight_34972a", clock) as (surroundings, address):
        matrix = Keysight34970A.open(
            address,
            Keysight34970AOptions(CHANNELS, serial_number="MY49001234"),
            surroundings,
            "switch_matrix",
        )
        assert matrix.identity.model == "34972A"
        matrix.connect(["A:supply+", "B:supply-"])
        assert matrix.closed() == {"A:supply+", "B:supply-"}
        matrix.close()


def test_a_change_is_one_opening_one_closing_and_one_look(matrix: Keysight34970A, wire: Any, clock: Any) -> None:
    matrix.connect(["A:supply+", "B:supply-"])
    assert wire.sent == ["SYST:CPON ALL", "ROUT:CLOS (@111,122)", "ROUT:CLOS? (@111,112,121,122)"]
    assert clock.slept == [0.02, 0.02]
    wire.sent.clear()
    matrix.connect(["A:supply+", "B:supply+"])
    assert wire.sent == ["ROUT:OPEN (@122)", "ROUT:CLOS (@121)", "ROUT:CLOS? (@111,112,121,122)"]
    wire.sent.clear()
    matrix.connect(["B:supply+", "A:supply+"])
    assert wire.sent == ["ROUT:CLOS? (@111,112,121,122)"]
    wire.sent.clear()
    matrix.connect([])
    assert wire.sent == ["ROUT:OPEN (@111,121)", "ROUT:CLOS? (@111,112,121,122)"]
    assert matrix.closed() == frozenset()


def test_what_others_had_closed_opens_first(matrix: Keysight34970A, relays: Relays) -> None:
    matrix.connect(["A:supply+"])
    assert relays.closed == {111}


def test_nothing_is_switched_by_opening_it(matrix: Keysight34970A, relays: Relays) -> None:
    assert relays.closed == {119}


def test_an_unknown_crosspoint_is_refused_before_anything_is_switched(matrix: Keysight34970A, wire: Any) -> None:
    with pytest.raises(CrosspointError, match=r"there is no crosspoint C:supply-; nothing was switched") as refused:
        matrix.connect(["A:supply+", "C:supply-"])
    assert isinstance(refused.value, SetpointError)
    assert wire.sent == []


def test_two_sockets_on_one_terminal_are_refused_before_anything_is_switched(matrix: Keysight34970A, wire: Any) -> None:
    with pytest.raises(CrosspointError, match=r"A:supply\+ and A:supply- would put terminal A on two sockets"):
        matrix.connect(["A:supply+", "A:supply-"])
    assert wire.sent == []


def test_a_relay_that_does_not_close_is_named_and_all_open(matrix: Keysight34970A, relays: Relays, wire: Any) -> None:
    relays.stuck = {122}
    with pytest.raises(ReportedError, match=r"B:supply- \(channel 122\) does not close"):
        matrix.connect(["A:supply+", "B:supply-"])
    assert relays.closed == set()
    relays.stuck = set()
    wire.sent.clear()
    matrix.connect(["A:supply+"])
    assert wire.sent[0] == "ROUT:CLOS (@111)"


def test_a_relay_that_stays_closed_is_named(matrix: Keysight34970A, relays: Relays) -> None:
    matrix.connect(["A:supply+", "B:supply-"])
    relays.stuck = {111}
    with pytest.raises(ReportedError, match=r"A:supply\+ \(channel 111\) stays closed") as failed:
        matrix.connect(["B:supply-"])
    assert "stays closed" in failed.value.__notes__[0]
    assert relays.closed == {111}
    with pytest.raises(ReportedError, match="channel 111"):
        matrix.make_safe()


def test_what_the_unit_refuses_is_said(matrix: Keysight34970A, relays: Relays) -> None:
    relays.stuck = {111}
    relays.errors.append('+222,"Settings lost"')
    with pytest.raises(ReportedError) as failed:
        matrix.connect(["A:supply+"])
    assert "222 Settings lost" in failed.value.__notes__[0]


def test_make_safe_opens_all_and_reads_it_back(matrix: Keysight34970A, relays: Relays, wire: Any) -> None:
    matrix.connect(["A:supply+"])
    wire.sent.clear()
    matrix.make_safe()
    assert wire.sent == ["ROUT:OPEN (@111,112,121,122)", "ROUT:CLOS? (@111,112,121,122)"]
    assert relays.closed == set()


@pytest.mark.parametrize("lost", ["ROUT:CLOS (@111)", "SYST:CPON ALL"])
def test_after_a_lost_wire_nobody_presumes_what_is_closed(
    matrix: Keysight34970A, relays: Relays, wire: Any, lost: str
) -> None:
    wire.fail_write = {lost: 1}
    with pytest.raises(CommunicationError, match="could not be sent"):
        matrix.connect(["A:supply+"])
    wire.sent.clear()
    matrix.connect(["A:supply+"])
    assert "SYST:CPON ALL" in wire.sent
    assert relays.closed == {111}


def test_make_safe_over_a_renewed_connection(matrix: Keysight34970A, relays: Relays, wire: Any) -> None:
    matrix.connect(["A:supply+"])
    wire.fail_write = {"ROUT:OPEN (@111,112,121,122)": 1}
    matrix.make_safe()
    assert relays.closed == set()


def test_a_read_back_cut_short_is_no_state(matrix: Keysight34970A, wire: Any) -> None:
    matrix.connect(["A:supply+"])
    wire.handler = lambda message: b"1,0\n" if message.startswith("ROUT:CLOS?") else None
    with pytest.raises(CommunicationError, match="2 fields instead of 4"):
        matrix.connect([])


def test_an_empty_slot_is_an_identity_error(manager: Any, wire: Any, clock: Any) -> None:
    with pytest.raises(IdentityError, match=r"slot 200 is empty .*Correct the channels 211"):
        Keysight34970A.open(
            ADDRESS, Keysight34970AOptions({"A:supply+": 211}), Surroundings(clock, lambda: manager), "switch_matrix"
        )


@pytest.mark.parametrize(
    ("identity", "channel", "message"),
    [
        ("Agilent Technologies,34461A,MY1,1.0", 111, "expected 34970A"),
        ("Agilent Technologies,34970A,MY1,1.0", 1101, "channels of 3 digits, not 1101"),
        ("Agilent Technologies,34980A,MY1,1.0", 111, "channels of 4 digits, not 111"),
    ],
)
def test_another_instrument(
    manager: Any, wire: Any, relays: Relays, clock: Any, identity: str, channel: int, message: str
) -> None:
    relays.identity = identity
    with pytest.raises(IdentityError, match=message):
        Keysight34970A.open(
            ADDRESS,
            Keysight34970AOptions({"A:supply+": channel}),
            Surroundings(clock, lambda: manager),
            "switch_matrix",
        )


def test_the_mainframes_slots(manager: Any, wire: Any, relays: Relays, clock: Any) -> None:
    relays.identity = "Agilent Technologies,34980A,MY1,1.0"
    relays.modules = {"1": "AGILENT TECHNOLOGIES,34932A,MY2,1.0", "3": "AGILENT TECHNOLOGIES,34933A,MY3,1.0"}
    options = Keysight34970AOptions({"A:supply+": 1101, "B:supply+": 3002})
    Keysight34970A.open(ADDRESS, options, Surroundings(clock, lambda: manager), "switch_matrix").close()
    assert [message for message in wire.sent if "CTYP" in message] == ["SYST:CTYP? 1", "SYST:CTYP? 3"]


def test_a_guardian_asks_nothing_but_who_it_is(manager: Any, wire: Any, relays: Relays, clock: Any) -> None:
    made = Keysight34970A.open(
        ADDRESS, Keysight34970AOptions(CHANNELS), Surroundings(clock, lambda: manager, guarding=True), "switch_matrix"
    )
    assert wire.sent == ["*IDN?"]
    made.make_safe()
    made.close()
    assert relays.closed == {119}


@pytest.mark.parametrize(
    ("crosspoints", "message"),
    [
        ({"D:supply+": 111}, r'crosspoints."D:supply\+" = 111: there is no such crosspoint'),
        ({"A:open": 111}, "there is no such crosspoint"),
        ({"A:channel4~": 111}, "there is no such crosspoint"),
        ({"A:supply+": 11}, "a channel is a number from 100 to 9999"),
        ({"A:supply+": 111, "B:supply+": 111}, r'the channel is "A:supply\+" already'),
    ],
)
def test_what_no_matrix_can_have(crosspoints: dict[str, int], message: str) -> None:
    with pytest.raises(ValueError, match=message):
        Keysight34970AOptions(crosspoints)


def test_only_leads_can_be_fixed() -> None:
    Keysight34970AOptions({}, fixed=("A:channel4~", "B:channel2+", "A:voltmeter-"))
    with pytest.raises(ValueError, match=r'fixed = "A:supply\+": allowed are leads'):
        Keysight34970AOptions({}, fixed=("A:supply+",))


def test_every_point_that_an_action_can_name_has_a_name_here() -> None:
    check_channels(EVERY)


@given(st.sets(st.sampled_from(sorted(EVERY)), max_size=8))
def test_what_may_be_closed_together_harms_nobody(names: set[str]) -> None:
    if conflict(names):
        return
    sockets = [name for name in names if name in SOCKETS]
    kinds = {name.partition(":")[2].rstrip("+-").partition("_")[0] for name in sockets}
    assert len({name[0] for name in sockets}) == len(sockets)
    assert len(kinds) <= 1
    assert kinds != {"insulation"} or set(sockets) == names
    ends = [name.partition(":")[2] for name in names if name not in sockets]
    assert len(set(ends)) == len(ends)


@pytest.mark.parametrize(
    "names",
    [
        ("A:supply+", "A:lcr_low"),
        ("A:supply+", "B:inverter_v"),
        ("A:insulation_high", "A:channel1+"),
        ("A:insulation_high", "B:voltmeter-"),
        ("A:insulation_high", "leads:short"),
        ("A:insulation_high", "B:supply-"),
        ("A:channel1+", "N:channel1+"),
        ("A:voltmeter+", "B:voltmeter+"),
    ],
)
def test_what_may_not_be_closed_together(names: tuple[str, ...]) -> None:
    assert conflict(names)


@pytest.mark.parametrize(
    "names",
    [
        ("A:supply+", "B:supply-", "C:supply-", "A:channel1+", "N:channel1-", "A:voltmeter+", "B:voltmeter-"),
        ("A:insulation_high", "B:insulation_high", "C:insulation_high"),
        ("leads:short",),
        ("A:lcr_high", "B:lcr_low", "C:lcr_low"),
    ],
)
def test_what_procedures_need(names: tuple[str, ...]) -> None:
    assert conflict(names) is None
