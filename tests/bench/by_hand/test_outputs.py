"""What is on is left, whatever its instrument reports; what may not be on together is refused."""

from collections.abc import Iterator
from contextlib import contextmanager

import pytest

from bench.by_hand.commands import commands_of
from bench.by_hand.connections import HandConnections
from bench.by_hand.hand_work import HAND_WORK, PLAIN
from bench.by_hand.outputs import Outputs, StillOnError
from bench.by_hand.words import is_known
from drivers.interfaces import CommunicationError, ReportedError, Role
from procedures.core.actions import (
    Connect,
    ConnectProbes,
    ConnectVoltmeter,
    DisconnectVoltmeter,
    SeparateMeterLeads,
    Socket,
    Terminal,
)

STATION = frozenset(Role)


class Bench:
    """Instruments that are on or off, and may fail to go off by their block or by `make_safe`."""

    def __init__(self) -> None:
        self.on: list[Role] = []
        self.failing: dict[Role, Exception] = {}
        self.stuck: set[Role] = set()

    @contextmanager
    def block(self, role: Role) -> Iterator[None]:
        self.on.append(role)
        try:
            yield
        finally:
            if role in self.failing:
                raise self.failing[role]
            self.on.remove(role)

    def make_safe(self, role: Role) -> None:
        if role in self.stuck:
            raise CommunicationError(role.value, "no reply")
        self.on.remove(role)


def test_the_last_that_was_switched_on_goes_off_first_and_one_goes_off_alone() -> None:
    bench = Bench()
    with Outputs(bench.make_safe) as outputs:
        for role in (Role.SUPPLY, Role.INVERTER, Role.DYNAMOMETER):
            outputs.block(role, f"{role.value} on", bench.block(role))
        outputs.off(Role.INVERTER)
        assert bench.on == [Role.SUPPLY, Role.DYNAMOMETER]
        assert outputs.words == ("supply on", "dynamometer on")
    assert bench.on == []


def test_a_block_that_ends_with_an_error_is_off_only_once_that_is_confirmed() -> None:
    bench = Bench()
    bench.failing[Role.SUPPLY] = ReportedError("supply", "tripped")
    outputs = Outputs(bench.make_safe)
    outputs.block(Role.SUPPLY, "supply on", bench.block(Role.SUPPLY))
    with pytest.raises(ReportedError, match="tripped"):
        outputs.all_off()
    assert bench.on == []
    assert not outputs


def test_what_cannot_be_switched_off_is_an_error_of_its_own_and_the_others_go_off() -> None:
    bench = Bench()
    bench.failing[Role.DYNAMOMETER] = CommunicationError("dynamometer", "no reply")
    bench.stuck.add(Role.DYNAMOMETER)
    outputs = Outputs(bench.make_safe)
    for role in (Role.SUPPLY, Role.DYNAMOMETER):
        outputs.block(role, f"{role.value} on", bench.block(role))
    with pytest.raises(StillOnError, match="dynamometer: it cannot be switched off"):
        outputs.all_off()
    assert bench.on == [Role.DYNAMOMETER]


def on(*sockets: Socket) -> Connect:
    return Connect(dict(zip(Terminal, sockets, strict=False)))


def test_what_may_be_switched_on_follows_from_what_was_said_to_be_connected() -> None:
    said = HandConnections()
    feeding = [role for role in Role if role.feeds]
    assert [role for role in feeding if said.refusal(role, STATION) is None] == []
    said.after(on(Socket.SUPPLY_POSITIVE, Socket.SUPPLY_NEGATIVE))
    assert said.refusal(Role.SUPPLY, STATION) is None
    assert "take supply off first" in str(said.refusal(Role.DYNAMOMETER, STATION))
    said.after(on(Socket.METER_HIGH, Socket.METER_LOW))
    assert "take lcr_meter off first" in str(said.refusal(Role.DYNAMOMETER, STATION))
    said.after(on(Socket.INVERTER_U, Socket.INVERTER_V, Socket.INVERTER_W))
    assert said.refusal(Role.DYNAMOMETER, STATION) is None
    said.after(SeparateMeterLeads())
    assert "until it is said" in str(said.refusal(Role.SUPPLY, STATION))


def test_nothing_else_is_on_the_motor_at_the_insulation_tester_s_voltage() -> None:
    said = HandConnections()
    said.after(on(*[Socket.INSULATION_HIGH] * 3))
    assert "take it off before supply" in str(said.refusal(Role.SUPPLY, STATION))
    assert str(said.refusal(Role.INSULATION_TESTER, STATION)).endswith("probes, voltmeter-leads")
    said.after(ConnectProbes(()))
    said.after(ConnectVoltmeter(Terminal.A, Terminal.B))
    assert str(said.refusal(Role.INSULATION_TESTER, STATION)).endswith(": voltmeter-leads")
    said.after(DisconnectVoltmeter())
    assert said.refusal(Role.INSULATION_TESTER, STATION) is None
    assert said.refusal(Role.INSULATION_TESTER, frozenset({Role.INSULATION_TESTER})) is None


def test_people_have_words_for_everything_that_a_form_offers() -> None:
    names = set(PLAIN)
    for role in Role:
        for command in () if role is Role.SWITCH_MATRIX else commands_of(role).values():
            names.add(command.method)
            for argument in command.arguments:
                names |= {argument.name, *(one.name.lower() for one in argument.choices)}
    assert [name for name in sorted(names) if not is_known(name)] == []
    assert set(PLAIN) < set(HAND_WORK)
