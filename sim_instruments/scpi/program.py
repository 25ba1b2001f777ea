"""Program messages taken apart: what handles each of their units."""

from collections.abc import Iterator

from sim_instruments.scpi.errors import ScpiError
from sim_instruments.scpi.lexer import parse_unit, split_messages, split_units
from sim_instruments.scpi.tree import Call, CommandTree, Handler, Reply

_CACHED_MESSAGES = 512
_CACHED_LENGTH = 256
#: The units of what is longer (bytes) are looked at one by one as they are handled.
_LONG = 1 << 12

Step = tuple[Handler, Call]
#: What a message's units lead to, to be gone through once, and its text.
Message = tuple[tuple[Step, ...] | Iterator[Step], str]


class ProgramReader:
    """Finds what handles messages in the tree of an instrument's headers, and remembers it of those that come again."""

    def __init__(self, tree: CommandTree) -> None:
        self._tree = tree
        self._known: dict[bytes, tuple[Message, ...]] = {}

    def messages(self, data: bytes) -> tuple[Message, ...]:
        """Return the messages in what a client has sent."""
        known = self._known.get(data)
        return self._read(data) if known is None else known

    def steps(self, message: str) -> Iterator[Step]:
        """Give what handles each unit of a message; at the first one that is wrong, what raises its error."""
        if (handler := self._tree.whole(message)) is not None:
            yield handler, Call((), ())
            return
        path: tuple[str, ...] = ()
        for text in split_units(message):
            try:
                unit = parse_unit(text)
                handler, suffixes, path = self._tree.find(unit, path)
            except ScpiError as error:
                # Where a header ends is unknown after a command error, so the rest of the message is dropped.
                yield _raising(error), Call((), ())
                return
            yield handler, Call(suffixes, unit.arguments)

    def _read(self, data: bytes) -> tuple[Message, ...]:
        long = len(data) > _LONG
        messages = tuple((self.steps(text) if long else tuple(self.steps(text)), text) for text in split_messages(data))
        if len(data) <= _CACHED_LENGTH:
            if len(self._known) >= _CACHED_MESSAGES:
                self._known.clear()
            self._known[data] = messages
        return messages


def _raising(error: ScpiError) -> Handler:
    def handler(_: Call) -> Reply:
        raise ScpiError(error.number, error.text)

    return handler
