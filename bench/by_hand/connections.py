"""Outputs that may not be switched on because of the connections made."""

from drivers.interfaces import Role
from drivers.interfaces.text import Text, text
from procedures.core.setup import BenchSetup


def refusal(role: Role, setup: BenchSetup) -> Text | None:
    """Return why the instrument of a role must not be switched on with a setup, None where it may be."""
    if not setup.known:
        return text(
            "{role} stays off until you have stated what is connected to the motor's terminals: type connect, as "
            "connect A=supply+ B=supply-, or connect alone if nothing is connected",
            role=role.value,
        )
    if role is Role.INSULATION_TESTER:
        left = sorted(one.value for one in setup.roles - {role})
        if not left:
            return None
        return text(
            "at the insulation tester's voltage nothing else may be connected to the motor; disconnect these and "
            "report it with connect, probes or voltmeter-leads: {left}",
            left=left,
        )
    if Role.INSULATION_TESTER in setup.roles:
        return text(
            "the insulation tester is connected to the motor: disconnect it before {role} is switched on",
            role=role.value,
        )
    # What the turned motor generates goes into whatever is on its terminals.
    if role is Role.DYNAMOMETER and (fed := sorted(one.value for one in setup.roles & {Role.SUPPLY, Role.LCR_METER})):
        return text("a turned motor feeds everything that is connected to it: disconnect {roles} first", roles=fed)
    return None
