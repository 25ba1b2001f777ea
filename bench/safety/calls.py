"""The calls of a run to its instruments: none begins after a stop was requested, none on an energised source stays unanswered."""

from collections.abc import Mapping
from contextlib import AbstractContextManager
from time import monotonic
from types import TracebackType
from typing import Any

from bench.safety.interrupts import Interrupts
from bench.station.shutdown_sequence import OFF_BY
from procedures.core.bench import Role

#: The first of two tries at a reply gets this share of the time that an energised source has.
_FIRST_TRY = 0.5
#: What switches off is given at least so long (s) for a reply.
_SWITCHING_OFF = 0.2
_LEAST = 0.02
#: What is energised as long as the call itself lasts, and what stays so until it is told to stop.
_BY_CALL = {(Role.INSULATION_TESTER.value, "measure"), (Role.ROTOR_ACTUATOR.value, "move_by")}
_UNTIL_STOPPED = {(Role.ROTOR_ACTUATOR.value, "turn")}
_STOPS = ("stop", "make_safe")
_CALLED = ("setting", "reading", "instrument_error")


class CallWatch:
    """The calls to the instrument in one role, which has `reply_time` (s) for an answer while it is energised."""

    def __init__(self, role: Role, interrupts: Interrupts, reply_time: float, *, interruptible: bool) -> None:
        self.role = role
        self.reply_time = reply_time
        #: How many blocks and commands energise it.
        self.energised = 0
        #: Since when (s, monotonic) an answer is awaited, tries that failed included; 0 where none is.
        self.since = 0.0
        self.depth = 0
        self._interrupts = interrupts
        self._interruptible = interruptible

    @property
    def patience(self) -> float | None:
        """How long (s) the run's own thread waits for the next reply; None where the transport's time-out holds."""
        if not self.energised or not self._interrupts.in_own_thread():
            return None
        if not self.since:
            return _FIRST_TRY * self.reply_time
        left = self.reply_time - (monotonic() - self.since)
        return max(left, _SWITCHING_OFF if self._interrupts.is_switching_off else _LEAST)

    def exchange(self, *, interruptible: bool = False) -> AbstractContextManager[None]:
        """Have an exchange watched; raises Interrupted before it where a stop was requested."""
        return _Exchange(self, self._interrupts.waiting(interruptible=interruptible and self._interruptible))

    def making_safe(self) -> AbstractContextManager[None]:
        """Let what switches off pass, whatever was requested."""
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
        watch = self._watch
        # Not counted down: an interruption may have kept a count from being made.
        watch.depth = self._depth
        if kind is None:
            # Within another exchange the instrument has answered, but not yet what was asked first.
            watch.since = monotonic() if watch.depth else 0.0


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

    def hear(self, kind: str, data: Mapping[str, Any]) -> None:
        """Take an event of the run's journal."""
        watch = self._sources.get(data.get("instrument", ""))
        if watch is None:
            return
        called = data.get("call", "")
        by_call = (watch.role.value, called) in _BY_CALL
        if kind == "energising" or (kind == "commanding" and (by_call or (watch.role.value, called) in _UNTIL_STOPPED)):
            watch.energised += 1
        elif kind == "de_energised" and "error" not in data:
            watch.energised = max(0, watch.energised - 1)
        elif _is_off(watch.role, kind, data) or (kind in _CALLED and (by_call or called in _STOPS)):
            watch.energised = 0

    @property
    def any_energised(self) -> bool:
        """Whether anything is energised, as far as the journal says."""
        return any(watch.energised for watch in self._sources.values())

    def unanswered(self) -> CallWatch | None:
        """Return an energised source that has not answered for longer than it may."""
        now = monotonic()
        for watch in self._sources.values():
            since = watch.since
            if watch.energised and since and now - since >= watch.reply_time:
                return watch
        return None


def _is_off(role: Role, kind: str, data: Mapping[str, Any]) -> bool:
    """Tell whether an event says that the shutdown has taken the energy away."""
    return kind == "made_safe" and data.get("outcome") == "safe" and data.get("item") == OFF_BY[role].value
