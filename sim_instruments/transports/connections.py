"""The connections that closed relays make: terminals to sockets, probes and sense leads to nodes, and invalid combinations."""

from collections.abc import Collection, Mapping
from dataclasses import dataclass
from typing import cast

from sim_instruments.world.probes import Node
from sim_instruments.world.settings import TERMINALS, Contact, Socket, Terminal

#: Sockets of one instrument, the strongest first: of several on one terminal, it decides what the motor feels.
_POLES: tuple[tuple[Socket, ...], ...] = (
    ("supply+", "supply-"),
    ("inverter_u", "inverter_v", "inverter_w"),
    ("drive_1", "drive_2", "drive_3"),
    ("insulation_high",),
    ("lcr_high", "lcr_low"),
    ("link",),
)
#: The relay that joins the bridge's leads.
LEADS_SHORT = "leads:short"


@dataclass(frozen=True)
class Connections:
    """The connections of the motor, the voltmeter, the scope's channels and the bridge's leads; `shorts` in words."""

    wiring: Mapping[Terminal, Contact]
    voltmeter: tuple[Terminal, Terminal] | None
    probes: Mapping[int, tuple[Node, Node]]
    leads_shorted: bool
    shorts: tuple[str, ...]


def connections(closed: Collection[str]) -> Connections:
    """Return what closed crosspoints make, each named like `A:supply+`, `B:voltmeter-`, `N:channel1+` or `leads:short`."""
    points: dict[str, list[str]] = {}
    for name in sorted(closed):
        if name != LEADS_SHORT:
            node, point = name.split(":")
            points.setdefault(point, []).append(node)
    leads = {point: nodes for point, nodes in points.items() if _is_lead(point)}
    nets = _Nets()
    for point, nodes in points.items():
        if point not in leads:
            nets.join(point, *nodes)
    shorts = [
        f"{' and '.join(nodes)} are joined by the lead {point}"
        for point, nodes in leads.items()
        if len({nets.of(node) for node in nodes}) > 1
    ]
    for nodes in leads.values():
        nets.join(*nodes)
    wiring: dict[Terminal, Contact] = {}
    for terminal in TERMINALS:
        net = nets.of(terminal)
        sockets = [point for point in net if point in points]
        if len(sockets) > 1:
            shorts.append(f"{' and '.join(sockets)} are joined at {terminal}")
        wiring[terminal] = _contact(net, sockets)
    return Connections(
        wiring,
        cast("tuple[Terminal, Terminal] | None", _pair(leads, "voltmeter")),
        {
            channel: cast("tuple[Node, Node]", pair)
            for channel in range(1, 5)
            if (pair := _pair(leads, f"channel{channel}")) is not None
        },
        LEADS_SHORT in closed,
        tuple(shorts),
    )


def _contact(net: tuple[str, ...], sockets: list[str]) -> Contact:
    terminals = [terminal for terminal in TERMINALS if terminal in net]
    for poles in _POLES:
        found = [socket for socket in poles if socket in sockets]
        if len(found) == 1:
            return found[0]
        if found:
            # One instrument's poles are joined: it drives nothing, and the terminals of the net are one.
            return cast("Contact", f"joined_{terminals[0].lower()}")
    return cast("Contact", f"joined_{terminals[0].lower()}") if len(terminals) > 1 else "open"


def _is_lead(point: str) -> bool:
    return point.startswith(("voltmeter", "channel"))


def _pair(leads: Mapping[str, list[str]], name: str) -> tuple[str, str] | None:
    plus, minus = leads.get(f"{name}+"), leads.get(f"{name}-")
    return (plus[0], minus[0]) if plus and minus else None


class _Nets:
    """Points that are joined, as tuples in the order in which they came."""

    def __init__(self) -> None:
        self._nets: dict[str, tuple[str, ...]] = {}

    def of(self, point: str) -> tuple[str, ...]:
        return self._nets.get(point, (point,))

    def join(self, *points: str) -> None:
        members = tuple(dict.fromkeys(member for point in points for member in self.of(point)))
        for member in members:
            self._nets[member] = members
