"""What is typed, and what is made of it."""

import math
import re

import pytest

from bench.by_hand.commands import ArgumentKind, commands_of
from bench.by_hand.requests import Finish, HandTask, Help, SwitchOff, TypedCommand, request_of
from drivers.interfaces import Aperture, Regulated, Role, Slope
from procedures.core.actions import (
    Connect,
    ConnectProbes,
    ConnectVoltmeter,
    CurrentProbe,
    LockRotor,
    Node,
    Socket,
    StartTurning,
    Terminal,
    VoltageProbe,
)

ROLES = [role for role in Role if role is not Role.SWITCH_MATRIX]
#: Arguments that are numbers and have no unit.
BARE = {"pre_trigger", "power_line_cycles"}


def test_every_argument_of_every_instrument_can_be_typed_and_has_its_unit() -> None:
    numbers = [
        (command.method, argument)
        for role in ROLES
        for command in commands_of(role).values()
        for argument in command.arguments
        if argument.kind is ArgumentKind.NUMBER
    ]
    assert len(numbers) > 20
    assert [f"{method} {one.name}" for method, one in numbers if not one.unit and one.name not in BARE] == []


@pytest.mark.parametrize(
    ("line", "method", "values"),
    [
        ("supply energised 5 V 1 A", "energised", {"voltage": 5.0, "current_limit": 1.0}),
        ("SUPPLY energised 0,5V 31,8 mA", "energised", {"voltage": 0.5, "current_limit": 0.0318}),
        (
            "supply energised current_limit=1A voltage=5V regulated=current",
            "energised",
            {"voltage": 5.0, "current_limit": 1.0, "regulated": Regulated.CURRENT},
        ),
        ("supply measure-voltage", "measure_voltage", {}),
        (
            "lcr_meter configure 1 kHz 500 mV long",
            "configure",
            {"frequency": 1000.0, "level": 0.5, "aperture": Aperture.LONG},
        ),
        ("dynamometer driving_speed 300 rpm", "driving_speed", {"speed": 10.0 * math.pi}),
        ("dynamometer driving_speed -30 rad/s", "driving_speed", {"speed": -30.0}),
        ("dynamometer driving_torque 50 mNm none", "driving_torque", {"torque": 0.05, "speed_limit": None}),
        ("rotor_actuator move_by 90°", "move_by", {"angle": math.pi / 2.0}),
        (
            "oscilloscope configure_channel 1 20 V -2 V",
            "configure_channel",
            {"channel": 1, "range": 20.0, "offset": -2.0},
        ),
        ("oscilloscope configure_channel 4 5 A", "configure_channel", {"channel": 4, "range": 5.0}),
        (
            "oscilloscope configure_trigger none slope=falling",
            "configure_trigger",
            {"channel": None, "slope": Slope.FALLING},
        ),
        ("supply energised ５ 伏 ３１．８ 毫安", "energised", {"voltage": 5.0, "current_limit": 0.0318}),
        ("dynamometer driving_speed 300 转/分", "driving_speed", {"speed": 10.0 * math.pi}),
        ("dynamometer driving_speed -30 弧度/秒", "driving_speed", {"speed": -30.0}),
        ("oscilloscope fetch 1,2 100 ms", "fetch", {"channels": [1, 2], "timeout": 0.1}),
    ],
)
def test_a_command_takes_its_values_in_the_reader_s_units(line: str, method: str, values: dict[str, object]) -> None:
    request = request_of(line, ROLES)
    assert isinstance(request, TypedCommand)
    assert request.command.method == method
    rounded = {name: round(value, 9) if isinstance(value, float) else value for name, value in request.values.items()}
    assert rounded == {name: round(value, 9) if isinstance(value, float) else value for name, value in values.items()}


@pytest.mark.parametrize(
    ("line", "said"),
    [
        ("", "help lists them"),
        ("suply energised 5 V 1 A", "did you mean supply?"),
        ("supply energise 5 V 1 A", "did you mean energised?"),
        ("supply maximum_voltage", "supply has no maximum_voltage"),
        ("supply close", "supply has no close"),
        ("supply energised 5 V", "energised needs current_limit"),
        ("supply energised 5 A 1 V", "'5 A' is in A, and V is asked for"),
        ("supply energised 5 V 1 A power", "is not known; allowed are"),
        ("supply energised 5 V 1 A voltage voltage", "no more than 3 values"),
        ("supply energised 5 V 1 A voltage=3 V", "voltage is given twice"),
        ("supply energised 1,234 V 1 A", "could mean 1234 or 1.234"),
        ("supply energised nan 1 A", "is not a number"),
        ("dynamometer driving_speed 300", "type it with its unit, like 300 rpm"),
        ("oscilloscope configure_channel 1.5 20 V", "no whole number"),
        ("connect A=supply+ B=lcr_low", "lcr_meter, supply at the same time"),
        ("connect A=mains", "connect TERMINAL=SOCKET"),
        ("connect D=supply+", "connect TERMINAL=SOCKET"),
        ("probes 1=A", "probes CHANNEL=TIP:REFERENCE"),
        ("voltmeter-leads A A", "voltmeter-leads HIGH LOW"),
        ("start-turning", "is not a number"),
        ("lock-rotor now", "lock-rotor takes no other words"),
        ("finish now", "there is no finish"),
    ],
)
def test_what_is_wrong_is_said(line: str, said: str) -> None:
    with pytest.raises(ValueError, match=re.escape(said)):
        request_of(line, ROLES)


def test_what_is_no_command_of_an_instrument() -> None:
    assert request_of("finish", ROLES) == Finish()
    assert request_of("off", ROLES) == SwitchOff(None)
    assert request_of("off lcr-meter", ROLES) == SwitchOff(Role.LCR_METER)
    assert request_of("help supply", ROLES) == Help(Role.SUPPLY)
    typed = {
        "connect a=supply+ B=supply-": Connect(
            {Terminal.A: Socket.SUPPLY_POSITIVE, Terminal.B: Socket.SUPPLY_NEGATIVE}
        ),
        "connect": Connect({}),
        "probes 1=A:star 4=current:b": ConnectProbes(
            (VoltageProbe(1, Node.A, Node.ARTIFICIAL_STAR), CurrentProbe(4, Terminal.B))
        ),
        "probes off": ConnectProbes(()),
        "voltmeter-leads a b": ConnectVoltmeter(Terminal.A, Terminal.B),
        "lock-rotor": LockRotor(),
        "start-turning 6 rpm": StartTurning(pytest.approx(0.2 * math.pi)),
    }
    assert {line: request_of(line, ROLES) for line in typed} == {
        line: HandTask(action, line) for line, action in typed.items()
    }


def test_a_station_s_own_instruments_are_what_there_is() -> None:
    with pytest.raises(ValueError, match="there is no dynamometer here"):
        request_of("dynamometer measure", [Role.SUPPLY])
    with pytest.raises(ValueError, match=r"there is no .*lcr_meter.* here"):
        request_of("connect A=lcr_high B=lcr_low", [Role.SUPPLY])
