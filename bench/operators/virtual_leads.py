"""Leads as the virtual hands have connected them."""

from bench.operators.hands_on import HandsOn
from procedures.core.actions import ChangeSetup, Terminal, VoltageProbe
from procedures.core.setup import BenchSetup, LeadContact
from procedures.core.setup_change import ChangeKind

_CHANNELS = range(1, 9)


class VirtualLeads:
    """The leads that these hands have connected; the terminals' wires, the last to be connected, are connected together."""

    def __init__(self, world: HandsOn) -> None:
        self._world = world
        self._contacts: set[LeadContact] = set()
        self._shown = BenchSetup()

    def clear(self) -> None:
        """Take off whatever anybody has put on."""
        self._contacts.clear()
        for channel in _CHANNELS:
            self._world.detach_probe(channel)
        self._world.detach_voltmeter()
        self._world.take_off([terminal.value for terminal in Terminal])
        self._shown = BenchSetup()

    def take_off(self, contact: LeadContact) -> None:
        """Take a lead off."""
        self._contacts.discard(contact)
        if contact.is_socket:
            self._world.take_off([contact.place])
        self._show()

    def put_on(self, contact: LeadContact, origin: LeadContact) -> None:
        """Put a lead on, from where it was, if it was anywhere."""
        self._contacts.discard(origin)
        self._contacts.add(contact)
        self._show()

    def wire(self, action: ChangeSetup) -> None:
        """Put the terminals' wires on where they were worked at; to clip the bridge's leads together is none of that."""
        kinds = {change.kind for change in action.changes}
        worked = ChangeKind.CLEAR in kinds or action.before.terminals != action.after.terminals
        if worked and ChangeKind.CLIP_TOGETHER not in kinds:
            wiring = action.after.terminals
            self._world.connect({terminal.value: socket.value for terminal, socket in wiring.items()})

    def _show(self) -> None:
        """Have voltmeter and probes as the hands have them; one that hangs by half its leads senses nothing."""
        world, before, now = self._world, self._shown, BenchSetup().having(self._contacts)
        if now.voltmeter != before.voltmeter:
            world.detach_voltmeter()
            if now.voltmeter is not None:
                world.attach_voltmeter(*(node.value for node in now.voltmeter))
        for probe in set(before.probes) - set(now.probes):
            world.detach_probe(probe.channel)
        for probe in set(now.probes) - set(before.probes):
            if isinstance(probe, VoltageProbe):
                world.attach_voltage_probe(probe.channel, probe.positive.value, probe.negative.value)
            else:
                world.attach_current_probe(probe.channel, probe.terminal.value)
        self._shown = now
