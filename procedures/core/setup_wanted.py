"""The setup that follows from a procedure's request: what the request does not name stays only if that is allowed."""

from collections.abc import Callable, Sequence
from dataclasses import replace

from drivers.interfaces import Role
from drivers.interfaces.role import ROLES
from procedures.core.actions import (
    Connect,
    ConnectProbes,
    ConnectVoltmeter,
    ConnectVoltmeterToSupply,
    CoupleDynamometer,
    DisconnectVoltmeter,
    LockRotor,
    Node,
    ReleaseRotor,
    SeparateMeterLeads,
    ShortMeterLeads,
    UncoupleDynamometer,
    Wanted,
)
from procedures.core.setup import BenchSetup, LeadContact, metered, probed, wired

#: Tells whether an instrument that nothing was said of may be left on beside a source, None for open terminals at rest.
MayStay = Callable[[Role, Role | None], bool]
#: What a lead beside the terminals' wires belongs to.
_BESIDE = (Role.VOLTMETER, Role.OSCILLOSCOPE)


def setup_wanted(before: BenchSetup, wanted: Sequence[Wanted], may_stay: MayStay) -> BenchSetup:
    """Return the requested setup.

    The terminals' wires go where they are wanted and nowhere else. Voltmeter and probes that nothing was said of stay where they may
    beside what comes; before the dynamometer is coupled whatever feeds the motor or measures its winding comes off.
    """
    shaft = before
    named: dict[Role | None, set[LeadContact]] = {}
    for each in wanted:
        match each:
            case Connect():
                named[None] = wired(each.complete())
            case ConnectProbes(probes=probes):
                named[Role.OSCILLOSCOPE] = probed(probes)
            case ConnectVoltmeter(positive=positive, negative=negative):
                named[Role.VOLTMETER] = metered(positive, negative)
            case ConnectVoltmeterToSupply():
                named[Role.VOLTMETER] = metered(Node.SUPPLY_POSITIVE, Node.SUPPLY_NEGATIVE)
            case DisconnectVoltmeter():
                named[Role.VOLTMETER] = set()
            case ShortMeterLeads():
                shaft = replace(shaft, leads_shorted=True)
            case SeparateMeterLeads():
                shaft = replace(shaft, leads_shorted=False)
            case LockRotor() | ReleaseRotor():
                shaft = replace(shaft, rotor_locked=isinstance(each, LockRotor))
            case CoupleDynamometer() | UncoupleDynamometer():
                shaft = replace(shaft, coupled=isinstance(each, CoupleDynamometer))
    coupling = bool(shaft.coupled) and not before.coupled
    if not (named or coupling or (shaft.leads_shorted and not before.leads_shorted)):
        return shaft
    wires = named.get(None, {contact for contact in before.contacts if contact.is_socket})
    if coupling and None not in named:
        wires = {contact for contact in wires if may_stay(contact.role, Role.DYNAMOMETER)}
    elif None not in named and shaft.leads_shorted:
        wires = {contact for contact in wires if contact.role is not Role.LCR_METER}
    contacts = set(wires)
    source = next((contact.role for contact in wires), Role.DYNAMOMETER if shaft.coupled else None)
    for role in _BESIDE:
        if role in named:
            contacts |= named[role]
        elif not (None in named or coupling) or may_stay(role, source):
            contacts |= {contact for contact in before.contacts if contact.role is role}
    if source is not None and ROLES[source].alone:
        # Its own leads, or the relay that joins them.
        shaft = replace(shaft, leads_shorted=False)
    return shaft.having(contacts)
