"""Hand work as it is typed, and what may be connected while what is switched on."""

from collections.abc import Callable, Collection, Mapping, Sequence
from typing import NoReturn

from bench.by_hand.values import number_in
from drivers.interfaces import Role
from drivers.interfaces.text import Text, text
from procedures.core.actions import (
    NODE_NAMES,
    Action,
    Connect,
    ConnectProbes,
    ConnectVoltmeter,
    ConnectVoltmeterToSupply,
    CoupleDynamometer,
    CurrentProbe,
    DisconnectVoltmeter,
    LockRotor,
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
)
from procedures.core.setup import role_of_lead

#: Whose each socket is.
OWNERS: Mapping[Socket, Role] = {one: role_of_lead(one.value) for one in Socket if one is not Socket.OPEN}

#: What one word says.
PLAIN: Mapping[str, Action] = {
    "short-meter-leads": ShortMeterLeads(),
    "separate-meter-leads": SeparateMeterLeads(),
    "lock-rotor": LockRotor(),
    "release-rotor": ReleaseRotor(),
    "couple-dynamometer": CoupleDynamometer(),
    "uncouple-dynamometer": UncoupleDynamometer(),
    "turn-to-rest": TurnToRest(),
    "stop-turning": StopTurning(),
}
#: What hands may do at the shaft while something is on; at terminals and couplings they work with everything off.
WHILE_ON = (TurnToRest, StartTurning, StopTurning)


def hand_work(word: str, rest: Sequence[str], roles: Collection[Role]) -> Action:
    """Return the hand work that a line asks for. Raises ValueError with a Text for what there is not."""
    if word in PLAIN:
        if rest:
            raise ValueError(text("{word} takes no other words", word=word))
        return PLAIN[word]
    try:
        return _TYPED[word](rest, roles)
    except (KeyError, IndexError):
        raise ValueError(USAGE[word]) from None


def _connect(rest: Sequence[str], roles: Collection[Role]) -> Action:
    terminals = {}
    for part in rest:
        name, _, socket = part.partition("=")
        terminals[Terminal(name.upper()) if name.upper() in Terminal.__members__ else _unknown()] = (
            next((one for one in Socket if one.value == socket.lower()), None) or _unknown()
        )
    owners = {OWNERS[socket] for socket in terminals.values() if socket in OWNERS}
    if absent := sorted(role.value for role in owners - set(roles)):
        raise ValueError(text("there is no {roles} here", roles=absent))
    if len(owners) > 1:
        raise ValueError(
            text(
                "{roles} at the same time: connect only one instrument to the motor's terminals, because each "
                "can damage the other",
                roles=sorted(role.value for role in owners),
            )
        )
    return Connect(terminals)


def _probes(rest: Sequence[str], roles: Collection[Role]) -> Action:
    if Role.OSCILLOSCOPE not in roles:
        raise ValueError(text("there is no {roles} here", roles=[Role.OSCILLOSCOPE.value]))
    if [one.lower() for one in rest] == ["off"]:
        return ConnectProbes(())
    return ConnectProbes(tuple(_probe(part) for part in rest) or _unknown())


def _probe(part: str) -> VoltageProbe | CurrentProbe:
    channel, _, at = part.partition("=")
    first, _, second = at.partition(":")
    if not channel.isdecimal() or not second:
        _unknown()
    if first.lower() == "current":
        return CurrentProbe(int(channel), Terminal[second.upper()])
    return VoltageProbe(int(channel), _node(first), _node(second))


def _node(word: str) -> Node:
    return next((one for one in NODE_NAMES if one.value.lower() == word.lower()), None) or _unknown()


def _voltmeter(rest: Sequence[str], roles: Collection[Role]) -> Action:
    if Role.VOLTMETER not in roles:
        raise ValueError(text("there is no {roles} here", roles=[Role.VOLTMETER.value]))
    match [one.lower() for one in rest]:
        case ["off"]:
            return DisconnectVoltmeter()
        case ["supply"]:
            return ConnectVoltmeterToSupply()
        case [positive, negative] if positive != negative:
            return ConnectVoltmeter(Terminal[positive.upper()], Terminal[negative.upper()])
    return _unknown()


def _start_turning(rest: Sequence[str], _roles: Collection[Role]) -> Action:
    speed = number_in("rad/s", " ".join(rest))
    if speed <= 0.0:
        _unknown()
    return StartTurning(speed)


def _unknown() -> NoReturn:
    raise KeyError


_TYPED: Mapping[str, Callable[[Sequence[str], Collection[Role]], Action]] = {
    "connect": _connect,
    "probes": _probes,
    "voltmeter-leads": _voltmeter,
    "start-turning": _start_turning,
}
#: How what takes more than its word is typed.
USAGE: Mapping[str, Text] = {
    "connect": text(
        "connect TERMINAL=SOCKET …, as connect A=supply+ B=supply-; terminals that are not named stay open, and connect alone "
        "takes all off. Sockets: {sockets}",
        sockets=[one.value for one in Socket],
    ),
    "probes": text(
        "probes CHANNEL=TIP:REFERENCE …, CHANNEL=current:TERMINAL, or probes off, as probes 1=A:star 4=current:A. Points: {nodes}",
        nodes=[one.value for one in Node],
    ),
    "voltmeter-leads": text(
        "voltmeter-leads HIGH LOW, voltmeter-leads supply or voltmeter-leads off, as voltmeter-leads A B"
    ),
    "start-turning": text("start-turning SPEED, as start-turning 6 rpm"),
}
HAND_WORK: tuple[str, ...] = (*_TYPED, *PLAIN)
