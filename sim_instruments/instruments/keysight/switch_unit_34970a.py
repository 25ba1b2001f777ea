"""Keysight 34970A switch unit with matrix and actuator modules (34970A/34972A user's guide)."""

import re
from collections.abc import Collection, Mapping
from typing import TYPE_CHECKING

import numpy as np

from sim_instruments.scpi.errors import ScpiError
from sim_instruments.scpi.instrument import ScpiInstrument
from sim_instruments.scpi.lexer import Argument
from sim_instruments.scpi.parameters import exactly, integer
from sim_instruments.scpi.states import State, StateMemory
from sim_instruments.scpi.tree import Call, Handling, bare
from sim_instruments.world.fixture.relay_contacts import RelayContacts

if TYPE_CHECKING:
    from sim_instruments.world.world import World

#: A relay's time (s): both modules switch 120 channels a second.
SWITCHING_TIME = 1.0 / 120.0
_SLOT, _CHANNEL = "Channel list: slot number out of range", "Channel list: channel number out of range"
_EMPTY = "Channel list: empty scan list"
_EMPTY_PLACE = "Not able to recall state: it is empty"
_PART = re.compile(r"(\d+)(?::(\d+))?")
_LONGEST_NUMBER = 4


def _of_module(kind: str) -> tuple[int, ...]:
    """Return a module's channels within its slot."""
    if kind == "34904A":
        return tuple(10 * row + column for row in range(1, 5) for column in range(1, 9))
    if kind == "34903A":
        return tuple(range(1, 21))
    raise ValueError(f"module {kind!r} is unknown; there are 34903A and 34904A")


