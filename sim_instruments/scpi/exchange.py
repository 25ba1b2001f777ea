"""Message exchange control: input buffer, output queue, and what waits in between (IEEE 488.2, chapter 6)."""

from collections import deque
from collections.abc import Generator, Iterable
from enum import Enum
from itertools import chain
from types import GeneratorType
from typing import Protocol, cast

import numpy as np

from sim_instruments.faults.line_faults import Fault, FaultKind, Faults, spoil
from sim_instruments.scpi.errors import ScpiError
from sim_instruments.scpi.long_reply import LongReply, joined
from sim_instruments.scpi.mistaken import other_channel, unreadable
from sim_instruments.scpi.program import Message, ProgramReader, Step
from sim_instruments.scpi.tree import CommandTree, HalfReply, Handling, Reply, WholeReply
from sim_instruments.transports.connection import Connection

_INPUT_BUFFER = 1 << 20
#: After so many units of one message others have their turn.
_UNITS_IN_A_TURN = 32


class InstrumentClock(Protocol):
    """The virtual time (s)."""

    def now(self) -> float:
        """Return the time."""

    def sleep(self, seconds: float) -> None:
        """Wait for a time (s)."""


class ReadEnd(Enum):
    """The reason why a read ended."""

    MESSAGE = "end of message"
    COUNT = "count reached"
    TERMINATION = "termination character"


class NoReplyError(Exception):
    """Nothing came within the time-out."""


