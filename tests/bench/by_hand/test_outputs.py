"""What is on is left, whatever its instrument reports; what may not be on together is refused."""

from collections.abc import Iterable, Iterator
from contextlib import contextmanager

import pytest

from bench.by_hand.commands import commands_of
from bench.by_hand.connections import refusal
from bench.by_hand.hand_work import HAND_WORK, PLAIN
from bench.by_hand.outputs import Outputs, StillOnError
from bench.by_hand.words import WORDS
from drivers.interfaces import CommunicationError, ReportedError, Role
from procedures.core.actions import Node, Socket, Terminal, VoltageProbe
from procedures.core.setup import BenchSetup, LeadContact, metered, probed, wired


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


def on(*sockets: Socket, beside: Iterable[LeadContact] = ()) -> BenchSetup:
    return BenchSetup().having({*wired(dict(zip(Terminal, sockets, strict=False))), *beside})


def test_what_may_be_switched_on_follows_from_what_hands_have_connected() -> None:
    feeding = [role for role in Role if role.feeds]
    assert [role for role in feeding if refusal(role, BenchSetup()) is None] == []
    assert [role for role in feeding if refusal(role, on()) is not None] == []
    supply = on(Socket.SUPPLY_POSITIVE, Socket.SUPPLY_NEGATIVE)
    assert refusal(Role.SUPPLY, supply) is None
    assert "disconnect supply first" in str(refusal(Role.DYNAMOMETER, supply))
    assert "disconnect lcr_meter first" in str(refusal(Role.DYNAMOMETER, on(Socket.METER_HIGH, Socket.METER_LOW)))
    inverter = on(Socket.INVERTER_U, Socket.INVERTER_V, Socket.INVERTER_W)
    assert refusal(Role.DYNAMOMETER, inverter) is None


def test_nothing_else_is_on_the_motor_at_the_insulation_tester_s_voltage() -> None:
    joined = [Socket.INSULATION_HIGH] * 3
    assert refusal(Role.INSULATION_TESTER, on(*joined)) is None
    assert "disconnect it before supply" in str(refusal(Role.SUPPLY, on(*joined)))
    beside = {*metered(Terminal.A, Terminal.B), *probed([VoltageProbe(1, Node.A, Node.B)])}
    assert str(refusal(Role.INSULATION_TESTER, on(*joined, beside=beside))).endswith(": oscilloscope, voltmeter")


def test_people_have_words_for_everything_that_a_form_offers() -> None:
    names = set(PLAIN)
    for role in Role:
        for command in () if role is Role.SWITCH_MATRIX else commands_of(role).values():
            names.add(command.method)
            for argument in command.arguments:
                names |= {argument.name, *(one.name.lower() for one in argument.choices)}
    assert [name for name in sorted(names) if name not in WORDS] == []
    assert set(PLAIN) < set(HAND_WORK)
