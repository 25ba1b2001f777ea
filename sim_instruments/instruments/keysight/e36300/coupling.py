"""Coupling and regulation of an E36313A's outputs: pairing, tracking, remote sense, list mode (programming guide)."""

from collections.abc import Callable, Mapping

from sim_instruments.scpi.errors import ScpiError
from sim_instruments.scpi.lexer import Argument
from sim_instruments.scpi.parameters import boolean, choice, choices, exactly
from sim_instruments.scpi.tree import Call, CommandTree, bare

_PAIRS = choices(("OFF", "PARallel", "SERies"))
_SENSES = choices(("INTernal", "EXTernal"))
_MODES = choices(("FIXed", "STEP", "LIST"))
#: The outputs that can be paired and that track each other.
_FIRST, _SECOND = 2, 3
#: By what an output rises whose remote sense leads hang in the air.
_UNSENSED = 1.01


class Coupling:
    """State of the coupling; `changed` is called when an output is to follow, `channels` finds those of a command."""

    def __init__(
        self,
        tree: CommandTree,
        outputs: tuple[int, ...],
        channels: Callable[[tuple[Argument, ...]], tuple[int, ...]],
        changed: Callable[[], None],
        switched_off: Callable[[tuple[int, ...]], None],
    ) -> None:
        self._outputs = outputs
        self._channels = channels
        self._changed = changed
        self._switch_off = switched_off
        self.reset()
        tree.add("OUTPut:PAIR", command=self._set_pair, query=bare(lambda: self._pair))
        tree.add("OUTPut:TRACk[:STATe]", command=self._set_track, query=bare(lambda: str(int(self._track))))
        for header, values, table in (
            ("[SOURce]:VOLTage:SENSe[:SOURce]", "senses", _SENSES),
            ("[SOURce]:VOLTage:MODE", "voltage_modes", _MODES),
            ("[SOURce]:CURRent:MODE", "current_modes", _MODES),
        ):
            tree.add(header, command=self._setter(values, table), query=self._getter(values))

    def reset(self) -> None:
        """Return to outputs of their own that are sensed at their terminals."""
        self._pair, self._track = "OFF", False
        self.senses = dict.fromkeys(self._outputs, "INT")
        self.voltage_modes = dict.fromkeys(self._outputs, "FIX")
        self.current_modes = dict.fromkeys(self._outputs, "FIX")

    def check(self, channel: int, quantity: str) -> None:
        """Raise ScpiError -221 for a set point that the output does not take as it is coupled."""
        if self._pair != "OFF" and channel == _SECOND:
            raise ScpiError(-221)
        if {"voltage": self.voltage_modes, "current": self.current_modes}.get(quantity, {}).get(channel) == "LIST":
            raise ScpiError(-221)

    def following(self, channel: int, quantity: str) -> tuple[int, ...]:
        """Return the outputs that take a set point of an output, itself included."""
        if self._track and quantity == "voltage" and channel in (_FIRST, _SECOND):
            return _FIRST, _SECOND
        return (channel,)

    def voltage_share(self, channel: int) -> float:
        """Return what of its set voltage an output gives at its own terminals; it reads the set one."""
        share = 0.5 if self._pair == "SER" and channel in (_FIRST, _SECOND) else 1.0
        return share * (_UNSENSED if self.senses[channel] == "EXT" else 1.0)

    def _set_pair(self, call: Call) -> None:
        exactly(call.arguments, 1)
        pair = choice(call.arguments[0], _PAIRS)
        if pair != self._pair:
            self._pair = pair
            self._switch_off((_FIRST, _SECOND))

    def _set_track(self, call: Call) -> None:
        exactly(call.arguments, 1)
        self._track = boolean(call.arguments[0])

    def _setter(self, values: str, table: Mapping[str, str]) -> Callable[[Call], None]:
        def set_them(call: Call) -> None:
            exactly(call.arguments, 1, 2)
            word = choice(call.arguments[0], table)
            for channel in self._channels(call.arguments[1:]):
                getattr(self, values)[channel] = word
            self._changed()

        return set_them

    def _getter(self, values: str) -> Callable[[Call], str]:
        def get_them(call: Call) -> str:
            exactly(call.arguments, 0, 1)
            return ",".join(getattr(self, values)[channel] for channel in self._channels(call.arguments))

        return get_them
