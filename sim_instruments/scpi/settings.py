"""Settings declared as data: a header, a kind of value, its limits and how it is replied."""

from collections.abc import Callable, Iterable, Iterator
from dataclasses import dataclass, field

from sim_instruments.scpi.errors import ScpiError
from sim_instruments.scpi.lexer import Argument
from sim_instruments.scpi.parameters import boolean, choice, choices, exactly, integer, number, string
from sim_instruments.scpi.tree import Call, CommandTree

Value = float | int | bool | str


@dataclass
class Setting:
    """One setting, or one a channel where `count` is not 0; `values` holds what is set now."""

    header: str
    parse: Callable[[Argument], Value]
    reply: Callable[[Value], str]
    initial: Value
    count: int = 0
    changed: Callable[[int], None] | None = None
    limits: Callable[[str], Value] | None = None
    values: list[Value] = field(default_factory=list)

    def __post_init__(self) -> None:
        self.reset()

    def reset(self) -> None:
        """Return to the initial value."""
        self.values = [self.initial] * max(self.count, 1)

    def _index(self, call: Call) -> int:
        if not self.count:
            return 0
        if not 1 <= call.channel <= self.count:
            raise ScpiError(-114)
        return call.channel - 1

    def set(self, call: Call) -> None:
        """Handle the command. Raises ScpiError."""
        index = self._index(call)
        exactly(call.arguments, 1)
        self.values[index] = self.parse(call.arguments[0])
        if self.changed is not None:
            self.changed(index + 1)

    def get(self, call: Call) -> str:
        """Handle the query, with MIN or MAX where there are limits. Raises ScpiError."""
        index = self._index(call)
        if call.arguments:
            if self.limits is None:
                raise ScpiError(-108)
            exactly(call.arguments, 1)
            return self.reply(self.limits(call.arguments[0].text))
        return self.reply(self.values[index])


class ScpiSettings:
    """The settings of an instrument under short names; creating one registers its header."""

    def __init__(self, tree: CommandTree, number_format: str) -> None:
        self._tree = tree
        self._number_format = number_format
        self._settings: dict[str, Setting] = {}

    def _add(self, name: str, setting: Setting) -> Setting:
        self._settings[name] = setting
        self._tree.add(setting.header, command=setting.set, query=setting.get)
        return setting

    def __iter__(self) -> Iterator[Setting]:
        return iter(self._settings.values())

    def __getitem__(self, name: str) -> Setting:
        return self._settings[name]

    def number(self, name: str, channel: int = 1) -> float:
        """Return a numeric setting."""
        return float(self._settings[name].values[channel - 1])

    def flag(self, name: str, channel: int = 1) -> bool:
        """Return a boolean setting."""
        return bool(self._settings[name].values[channel - 1])

    def word(self, name: str, channel: int = 1) -> str:
        """Return a setting that is a word or a string."""
        return str(self._settings[name].values[channel - 1])

    def put(self, name: str, value: Value, channel: int = 1) -> None:
        """Change a setting from within the instrument."""
        self._settings[name].values[channel - 1] = value

    def reset(self) -> None:
        """Return all settings to their initial values."""
        for setting in self._settings.values():
            setting.reset()

    def add_number(
        self,
        name: str,
        header: str,
        low: float,
        high: float,
        initial: float,
        *,
        unit: str = "",
        count: int = 0,
        changed: Callable[[int], None] | None = None,
    ) -> None:
        """Add a number within limits."""

        def limits(word: str) -> Value:
            if word not in ("MIN", "MINIMUM", "MAX", "MAXIMUM"):
                raise ScpiError(-141)
            return low if word.startswith("MIN") else high

        self._add(
            name,
            Setting(
                header,
                lambda argument: number(argument, low, high, default=initial, unit=unit),
                lambda value: format(float(value), self._number_format),
                initial,
                count,
                changed,
                limits,
            ),
        )

    def add_integer(
        self,
        name: str,
        header: str,
        low: int,
        high: int,
        initial: int,
        *,
        changed: Callable[[int], None] | None = None,
    ) -> None:
        """Add an integer within limits."""
        self._add(
            name,
            Setting(
                header,
                lambda argument: integer(argument, low, high, default=initial),
                lambda value: f"{int(value):+d}",
                initial,
                changed=changed,
            ),
        )

    def add_flag(
        self,
        name: str,
        header: str,
        initial: bool,
        *,
        count: int = 0,
        changed: Callable[[int], None] | None = None,
        replies: tuple[str, str] = ("0", "1"),
    ) -> None:
        """Add ON or OFF, and what is replied of off and of on."""
        self._add(name, Setting(header, boolean, lambda value: replies[bool(value)], initial, count, changed))

    def add_choice(
        self,
        name: str,
        header: str,
        words: Iterable[str],
        initial: str,
        *,
        count: int = 0,
        changed: Callable[[int], None] | None = None,
    ) -> None:
        """Add one word out of several, written with their short forms in capitals."""
        table = choices(words)
        self._add(name, Setting(header, lambda argument: choice(argument, table), str, initial, count, changed))

    def add_string(self, name: str, header: str, *, count: int = 0) -> None:
        """Add a quoted string, empty at first."""
        self._add(name, Setting(header, string, _quoted, "", count))


def _quoted(value: Value) -> str:
    doubled = str(value).replace('"', '""')
    return f'"{doubled}"'
