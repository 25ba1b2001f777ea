"""A recorded instrument's answer to each message."""

from collections import defaultdict
from collections.abc import Callable, Iterable, Sequence
from dataclasses import dataclass
from threading import get_ident
from typing import Literal

from sim_instruments.catalogue import Transport


@dataclass(frozen=True)
class Exchange:
    """A message and what came before the next one; `time` (s) is when the last of that was there.

    Without a message, its replies came unasked. Where it is not `whole`, the rest of the last one never came;
    where it is `broken`, the connection failed when the message was sent, or when the reply was read.
    """

    time: float
    message: bytes
    replies: tuple[bytes, ...]
    whole: bool = True
    broken: Literal["", "write", "read"] = ""


@dataclass(frozen=True)
class RecordedSession:
    """All exchanges with one instrument. `key` gives what two messages have in common that are the same.

    Messages are SCPI without its end, a Modbus unit and PDU, bytes of a serial line, a CAN frame as candump writes it; SCPI replies
    have their ends. `unit` is a CAN node's number. An empty reply is a read that timed out.
    """

    transport: Transport
    exchanges: Sequence[Exchange]
    key: Callable[[bytes], bytes] = bytes
    unit: int = 0


class RecordedReplies:
    """Answers each message as it was answered at the same time of its being sent, and ever after as the last time.

    `reach` is told the recorded time (s) of each answer. What another thread than that of the `caller`, where there is one, asks is
    answered as what was asked last, and counts for nothing: a watchdog is fed at times of its own.
    """

    def __init__(
        self,
        session: RecordedSession,
        reach: Callable[[float], None] = lambda _: None,
        *,
        caller: int | None = None,
    ) -> None:
        self._key, self._reach, self._caller = session.key, reach, caller
        self._answers: dict[bytes, list[Exchange]] = defaultdict(list)
        self._given: dict[bytes, int] = defaultdict(int)
        for exchange in session.exchanges:
            self._answers[self._key(exchange.message)].append(exchange)

    @property
    def messages(self) -> Iterable[bytes]:
        """The messages that are answered, as their keys."""
        return self._answers.keys()

    def knows(self, message: bytes) -> bool:
        """Return whether the message is in the recording."""
        return self._key(message) in self._answers

    def answer(self, message: bytes) -> Exchange:
        """Return the exchange that a known message begins."""
        key = self._key(message)
        answers, number = self._answers[key], self._given[key]
        if self._caller not in (None, get_ident()):
            return answers[min(max(number - 1, 0), len(answers) - 1)]
        self._given[key] = number + 1
        exchange = answers[min(number, len(answers) - 1)]
        self._reach(exchange.time)
        return exchange
