"""One verification of one connection: what it found, as data for the record and as words for whoever mends it."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from typing import Any

from drivers.interfaces.text import Text
from procedures.core.actions import (
    Connect,
    ConnectProbes,
    ConnectVoltmeter,
    CurrentProbe,
    Node,
    Socket,
    Terminal,
    VoltageProbe,
)
from procedures.estimation.winding.wiring import Judgement, Kind, Mistake, SensingLeads, WiringOutcome

TERMINALS = tuple(Terminal)
Connection = Connect | ConnectProbes | ConnectVoltmeter


@dataclass(frozen=True)
class Check:
    """The result of a check of a connection.

    `by` is the instrument's role, `possible` the records of mistakes that would read the same (or, of a wrong connection, that
    explain it), `read` the figures in SI units by name, `reason` a key of `words.REASONS`, `evidence` the figures in words,
    `correctable_now` false where it shows too late to be mended.
    """

    outcome: WiringOutcome
    by: str
    possible: tuple[Mapping[str, Any], ...] = ()
    read: Mapping[str, float] = field(default_factory=dict)
    reason: str = ""
    evidence: Text | None = None
    correctable_now: bool = True

    @property
    def correctable(self) -> bool:
        """True if the connection that was checked, and not only an earlier one, may be the wrong one and can be corrected now."""
        return self.correctable_now and any(not entry.get("earlier") for entry in self.possible)

    def record(self) -> dict[str, Any]:
        """Return it for the journal and the findings."""
        return {
            "outcome": self.outcome.value,
            "by": self.by,
            "reason": self.reason,
            "read": dict(self.read),
            "possible": [dict(entry) for entry in self.possible],
        }


def connection_record(connection: Connection) -> dict[str, Any]:
    """Return a connection as a record."""
    match connection:
        case Connect():
            return {"terminals": {t.value: socket.value for t, socket in connection.complete().items()}}
        case ConnectProbes(probes=probes):
            return {"probes": [_probe(probe) for probe in probes]}
        case ConnectVoltmeter(positive=positive, negative=negative):
            return {"voltmeter": [positive.value, negative.value]}


def connections_of(entry: Mapping[str, Any]) -> list[Connection]:
    """Return the connections that a record is of."""
    result: list[Connection] = []
    if "terminals" in entry:
        result.append(
            Connect({Terminal(t): Socket(s) for t, s in entry["terminals"].items() if s != Socket.OPEN.value})
        )
    if "voltmeter" in entry:
        positive, negative = (Terminal(t) for t in entry["voltmeter"])
        result.append(ConnectVoltmeter(positive, negative))
    if "probes" in entry:
        result.append(ConnectProbes(tuple(_restored(probe) for probe in entry["probes"])))
    return result


def _restored(probe: Mapping[str, Any]) -> VoltageProbe | CurrentProbe:
    if "terminal" in probe:
        return CurrentProbe(probe["channel"], Terminal(probe["terminal"]))
    return VoltageProbe(probe["channel"], Node(probe["positive"]), Node(probe["negative"]))


def _probe(probe: VoltageProbe | CurrentProbe) -> dict[str, Any]:
    if isinstance(probe, VoltageProbe):
        return {"channel": probe.channel, "positive": probe.positive.value, "negative": probe.negative.value}
    return {"channel": probe.channel, "terminal": probe.terminal.value}


def mistake_record(
    mistake: Mistake, expected: SensingLeads, channels: tuple[int | None, int | None] = (None, None)
) -> dict[str, Any]:
    """Return a mistake as a record; `channels` are those of a voltage and of a current probe, None for a voltmeter."""
    entry: dict[str, Any] = {"kind": mistake.kind.value, "terminals": _names(mistake.terminals)}
    if mistake.kind in (Kind.VOLTAGE_LEAD, Kind.VOLTAGE_REVERSED):
        entry["channel"] = channels[0]
    if mistake.kind is Kind.VOLTAGE_LEAD and expected.voltage and mistake.leads.voltage:
        number = 0 if expected.voltage[0] != mistake.leads.voltage[0] else 1
        place = mistake.leads.voltage[number]
        entry |= {"side": ("positive", "negative")[number], "at": None if place is None else TERMINALS[place].value}
    if mistake.kind is Kind.CURRENT_PROBE and mistake.leads.current:
        place = mistake.leads.current[0]
        entry |= {"channel": channels[1], "at": None if place is None else TERMINALS[place].value}
    return entry


def records(
    judgement: Judgement,
    earlier: Sequence[Mistake],
    expected: SensingLeads,
    channels: tuple[int | None, int | None] = (None, None),
) -> tuple[dict[str, Any], ...]:
    """Return the records of a judgement, and of mistakes that an earlier connection may have had instead."""
    before = [{**mistake_record(mistake, expected), "earlier": True} for mistake in earlier]
    return (*(mistake_record(mistake, expected, channels) for mistake in judgement.possible), *before)


def _names(terminals: tuple[int, ...]) -> list[str]:
    return [TERMINALS[k].value for k in terminals]


def without_current(probe: CurrentProbe) -> dict[str, object]:
    """Return the mistake of a current probe round no wire that carries a current."""
    return {"kind": Kind.CURRENT_PROBE.value, "channel": probe.channel, "at": None, "terminals": [probe.terminal.value]}
