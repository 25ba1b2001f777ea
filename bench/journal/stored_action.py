"""Restores actions of manual work from the journal's `action` events."""

from collections.abc import Mapping
from dataclasses import fields
from typing import Any, cast, get_args

from drivers.interfaces import ProbeKind, Role
from drivers.interfaces.text import Text, word
from procedures.core.actions import (
    Action,
    ChangeSetup,
    Connect,
    ConnectProbes,
    ConnectVoltmeter,
    CurrentProbe,
    DoByHand,
    DoubtReading,
    EnterCommand,
    EnterReading,
    FittedProbe,
    Mend,
    Node,
    Socket,
    Terminal,
    VoltageProbe,
)
from procedures.core.setup import BenchSetup, LeadContact
from procedures.core.setup_change import Change, ChangeKind

#: A setup's fields that are no contacts.
_STATE = ("known", "leads_shorted", "rotor_locked", "coupled")
_KINDS: Mapping[str, type[Any]] = {kind.__name__: kind for kind in get_args(Action)}


def restore_action(event: Mapping[str, Any]) -> Action:
    """Return the action of an `action` event; raises ValueError for an unknown one."""
    name, details = event.get("action"), event.get("details")
    kind = _KINDS.get(str(name))
    if kind is None or not isinstance(details, Mapping):
        raise ValueError(f"the journal's action {name!r} is not known to this version; it cannot be drawn")
    try:
        return cast("Action", _made(kind, details))
    except (KeyError, TypeError) as error:
        raise ValueError(f"the journal's action {name} lacks {error}; it cannot be drawn") from error


def _made(kind: type[Any], details: Mapping[str, Any]) -> object:
    if kind is ChangeSetup:
        before, after = (_setup(details[name]) for name in ("before", "after"))
        return ChangeSetup(tuple(_change(each) for each in details["changes"]), before, after)
    if kind is Connect:
        return Connect({Terminal(t): Socket(socket) for t, socket in details["terminals"].items()})
    if kind is ConnectProbes:
        return ConnectProbes(tuple(_probe(probe) for probe in details["probes"]))
    if kind is ConnectVoltmeter:
        return ConnectVoltmeter(Terminal(details["positive"]), Terminal(details["negative"]))
    if kind is EnterReading:
        # The journal holds the quantity's English words, which are its template.
        usual = details.get("usual")
        stored = {**details, "quantity": Text(details["quantity"]), "usual": None if usual is None else tuple(usual)}
        return EnterReading(**stored)
    if kind is Mend:
        return Mend(Text(details["finding"]), tuple(Text(line) for line in details["wanted"]))
    if kind is DoByHand:
        return DoByHand(word(details["said"]))
    if kind is DoubtReading:
        return DoubtReading(Text(details["finding"]))
    if kind is EnterCommand:
        # Its words hold what was read, and are no template.
        message = Text("{said}", {"said": details["said"]})
        return EnterCommand(
            message,
            details["refused"],
            tuple(details["on"]),
            details["idle"],
            tuple(details["roles"]),
            dict(details["ranges"]),
            tuple(
                FittedProbe(one["channel"], ProbeKind(one["kind"]), one["attenuation"])
                for one in details.get("probes", ())
            ),
            details.get("confirms", ""),
        )
    return kind(**{field.name: details[field.name] for field in fields(kind)})


def _setup(details: Mapping[str, Any]) -> BenchSetup:
    contacts = tuple(LeadContact(each["lead"], each["place"]) for each in details["contacts"])
    return BenchSetup(contacts, **{name: details[name] for name in _STATE})


def _change(details: Mapping[str, Any]) -> Change:
    role = details["role"]
    return Change(**{**details, "kind": ChangeKind(details["kind"]), "role": None if role is None else Role(role)})


def _probe(details: Mapping[str, Any]) -> VoltageProbe | CurrentProbe:
    if "terminal" in details:
        return CurrentProbe(details["channel"], Terminal(details["terminal"]))
    return VoltageProbe(details["channel"], Node(details["positive"]), Node(details["negative"]))
