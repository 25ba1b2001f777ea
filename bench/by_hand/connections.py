"""What was connected by hand work, and what therefore may not be switched on."""

from bench.by_hand.hand_work import OWNERS
from drivers.interfaces import Role
from drivers.interfaces.text import Text, text
from procedures.core.actions import (
    Action,
    Connect,
    ConnectProbes,
    ConnectVoltmeter,
    ConnectVoltmeterToSupply,
    DisconnectVoltmeter,
    SeparateMeterLeads,
    ShortMeterLeads,
)


class HandConnections:
    """The terminals' connection, and whether probes and sense leads are off; None where nobody has said it yet."""

    def __init__(self) -> None:
        self._owners: frozenset[Role] | None = None
        self._probes_off: bool | None = None
        self._voltmeter_off: bool | None = None

    def after(self, action: Action) -> None:
        """Take hand work into account that has been done."""
        match action:
            case Connect(terminals=terminals):
                self._owners = frozenset(OWNERS[socket] for socket in terminals.values() if socket in OWNERS)
            case ShortMeterLeads() | SeparateMeterLeads():
                self._owners = None
            case ConnectProbes(probes=probes):
                self._probes_off = not probes
            case ConnectVoltmeter() | ConnectVoltmeterToSupply():
                self._voltmeter_off = False
            case DisconnectVoltmeter():
                self._voltmeter_off = True

    def refusal(self, role: Role, station: frozenset[Role]) -> Text | None:
        """Return why the instrument of a role must not be switched on at a station with these roles, None where it may be."""
        if self._owners is None:
            return text(
                "{role} stays off until it is said what is on the motor's terminals: type connect, as connect A=supply+ B=supply-, "
                "or connect alone where nothing is",
                role=role.value,
            )
        if role is Role.INSULATION_TESTER:
            return self._of_insulation(station)
        if Role.INSULATION_TESTER in self._owners:
            return text(
                "the insulation tester is on the motor's terminals: take it off before {role} is switched on",
                role=role.value,
            )
        # What the turned motor generates goes into whatever is on its terminals.
        if role is Role.DYNAMOMETER and (
            fed := sorted(one.value for one in self._owners & {Role.SUPPLY, Role.LCR_METER})
        ):
            return text("the turned motor feeds what is on its terminals: take {roles} off first", roles=fed)
        return None

    def _of_insulation(self, station: frozenset[Role]) -> Text | None:
        left = [
            role.value
            for role in sorted(self._owners or (), key=lambda one: one.value)
            if role is not Role.INSULATION_TESTER
        ]
        if Role.OSCILLOSCOPE in station and not self._probes_off:
            left.append("probes")
        if Role.VOLTMETER in station and not self._voltmeter_off:
            left.append("voltmeter-leads")
        if not left:
            return None
        return text(
            "nothing else may be on the motor at the insulation tester's voltage; take off and say so: {left}",
            left=left,
        )
