"""Supervises a run's calls to its instruments: none begins after a stop request, and an energised source must answer in time."""

from collections.abc import Mapping
from contextlib import AbstractContextManager
from time import monotonic
from types import TracebackType

from bench.journal.events.instruments import (
    Commanding,
    DeEnergised,
    Energising,
    InstrumentCall,
    InstrumentFailed,
    ReadingTaken,
    SettingDone,
)
from bench.journal.events.safety import MadeSafe
from bench.safety.interrupts import Interrupts
from bench.station.shutdown_sequence import OFF_BY
from drivers.interfaces import Role
from drivers.interfaces.declarations import Lasting, declarations
from procedures.core.events import Event

#: The first of two tries at a reply gets this share of the time that an energised source has.
_FIRST_TRY = 0.5
#: What switches off is given at least so long (s) for a reply.
_SWITCHING_OFF = 0.2
_LEAST = 0.02
#: Calls that end what an instrument does.
STOPS = ("stop", "make_safe")


class CallWatch:
    """The calls to the instrument in one role, which has `reply_time` (s) for an answer while it is energised."""

    def __init__(self, role: Role, interrupts: Interrupts, reply_time: float, *, interruptible: bool) -> None:
        self.role = role
        self.reply_time = reply_time
        #: How many blocks and commands energise it.
        self.energised = 0
        #: Since when (s, monotonic) an answer is awaited, tries that failed included; 0 where none is.
        self.since = 0.0
        #: Since when (s, monotonic) the first call was awaited that failed; 0 once a later one is answered, for which
        #: what the run does to switch off does not count.
        self.failed_since = 0.0
        self.depth = 0
        self._interrupts = interrupts
        self._interruptible = interruptible

    @property
    def unanswered_since(self) -> float:
        """Since when (s, monotonic) an answer of the instrument is outstanding; 0 if none is."""
        return self.failed_since or self.since

    @property
    def patience(self) -> float | None:
        """Time (s) that the run's own thread waits for the next reply; None where the transport's time-out holds."""
        if not self.energised or not self._interrupts.in_own_thread():
            return None
        if not self.since:
            return _FIRST_TRY * self.reply_time
        left = self.reply_time - (monotonic() - self.since)
        return max(left, _SWITCHING_OFF if self._interrupts.is_switching_off else _LEAST)

    def exchange(self, *, interruptible: bool = False) -> AbstractContextManager[None]:
        """Watch an exchange; raises Interrupted before it where a stop was requested."""
        return _Exchange(self, self._interrupts.waiting(interruptible=interruptible and self._interruptible))

    def ended(self, error: type[BaseException] | None) -> None:
        """Take it that an exchange has ended, with an answer or an error; `depth` is what it was before."""
        if error is None:
            # Within another exchange the instrument has answered, but not yet what was asked first.
            self.since = monotonic() if self.depth else 0.0
            if not self._interrupts.is_switching_off:
                self.failed_since = 0.0
        elif issubclass(error, Exception):
            self.failed_since = self.failed_since or self.since

    def making_safe(self) -> AbstractContextManager[None]:
        """Allow commands that switch off, whatever was requested."""
        return self._interrupts.switching_off()


class _Exchange:
    def __init__(self, watch: CallWatch, waiting: AbstractContextManager[None]) -> None:
        self._watch = watch
        self._waiting = waiting
        self._depth = watch.depth

    def __enter__(self) -> None:
        watch = self._watch
        watch.depth = self._depth + 1
        watch.since = watch.since or monotonic()
        self._waiting.__enter__()

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
    ) -> None:
        self._waiting.__exit__(kind, error, trace)
        # Not counted down: an interruption may have kept a count from being made.
        self._watch.depth = self._depth
        self._watch.ended(kind)


class CallWatches:
    """The watched roles of a run; `hear` takes its journal's events to know what is energised.

    `interruptible` is false where an exchange is calls of functions of this process, which an exception would leave half done.
    """

    def __init__(
        self, interrupts: Interrupts, reply_times: Mapping[Role, float], *, interruptible: bool = True
    ) -> None:
        self._watches = {
            role: CallWatch(role, interrupts, time, interruptible=interruptible) for role, time in reply_times.items()
        }
        self._sources = {role.value: watch for role, watch in self._watches.items() if role in OFF_BY}

    def of(self, role: Role) -> CallWatch:
        """Return the watch of a role."""
        return self._watches[role]

    def hear(self, event: Event) -> None:
        """Take an event of the run's journal."""
        if not isinstance(event, InstrumentCall | InstrumentFailed | MadeSafe):
            return
        watch = self._sources.get(event.instrument)
        if watch is None:
            return
        if isinstance(event, MadeSafe):
            if event.outcome == "safe" and event.item == OFF_BY[watch.role].value:
                # The shutdown has taken the energy away.
                watch.energised = 0
            return
        declaration = declarations(watch.role.interface).get(event.call)
        lasting = declaration.lasting if declaration else None
        match event:
            case Energising():
                watch.energised += 1
            case Commanding() if lasting is not None:
                watch.energised += 1
            case DeEnergised(error=None):
                watch.energised = max(0, watch.energised - 1)
            case SettingDone() | ReadingTaken() | InstrumentFailed() if lasting is Lasting.CALL or event.call in STOPS:
                watch.energised = 0

    @property
    def energised(self) -> frozenset[str]:
        """The roles that are energised, as far as the journal says."""
        return frozenset(name for name, watch in self._sources.items() if watch.energised)

    def silent(self) -> frozenset[Role]:
        """Return the roles whose last call failed, or is awaited for longer than an energised source may take."""
        now = monotonic()
        return frozenset(
            role
            for role, watch in self._watches.items()
            if watch.failed_since or (watch.since and now - watch.since >= watch.reply_time)
        )

    def unanswered(self) -> CallWatch | None:
        """Return an energised source that has not answered for longer than it may."""
        now = monotonic()
        for watch in self._sources.values():
            since = watch.unanswered_since
            if watch.energised and since and now - since >= watch.reply_time:
                return watch
        return None