class MessageExchange:
    """Takes program messages apart, has their units handled in order and keeps the one response message.

    Handlers that take virtual time run as generators: a write returns at once, and the reader waits. Errors of the
    messages go to `report`, never to the caller. `channels` is how many the instrument has, for one that mistakes them;
    `terminator` ends its replies.
    """

    channels = 1
    terminator = b"\n"
    #: Whether a message is begun while it is written, where nothing is before it.
    _at_once = True

    def __init__(self, clock: InstrumentClock, generator: np.random.Generator) -> None:
        self.clock = clock
        self.tree = CommandTree()
        self._program = ProgramReader(self.tree)
        self.faults = Faults()
        self.connection = Connection()
        self._generator = generator
        #: Lines that nobody has asked for; they come before the next reply.
        self.unasked: list[bytes] = []
        self._partial = b""
        self._backlog: deque[Message] = deque()
        self._running: Generator[float, None, None] | None = None
        self._wake = 0.0
        self._fault: Fault | None = None
        self._text = ""
        #: The message that is being handled, or was last.
        self.message = ""
        self._held: bytes | None = None
        self._output: bytes | None = None
        self._position = 0
        self._ended = True
        self._ready = 0.0
        self._mute = False
        self._working = False

    def report(self, error: ScpiError) -> None:
        """Take note of an error; instruments put it into their queue."""
        raise NotImplementedError

    # the client's side

    def write(self, data: bytes, end: bool = True) -> None:
        """Take bytes of a program message; `end` says that the last one came with END."""
        if self._partial or not end:
            self._partial += data
            if len(self._partial) > _INPUT_BUFFER:
                self._partial = b""
                self.report(ScpiError(-363))
            if not end:
                return
            data, self._partial = self._partial, b""
        if self._running is not None:
            self.poll()
        messages = self._program.messages(data)
        if self._at_once and self._running is None and len(messages) == 1:
            self._begin(messages[0])
            if self._running is not None:
                self.poll()
            return
        self._backlog.extend(messages)
        self.poll()

    def read(self, count: int, timeout: float | None, termination: int | None = None) -> tuple[bytes, ReadEnd]:
        """Return at most `count` bytes of the response and why it is not more.

        `timeout` in virtual seconds, None for ever; `termination` is the byte to stop after. Raises NoReplyError.
        """
        if self._output is None or self._ready > 0.0:
            self._wait(timeout)
        output = cast("bytes", self._output)
        start = self._position
        stop = min(start + count, len(output))
        reason = ReadEnd.MESSAGE if stop == len(output) else ReadEnd.COUNT
        if termination is not None:
            found = output.find(termination, start, stop)
            if found >= 0:
                stop, reason = found + 1, ReadEnd.TERMINATION
        if stop < len(output):
            self._position = stop
            return output[start:stop], reason
        self._output, self._position = None, 0
        if not self._ended and reason is ReadEnd.MESSAGE:
            # The rest of the message never comes: the reader gets what there is and then waits in vain.
            self._mute, reason = True, ReadEnd.COUNT
        return (output if start == 0 else output[start:]), reason

    def clear(self) -> None:
        """Device clear: forget input, output and whatever is being waited for."""
        if self._running is not None:
            self._running.close()
        self._running = None
        self._backlog.clear()
        self._partial = b""
        self._output, self._position, self._ready, self._mute = None, 0, 0.0, False
        self._held = None

    @property
    def message_available(self) -> bool:
        """True if a response can be read now."""
        self.poll()
        return self._output is not None and self._ready <= self.clock.now()

    @property
    def busy(self) -> bool:
        """True if messages are still waiting to be handled."""
        return self._running is not None or bool(self._backlog)

    # the instrument's side

    def poll(self) -> None:
        """Go on with whatever was due by now; a handler that asks for the status in between changes nothing."""
        if self._working:
            return
        self._working = True
        try:
            while self._go_on():
                continue
        finally:
            self._working = False

    def _go_on(self) -> bool:
        """Do the next thing that is due by now; return whether there was one."""
        if self._running is None:
            if not self._backlog:
                return False
            self._begin(self._backlog.popleft())
        elif self._wake <= self.clock.now():
            self._step(self._running)
        else:
            return False
        return True

    def _step(self, running: Generator[float, None, None]) -> None:
        try:
            self._wake = next(running)
        except StopIteration:
            self._running = None

    def _wait(self, timeout: float | None) -> None:
        now = self.clock.now()
        deadline = float("inf") if timeout is None else now + timeout
        while True:
            self.poll()
            now = self.clock.now()
            if self._output is not None and self._ready <= now:
                self._ready = 0.0
                return
            if self._output is not None:
                wake = self._ready
            elif self._running is not None:
                wake = self._wake
            else:
                if not self._mute:
                    self.report(ScpiError(-420))
                wake = float("inf")
            if wake > deadline or wake == float("inf"):
                if now < deadline < float("inf"):
                    self.clock.sleep(deadline - now)
                raise NoReplyError
            self.clock.sleep(max(wake - now, 0.0))

    def _begin(self, message: Message) -> None:
        steps, text = message
        self.message = text
        self._mute = False
        if self._output is not None:
            self._output, self._position, self._ready = None, 0, 0.0
            self.report(ScpiError(-410))
        if self.faults and (fault := self.faults.strike(text)) is not None:
            self._fault, self._text = fault, text
            if fault.kind is FaultKind.WRONG_CHANNEL:
                steps = tuple(self._program.steps(other_channel(text, self.channels)))
        else:
            self._fault = None
        if isinstance(steps, tuple) and len(steps) == 1:
            handler, call = steps[0]
            try:
                reply = handler(call)
            except ScpiError as error:
                self.report(error)
                return
            if type(reply) is not GeneratorType:
                if reply is not None:
                    self._respond(cast("str | bytes | LongReply", reply))
                return
            self._running = self._run(steps[1:], cast("Handling", reply))
        else:
            self._running = self._run(steps)
        self._wake = 0.0

    def _run(self, steps: Iterable[Step], first: Handling | None = None) -> Generator[float, None, None]:
        replies: list[str | bytes | LongReply] = []
        pending: Iterable[Handling | Step] = chain(() if first is None else (first,), steps)
        for place, item in enumerate(pending, 1):
            if place % _UNITS_IN_A_TURN == 0:
                yield 0.0
            try:
                reply: Reply | Handling = item[0](item[1]) if isinstance(item, tuple) else item
                if isinstance(reply, GeneratorType):
                    reply = yield from reply
            except ScpiError as error:
                self.report(error)
                if -199 <= error.number <= -100:
                    break
                continue
            if reply is not None:
                replies.append(cast("str | bytes | LongReply", reply))
        if len(replies) == 1:
            self._respond(replies[0])
        elif replies:
            self._respond(joined(replies))

    def _streams(self, reply: LongReply) -> bool:
        """Return whether a long reply has been taken over, to be made while it is sent."""
        return False

    def _respond(self, reply: str | bytes | LongReply) -> None:
        if isinstance(reply, LongReply):
            undisturbed = self._fault is None and self._held is None and not self.unasked
            if undisturbed and self._streams(reply):
                return
            reply = bytes(reply)
        output = reply if isinstance(reply, bytes) else reply.encode("latin-1")
        if not isinstance(reply, WholeReply):
            output += self.terminator
        if self.unasked:
            output = b"".join(self.unasked) + output
            self.unasked.clear()
        self._ended = not isinstance(reply, HalfReply)
        if (fault := self._fault) is not None:
            self._fault = None
            output = self._faulty(fault, output)
        if self._held is not None and output:
            output, self._held = self._held, output
        if output:
            self._output = output
        else:
            self._mute = True

    def _faulty(self, fault: Fault, output: bytes) -> bytes:
        """Return what comes of a reply that a fault strikes, possibly nothing."""
        match fault.kind:
            case FaultKind.STALE if self._held is None:
                self._held = output
                return b""
            case FaultKind.FROZEN:
                return fault.remembered(self._text, output)
            case FaultKind.NOT_A_NUMBER | FaultKind.OVERFLOW:
                return unreadable(output, fault.kind)
            case FaultKind.LATE:
                self._ready = self.clock.now() + fault.delay
            case FaultKind.HALF | FaultKind.SILENCE:
                self._ended = False
        spoilt = spoil(fault, output, self._generator)
        if fault.kind is FaultKind.REPLACE and spoilt.endswith(b"\n"):
            return spoilt.rstrip(b"\r\n") + self.terminator
        return spoilt
