"""Settings kept and brought back: *SAV, *RCL, *LRN? and set-up blocks (IEEE 488.2, 10.17, 10.29, 10.33)."""

import re
from collections.abc import Callable, Iterable
from types import GeneratorType

from sim_instruments.scpi.errors import ScpiError
from sim_instruments.scpi.lexer import parse_unit, split_units
from sim_instruments.scpi.parameters import exactly, integer
from sim_instruments.scpi.settings import ScpiSettings
from sim_instruments.scpi.tree import Call, CommandTree, Handling, Reply, bare

_OPTIONAL = re.compile(r"\[[^\]]*\]")

#: Messages, one unit each, that bring an instrument that has been reset to what it was.
State = tuple[str, ...]


def answered(tree: CommandTree, queries: Iterable[str]) -> list[str]:
    """Return the commands that set what queries reply now, like `VOLT 5,(@1)` for `VOLT? (@1)`; a refused query is left out."""
    result = []
    for query in queries:
        header, _, rest = query.partition("?")
        try:
            reply = _handle(tree, query)
        except ScpiError:
            # What is not in use has no value: a bridge's voltage in current mode.
            continue
        if not isinstance(reply, str):
            raise TypeError(f"{query} replies with {type(reply).__name__}, which no command takes")
        result.append(f"{header} {reply}" + (f",{rest.strip()}" if rest.strip() else ""))
    return result


def queries_of(settings: ScpiSettings) -> list[str]:
    """Return a query of every setting, of each channel where there are several."""
    result = []
    for setting in settings:
        header = ":" + _OPTIONAL.sub("", setting.header).strip(":")
        if setting.count:
            before, _, after = header.partition("<n>")
            result += [f"{before}{number}{after}?" for number in range(1, setting.count + 1)]
        else:
            result.append(f"{header}?")
    return result


def restore(tree: CommandTree, state: Iterable[str]) -> Handling:
    """Execute the messages of a state on an instrument. Raises ScpiError at the first one that it refuses."""
    for message in state:
        for text in split_units(message):
            reply = _handle(tree, text)
            if isinstance(reply, GeneratorType):
                yield from reply
    return None


def _handle(tree: CommandTree, text: str) -> Reply | Handling:
    unit = parse_unit(text)
    handler, suffixes, _ = tree.find(unit, ())
    return handler(Call(suffixes, unit.arguments))


class StateMemory:
    """Numbered places for the settings of an instrument, which outlast a reset.

    `state` gives them, `reset` brings the instrument to where they start from; `empty` is the error of a place without any.
    """

    def __init__(
        self,
        tree: CommandTree,
        state: Callable[[], State],
        reset: Callable[[], None],
        places: range,
        empty: ScpiError,
    ) -> None:
        self._tree = tree
        self._state = state
        self._reset = reset
        self._places = places
        self._empty = empty
        self._kept: dict[int, State] = {}

    def add(self, save: str, recall: str) -> None:
        """Add the headers of saving and recalling."""
        self._tree.add(save, command=self._save)
        self._tree.add(recall, command=self._recall)

    def add_learn(self, form: Callable[[State], str | bytes]) -> None:
        """Add *LRN?, which replies with the settings in a form."""
        self._tree.add("*LRN", query=bare(lambda: form(self._state())))

    def _place(self, call: Call) -> int:
        exactly(call.arguments, 1)
        return integer(call.arguments[0], self._places[0], self._places[-1])

    def _save(self, call: Call) -> None:
        self._kept[self._place(call)] = self._state()

    def _recall(self, call: Call) -> Handling:
        state = self._kept.get(self._place(call))
        if state is None:
            raise self._empty
        self._reset()
        return restore(self._tree, state)
