"""The fixture's relays as the motor feels them: commanded coils, contacts that may be stuck, and what they connect."""

from collections.abc import Mapping
from typing import TYPE_CHECKING

from sim_instruments.connections import Connections, connections

if TYPE_CHECKING:
    from sim_instruments.world import World

#: The current probe stays round the wire of A; its channel's input goes to Hall leads while both are closed.
_CURRENT_CHANNEL = 4


class RelayContacts:
    """Contacts by channel; `crosspoints` names what each connects. The current probe is clamped round A's wire on channel 4."""

    def __init__(self, world: "World", crosspoints: Mapping[str, int]) -> None:
        self._world = world
        self._names = {channel: name for name, channel in crosspoints.items()}
        self._channels = dict(crosspoints)
        self._stuck: dict[int, bool] = {}
        self._coils: frozenset[int] = frozenset()
        self._present: Connections | None = None
        world.attach_current_probe(_CURRENT_CHANNEL, "A")

    def channel(self, crosspoint: str) -> int:
        """Return the channel of a crosspoint. Raises ValueError for one that there is not."""
        try:
            return self._channels[crosspoint]
        except KeyError:
            raise ValueError(
                f"crosspoint {crosspoint!r} is unknown; they are named like A:supply+, N:channel1-, leads:short"
            ) from None

    def stick(self, crosspoint: str, closed: bool | None) -> None:
        """Have a contact stay closed or open whatever its coil does, or mend it with None. Raises ValueError as `channel` does."""
        channel = self.channel(crosspoint)
        if closed is None:
            self._stuck.pop(channel, None)
        else:
            self._stuck[channel] = closed
        self.follow(self._coils)

    def closed(self) -> frozenset[int]:
        """Return the channels whose contacts are closed."""
        really = {channel for channel, closed in self._stuck.items() if closed}
        return frozenset((self._coils - self._stuck.keys()) | really)

    def follow(self, coils: frozenset[int]) -> None:
        """Have the contacts follow their coils: `coils` are the channels commanded closed."""
        with self._world.lock:
            self._coils = coils
            names = [self._names[channel] for channel in self.closed() if channel in self._names]
            found, before = connections(names), self._present
            self._present = found
            self._connect(found, before)

    def _connect(self, found: Connections, before: Connections | None) -> None:
        world = self._world
        world.switch(found.wiring)
        if before is None or found.leads_shorted != before.leads_shorted:
            world.short_leads(found.leads_shorted)
        if found.voltmeter is None or found.voltmeter[0] == found.voltmeter[1]:
            world.detach_voltmeter()
        elif before is None or found.voltmeter != before.voltmeter:
            world.attach_voltmeter(*found.voltmeter)
        for channel in {*found.probes, *(before.probes if before else ())}:
            self._fit(channel, found)
        for short in found.shorts:
            world.damage.hurt(short)

    def _fit(self, channel: int, found: Connections) -> None:
        pair = found.probes.get(channel)
        if pair is not None and self._there(pair):
            self._world.attach_voltage_probe(channel, *pair)
        elif channel == _CURRENT_CHANNEL:
            self._world.attach_current_probe(channel, "A")
        else:
            self._world.detach_probe(channel)

    def _there(self, pair: tuple[str, str]) -> bool:
        """Return whether the motor has the nodes: a lead that is not there leaves the probe's tip open."""
        world = self._world
        if "N" in pair and not world.star_point_accessible:
            return False
        return world.motor.halls is not None or not any(node.startswith("H") for node in pair)