class Keysight34970A(ScpiInstrument):
    """Simulated side of the switch unit; `modules` are its modules by slot, as many slots as the station wants.

    Every relay that moves takes its time, one after the other; the next message waits for them. What is queried is what the
    coils were told: a contact that is stuck does not show.
    """

    unknown_word = -224
    power_on_clears = True
    #: Relays that nobody opened: the supply on two terminals, a bridge lead, an oscilloscope lead, the bridge's short.
    leftovers = (
        ("", "ROUT:CLOS (@111,122)"),
        ("", "ROUT:CLOS (@133)"),
        ("", "ROUT:CLOS (@311)"),
        ("", "ROUT:CLOS (@601)"),
    )

    def __init__(
        self,
        world: "World",
        generator: np.random.Generator,
        contacts: RelayContacts,
        modules: Mapping[int, str],
    ) -> None:
        identity = "HEWLETT-PACKARD,34970A,0,13-2-2"
        super().__init__(world.clock, generator, identity, queue_depth=20, queue_bit=0x04, version="1994.0")
        self.contacts = contacts
        self._world = world
        self._modules = dict(modules)
        self._channels = {100 * slot + channel for slot, kind in modules.items() for channel in _of_module(kind)}
        self._closed: frozenset[int] = frozenset()
        self._followed = self._closed
        self._cycles: dict[int, int] = {}
        self._busy_until = -np.inf
        self._add_commands()
        memory = StateMemory(self.tree, self.state, self.reset, range(6), ScpiError(291, _EMPTY_PLACE))
        memory.add("*SAV", "*RCL")

    def state(self) -> State:
        """Return what closes the relays that are closed."""
        return (f":ROUT:CLOS (@{','.join(map(str, sorted(self._closed)))})",) if self._closed else ()

    def _add_commands(self) -> None:
        add = self.tree.add
        add("ROUTe:CLOSe", command=self._close, query=lambda call: self._states(call, closed=True))
        add("ROUTe:CLOSe:EXCLusive", command=self._close_exclusively)
        add("ROUTe:OPEN", command=self._open, query=lambda call: self._states(call, closed=False))
        add("ROUTe:DONE", query=bare(lambda: "1" if self.pending() is None else "0"))
        add("SYSTem:CPON", command=self._power_on)
        add("SYSTem:CTYPe", query=self._module)
        add("DIAGnostic:RELay:CYCLes", query=self._count)
        add("DIAGnostic:RELay:CYCLes:CLEar", command=self._forget)

    def reset(self) -> None:
        """Open every relay."""
        self._move(frozenset())

    def pending(self) -> float | None:
        """Return when the last relay has moved; None where all have."""
        if self.clock.now() < self._busy_until:
            return self._busy_until
        # Alarms of a clock that goes with the wall's may come late: nobody is told of contacts that have not moved.
        self._follow()
        return None

    def _follow(self) -> None:
        if self._followed is not self._closed:
            self._followed = self._closed
            self.contacts.follow(self._closed)

    # switching

    def _close(self, call: Call) -> Handling:
        channels = self._listed(call)
        yield from self._settled()
        self._move(self._closed | channels)
        return (yield from self._settled())

    def _close_exclusively(self, call: Call) -> Handling:
        channels = self._listed(call)
        slots = {channel // 100 for channel in channels}
        yield from self._settled()
        self._move({channel for channel in self._closed if channel // 100 not in slots} | channels)
        return (yield from self._settled())

    def _open(self, call: Call) -> Handling:
        channels = self._listed(call)
        yield from self._settled()
        self._move(self._closed - channels)
        return (yield from self._settled())

    def _power_on(self, call: Call) -> Handling:
        exactly(call.arguments, 1)
        every = call.arguments[0].kind == "word" and call.arguments[0].text == "ALL"
        slots = set(self._modules) if every else {self._slot(call.arguments[0])}
        yield from self._settled()
        self._move({channel for channel in self._closed if channel // 100 not in slots})
        return (yield from self._settled())

    def _move(self, closed: Collection[int]) -> None:
        """Have exactly these relays closed once each one that moves has had its time."""
        wanted = frozenset(closed)
        moving = wanted ^ self._closed
        for channel in wanted - self._closed:
            self._cycles[channel] = self._cycles.get(channel, 0) + 1
        self._closed = wanted
        if not moving:
            return
        self._busy_until = max(self._busy_until, self.clock.now()) + len(moving) * SWITCHING_TIME
        self._world.clock.call_at(self._busy_until, self._arrive)

    def _arrive(self) -> None:
        if self.clock.now() >= self._busy_until:
            self._follow()

    def _settled(self) -> Handling:
        while (wake := self.pending()) is not None:
            yield wake
        return None

    # queries

    def _states(self, call: Call, *, closed: bool) -> Handling:
        channels = self._ordered(call)
        yield from self._settled()
        return ",".join(str(int((channel in self._closed) is closed)) for channel in channels)

    def _module(self, call: Call) -> str:
        exactly(call.arguments, 1)
        slot = self._slot(call.arguments[0])
        return f"HEWLETT-PACKARD,{self._modules.get(slot, 0)},0,{'2.0' if slot in self._modules else '0'}"

    def _count(self, call: Call) -> str:
        return ",".join(f"{self._cycles.get(channel, 0):+d}" for channel in self._ordered(call))

    def _forget(self, call: Call) -> None:
        for channel in self._ordered(call):
            self._cycles.pop(channel, None)

    # parameters

    def _slot(self, argument: Argument) -> int:
        number = integer(argument, 100, 900)
        if number % 100:
            raise ScpiError(-222)
        if number // 100 > max(self._modules):
            raise ScpiError(111, _SLOT)
        return number // 100

    def _listed(self, call: Call) -> frozenset[int]:
        return frozenset(self._ordered(call))

    def _ordered(self, call: Call) -> list[int]:
        """Return the channels of a list like (@111,203) or (@111:148), in its order.

        Of a range, first and last must exist; what does not in between is passed over. Raises ScpiError.
        """
        exactly(call.arguments, 1)
        argument = call.arguments[0]
        if argument.kind != "expression":
            raise ScpiError(-104)
        text = "".join(argument.text.split())
        if not text.startswith("@"):
            raise ScpiError(-171)
        if text == "@":
            raise ScpiError(113, _EMPTY)
        channels: list[int] = []
        for part in text[1:].split(","):
            match = _PART.fullmatch(part)
            if match is None:
                raise ScpiError(-171)
            first = self._existing(match[1])
            last = first if match[2] is None else self._existing(match[2])
            low, high = sorted((first, last))
            found = [channel for channel in range(low, high + 1) if channel in self._channels]
            channels += found if first <= last else reversed(found)
        return channels

    def _existing(self, digits: str) -> int:
        number = int(digits) if len(digits) <= _LONGEST_NUMBER else 0
        if number // 100 not in self._modules:
            raise ScpiError(111, _SLOT)
        if number not in self._channels:
            raise ScpiError(112, _CHANNEL)
        return number
