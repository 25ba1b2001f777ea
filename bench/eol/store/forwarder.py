"""The thread that brings records where they belong: it goes on after every error, and says what it waits for."""

import threading
from collections.abc import Callable
from dataclasses import replace
from datetime import UTC, datetime, timedelta
from time import monotonic

from bench.eol.store.faults import program_fault
from bench.eol.store.forwarding import ForwardingRecords
from bench.eol.store.waiting import ForwardingProblem, Waiting
from drivers.interfaces.text import Text, text

#: After the first failure it is tried again so soon (s), after each further one twice as late, at the latest so (s).
FIRST, LONGEST = 1.0, 60.0
#: A turn that takes longer than this (s) is told of, and how often (s) one looks.
_SILENT, _LOOK = 10.0, 1.0


class Forwarder:
    """Works on `records` whenever there is news, and again after a pause that grows where something failed.

    Whatever becomes of a turn, a fault of the program too, the thread goes on. `state` tells what waits; who `listen`s hears each change.
    """

    def __init__(self, records: ForwardingRecords, first: float = FIRST, longest: float = LONGEST) -> None:
        self._records = records
        self._first, self._longest = first, longest
        self._news, self._over, self._left = threading.Event(), threading.Event(), threading.Event()
        self._listener: Callable[[Waiting], None] = lambda _: None
        self._lock = threading.RLock()
        self._state = Waiting()
        self._since: dict[str, ForwardingProblem] = {}
        self._failures = 0
        self._turn_began: float | None = None
        self._threads = [
            threading.Thread(target=work, name=name, daemon=True)
            for work, name in ((self._work, "forward records"), (self._watch, "watch over forwarding"))
        ]
        for thread in self._threads:
            thread.start()

    @property
    def state(self) -> Waiting:
        """The waiting records, as of the last turn."""
        with self._lock:
            return self._state

    def listen(self, listener: Callable[[Waiting], None]) -> None:
        """Call `listener` with what waits, now and at each change, from any thread."""
        with self._lock:
            self._listener = listener
            if self._state.anything:
                listener(self._state)

    def news(self) -> None:
        """Know that there is a record to be brought on."""
        self._news.set()

    def close(self, patience: float) -> Waiting:
        """Make a last turn, which may take so long (s), and return what still waits."""
        self._over.set()
        self._news.set()
        worker, watch = self._threads
        worker.join(patience)
        self._left.set()
        watch.join(patience)
        with self._lock:
            self._listener = lambda _: None
            # A turn that has not ended has not counted.
            waiting, unstored = self._records.waiting(), self._records.spooled()
            return replace(self._state, next_try=None, for_server=waiting, unstored=unstored)

    def _work(self) -> None:
        while True:
            last = self._over.is_set()
            self._news.clear()
            failed = self._try_turn(last=last)
            if last:
                self._left.set()
                return
            # New records alone are no reason to try again what failed a moment ago.
            (self._over if failed else self._news).wait(self._pause() if failed else None)

    def _try_turn(self, *, last: bool) -> bool:
        """Make one turn; tell whether something failed."""
        self._turn_began = monotonic()
        try:
            self._turn(last=last)
            failed = bool(self._note("own", self._own_words()) | self._note("server", self._server_words()))
            self._note("program", None)
        except Exception as error:  # noqa: BLE001  a fault of the program must neither end this thread nor be passed over
            self._note("program", program_fault(error))
            failed = True
        self._turn_began = None
        self._note("silent", None)
        self._failures = self._failures + 1 if failed else 0
        self._tell()
        return failed

    def _turn(self, *, last: bool) -> None:
        self._records.store_spooled()
        while self._records.forward():
            self._tell()
        self._records.sum_up(at_the_end=last)

    def _pause(self) -> float:
        return float(min(self._first * 2.0 ** min(self._failures - 1, 30), self._longest))

    def _watch(self) -> None:
        """Say it where a turn does not come to its end."""
        while not self._left.wait(_LOOK):
            began = self._turn_began
            if began is not None and monotonic() - began > _SILENT:
                self._note("silent", text("a database does not answer; the request to it has not ended yet"))
                with self._lock:
                    self._say(replace(self._state, troubles=tuple(self._since.values())))

    def _own_words(self) -> Text | None:
        fault = self._records.own_fault
        return text("the station's own database accepts no records: {why}", why=fault) if fault else None

    def _server_words(self) -> Text | None:
        fault = self._records.fault
        return text("the server accepts no records: {why}", why=fault) if fault else None

    def _note(self, what: str, why: Text | None) -> bool:
        """Have a trouble stand since it began; tell whether it stands."""
        with self._lock:
            before = self._since.get(what)
            if why is None:
                self._since.pop(what, None)
            elif before is None or str(before.why) != str(why):
                self._since[what] = ForwardingProblem(why, before.since if before else datetime.now(UTC))
            return why is not None

    def _tell(self) -> None:
        """Look at what waits, and say it; a fault of the program in that is a trouble as any other."""
        try:
            again = datetime.now(UTC) + timedelta(seconds=self._pause()) if self._failures else None
            waiting, unstored = self._records.waiting(), self._records.spooled()
            with self._lock:
                self._say(Waiting(waiting, unstored, tuple(self._since.values()), again, self._records.refused))
        except Exception as error:  # noqa: BLE001  who hears it must not end this thread
            self._note("program", program_fault(error))

    def _say(self, state: Waiting) -> None:
        before, self._state = self._state, state
        if replace(before, next_try=None) != replace(state, next_try=None):
            self._listener(state)
