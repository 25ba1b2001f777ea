"""The dialogue with a SCPI instrument: every setting is confirmed, every reply belongs to its query.

Rules of checking: a setting is followed by a look at the error queue before the next one goes out. A query for a
reading is not, because readings carry their own status and the look would double its cost; the queue is
read when the query fails, and drivers look once more at the end of a configuration.
"""

from collections.abc import Callable, Iterator
from contextlib import AbstractContextManager, contextmanager, nullcontext
from typing import TypeVar

from pyvisa.constants import RENLineOperation, StatusCode

from drivers.interfaces import UNWATCHED, Calls, CommunicationError, ReportedError, Traffic
from drivers.interfaces.text import Text, text
from drivers.transport.visa.blocks import BlockReader
from drivers.transport.visa.half_opened import sockets_closed_on_failure
from drivers.transport.visa.replies import QueueEntry, parse_error, parse_number, parse_numbers
from drivers.transport.visa.resource import RESOURCE_ERRORS, ResourceTimeout, VisaResource, finding

T = TypeVar("T")
_UNLIMITED = nullcontext()

ERROR_QUERY = "SYST:ERR?"
IDENTITY_QUERY = "*IDN?"

#: An error queue holds at most this many entries on the instruments supported (E4980A 100, others 30 or fewer).
LONGEST_QUEUE = 128
#: Replies that may lie before the one looked for, after a time-out.
STALE_REPLIES = 8
#: How long (s) to wait for what may still come from an instrument that had fallen silent.
DRAIN_TIME = 1.0
#: How long (s) the shutdown waits for a reply: other instruments are still energised meanwhile.
WAY_DOWN_TIME = 2.0


class ScpiSession:
    """A dialogue with one instrument over an open PyVISA resource; `timeout` is in seconds.

    `clearable` says whether the transport has a device clear, `short_reads` whether any part of a message can be read by itself.
    """

    def __init__(
        self,
        resource: VisaResource,
        name: str,
        *,
        timeout: float = 10.0,
        traffic: Traffic | None = None,
        calls: Calls = UNWATCHED,
        clearable: bool = True,
        short_reads: bool = False,
    ) -> None:
        self.name = name
        self._resource = resource
        self._timeout = timeout
        self._traffic = traffic
        self.calls = calls
        self._clearable = clearable
        self._short_reads = short_reads or not clearable
        self._identity_line: str | None = None
        self._in_step = True
        self._silent = False
        self._lost = False
        resource.timeout = timeout * 1e3

    # settings ---------------------------------------------------------------------------------------------------

    def write(self, command: str) -> None:
        """Send a setting and make sure that the instrument took it.

        Raises ReportedError with the instrument's own text, CommunicationError where it does not answer.
        """
        self.send(command)
        self.check_errors(command)

    def send(self, command: str) -> None:
        """Send a message without looking at the error queue; for a trigger, whose outcome the next query shows.

        Raises CommunicationError where it could not be sent.
        """
        with self.calls.exchange(interruptible=True):
            self._catch_up()
            self._transmit(command)

    def complete(self, command: str, *, timeout: float | None = None) -> None:
        """Send a command that takes its time, never twice, and wait until the instrument says it is done (*OPC?).

        Raises CommunicationError where it does not say so within `timeout` (s), ReportedError where it tells why.
        """
        message = f"{command};*OPC?"
        done = self.query(message, repeatable=False, timeout=timeout)
        if done.strip() not in ("1", "+1"):
            raise CommunicationError(self.name, text("'{done}' instead of 1", done=done), command=message)

    def check_left_errors(self) -> None:
        """Like `check_errors`, when an instrument is opened: errors in the queue then were caused by another user."""
        self.check_errors(
            remedy=text("The error was there before the instrument was opened and is cleared now: start again")
        )

    def check_errors(self, command: str = "", *, remedy: Text | str = "") -> None:
        """Read the error queue until it is empty; raises ReportedError with all that stood in it."""
        found = self._queued()
        if found:
            said = "; ".join(f"{entry.number} {entry.text}" for entry in found)
            words = text("the instrument reports {errors}", errors=said)
            raise ReportedError(self.name, words, command=command, remedy=remedy)

    def _queued(self) -> list[QueueEntry]:
        result: list[QueueEntry] = []
        for _ in range(LONGEST_QUEUE):
            entry = self._parsed(ERROR_QUERY, self.query(ERROR_QUERY, repeatable=False), parse_error)
            if entry.number == 0:
                break
            result.append(entry)
        return result

    # queries ----------------------------------------------------------------------------------------------------

    def query(self, command: str, *, repeatable: bool = True, timeout: float | None = None) -> str:
        """Return the reply to a query, without its termination.

        A query that may be repeated is sent a second time when the first gets no reply; `timeout` (s) replaces the
        session's for this exchange. Raises CommunicationError, or ReportedError where the error queue tells why.
        """
        with self.calls.exchange(interruptible=True):
            self._catch_up()
            if timeout is not None:
                with ResourceTimeout(self._resource, timeout):
                    return self._exchange(command, repeatable=repeatable)
            return self._exchange(command, repeatable=repeatable)

    def query_number(self, command: str) -> float:
        """Return the single number a query is answered with; raises CommunicationError where it is none."""
        return self._parsed(command, self.query(command), parse_number)

    def query_numbers(self, command: str, least: int, most: int | None = None) -> list[float]:
        """Return the `least` … `most` numbers a query is answered with; raises CommunicationError otherwise."""
        return self._parsed(command, self.query(command), lambda reply: parse_numbers(reply, least, most))

    def query_block(self, command: str, *, timeout: float | None = None) -> bytes | bytearray | memoryview:
        """Return the bytes of an IEEE 488.2 definite length block, exactly as many as it announces.

        Raises CommunicationError where the header is malformed or the block ends early.
        """
        with self.calls.exchange(interruptible=True):
            self._catch_up()
            with ResourceTimeout(self._resource, self._timeout if timeout is None else timeout):
                return self._block(command)

    def identity_line(self) -> str:
        """Return the reply to *IDN?, which also serves to find one's place again after a time-out."""
        if self._identity_line is None:
            self._identity_line = self.query(IDENTITY_QUERY, repeatable=False)
        return self._identity_line

    @contextmanager
    def within(self, timeout: float) -> Iterator[None]:
        """Wait no longer than `timeout` (s) for any reply inside the block."""
        before, self._timeout = self._timeout, timeout
        try:
            self._apply_timeout()
            yield
        finally:
            self._timeout = before
            self._apply_timeout()

    def insist(self, action: Callable[[], T]) -> T:
        """Return what an action that may be done twice returns, over a renewed connection where the present one fails."""
        try:
            return action()
        except CommunicationError:
            self.reopen()
            return action()

    def reopen(self) -> None:
        """Open the resource anew after its connection was lost.

        Raises CommunicationError where that fails or another instrument than before answers.
        """
        termination = self._resource.read_termination
        self.close()
        self._lost = True
        try:
            with sockets_closed_on_failure():
                self._resource.open()
        except (*RESOURCE_ERRORS, ValueError) as error:
            raise CommunicationError(
                self.name,
                text("cannot be opened again ({finding})", finding=finding(error)),
                remedy=text("Check power and cable"),
            ) from error
        self._lost = False
        self._apply_timeout()
        self._resource.read_termination = termination
        self._in_step, self._silent = True, False
        reply = self._ask(IDENTITY_QUERY)
        if self._identity_line not in (None, reply):
            raise CommunicationError(
                self.name,
                text("'{found}' answers instead of '{identity_line}'", found=reply, identity_line=self._identity_line),
                command=IDENTITY_QUERY,
            )

    def go_to_local(self, command: str = "") -> None:
        """Give the front panel back: by a `command` where the instrument has one, and by the transport's own message (GTL)."""
        try:
            if command:
                self.send(command)
            control = getattr(self._resource, "control_ren", None)
            if control is not None:
                control(RENLineOperation.address_gtl)
        except (CommunicationError, NotImplementedError, AttributeError, *RESOURCE_ERRORS) as error:
            # Not every transport has remote and local; without them the front panel was never locked.
            if self._traffic is not None:
                self._traffic("error", f"local: {finding(error)}")

    def close(self) -> None:
        """Close the resource; what it says about that is of no use any more."""
        try:
            self._resource.close()
        except RESOURCE_ERRORS as error:
            if self._traffic is not None:
                self._traffic("error", f"close: {finding(error)}")

    def _apply_timeout(self) -> None:
        # A resource that could not be opened again has none.
        if not self._lost:
            self._resource.timeout = self._timeout * 1e3

    # inside -----------------------------------------------------------------------------------------------------

    def _parsed(self, command: str, reply: str, parse: Callable[[str], T]) -> T:
        try:
            return parse(reply)
        except ValueError as error:
            raise CommunicationError(
                self.name, text("unusable reply '{reply}' ({error})", reply=reply, error=error), command=command
            ) from error

    def _limited(self) -> AbstractContextManager[None]:
        """Wait no longer within the block than an energised source may be silent."""
        patience = self.calls.patience
        return _UNLIMITED if patience is None else ResourceTimeout(self._resource, patience, shorter=True)

    def _transmit(self, command: str) -> None:
        if self._traffic is not None:
            self._traffic("write", command)
        try:
            with self._limited():
                self._resource.write(command)
        except RESOURCE_ERRORS as error:
            self._in_step = False
            raise CommunicationError(
                self.name,
                text("could not be sent ({finding})", finding=finding(error)),
                command=command,
                remedy=text("Check power and cable"),
            ) from error

    def _receive(self, command: str) -> str:
        try:
            with self._limited():
                raw = self._resource.read_raw()
        except RESOURCE_ERRORS as error:
            raise _NoReplyError(
                self.name, text("no reply ({finding})", finding=finding(error)), command=command
            ) from error
        if not raw.endswith(b"\n"):
            raise CommunicationError(self.name, text("an incomplete reply: {raw}", raw=repr(raw[:80])), command=command)
        try:
            reply = raw.decode("ascii").rstrip("\r\n")
        except UnicodeDecodeError as error:
            raise CommunicationError(
                self.name, text("a reply that is no text: {raw}", raw=repr(raw[:80])), command=command
            ) from error
        if self._traffic is not None:
            self._traffic("read", reply)
        return reply

    def _ask(self, command: str) -> str:
        # Out of step until the reply is here: an interrupt, too, may leave one behind.
        self._in_step = False
        self._transmit(command)
        reply = self._receive(command)
        self._in_step = True
        return reply

    def _exchange(self, command: str, *, repeatable: bool) -> str:
        try:
            return self._ask(command)
        except _NoReplyError as silence:
            if self._identity_line is None:
                raise
            self._catch_up()
            # An instrument that refused the query does not answer it; asking again would not help.
            if command != ERROR_QUERY:
                self.check_errors(command)
            if not repeatable:
                raise
            try:
                return self._ask(command)
            except CommunicationError as again:
                raise CommunicationError(
                    self.name,
                    text("{what}, twice", what=silence.what),
                    command=command,
                    remedy=text("Check that it is not in a local menu"),
                ) from again

    def _catch_up(self) -> None:
        """Make sure that the next reply read is the one to the next query."""
        if self._lost:
            raise CommunicationError(self.name, text("the connection is lost"), remedy=text("Check power and cable"))
        if self._in_step or self._identity_line is None:
            return
        if self._clearable:
            self._clear()
        if self._silent:
            self._drain()
        # Instruments answer in order: once this query is answered, no older reply can still be on its way.
        self._transmit(IDENTITY_QUERY)
        for _ in range(STALE_REPLIES):
            try:
                reply = self._receive(IDENTITY_QUERY)
            except _NoReplyError as silence:
                self._silent = True
                raise CommunicationError(
                    self.name,
                    text("does not answer any more"),
                    command=IDENTITY_QUERY,
                    remedy=text("Check power and cable, then open it again"),
                ) from silence
            except CommunicationError:
                continue  # the rest of an older reply
            if reply == self._identity_line:
                self._in_step, self._silent = True, False
                return
        raise CommunicationError(
            self.name, text("replies to another question than the one asked"), command=IDENTITY_QUERY
        )

    def _clear(self) -> None:
        try:
            self._resource.clear()
        except (*RESOURCE_ERRORS, NotImplementedError) as error:
            # Not every transport has a device clear; what follows does without.
            if self._traffic is not None:
                self._traffic("error", f"device clear: {finding(error)}")

    def _drain(self) -> None:
        """Read away what is left, an old identity among it, which could be taken for the new one."""
        with ResourceTimeout(self._resource, min(self._timeout, DRAIN_TIME)):
            for _ in range(STALE_REPLIES):
                try:
                    self._receive("")
                except _NoReplyError:
                    return
                except CommunicationError:
                    continue

    def _block(self, command: str) -> bytes | bytearray | memoryview:
        resource = self._resource
        block = BlockReader(resource, self.name, command)
        self._in_step = False
        self._transmit(command)
        text_termination = resource.read_termination
        resource.read_termination = None  # any byte value may stand inside a block
        try:
            # Stopping at the count asked for is the point here, not a finding.
            with resource.ignore_warning(StatusCode.success_max_count_read):
                data = block.by_parts(in_pieces=not self._clearable) if self._short_reads else block.by_message()
        finally:
            resource.read_termination = text_termination
        self._in_step = True
        if self._traffic is not None:
            self._traffic("read", f"block of {len(data)} bytes")
        return data


class _NoReplyError(CommunicationError):
    """Nothing came within the time allowed."""
