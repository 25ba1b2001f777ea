"""The run's connection to its guardian: sends heartbeats, and stops the run if the guardian has ended."""

import os
import subprocess
import sys
import threading
from collections.abc import Mapping, Sequence
from contextlib import suppress
from pathlib import Path
from time import monotonic
from typing import IO, Any, Protocol

from bench.journal.events.instruments import (
    Commanding,
    DeEnergised,
    DeEnergising,
    Energising,
    InstrumentFailed,
    ReadingTaken,
    SettingDone,
)
from bench.journal.events.safety import GuardianEnd, GuardianStart
from bench.safety.calls import STOPS, CallWatches
from bench.safety.guardian.anchor import RecordAnchor
from bench.safety.guardian.protocol import BEATS, GuardianTask, decode, encode
from bench.safety.guardian.scope import Scope
from bench.safety.interrupts import Interrupted, Interrupts
from bench.safety.liveness import ProgressStamps
from drivers.interfaces.text import Text, text
from procedures.core.bench import Recorder
from procedures.core.events import Event, StepFinished, StepStarted

#: How long (s) a guardian may take to be there, and to leave: a busy disk has kept one for six seconds that closed its record.
_START, _LEAVE = 30.0, 15.0
#: How long (s) it may take to leave when it first has to switch off what the run could not.
_LEAVE_UNSAFE = 25.0
#: How long (s) after the end of its output its process may still be there.
_REAP = 1.0
#: How long (s) a guardian that lives may be silent.
_SILENCE = 2.0
#: A guardian that carried out the shutdown has let go of the instruments within this time (s) of hearing that the run is awake.
_YIELD = 0.5
#: How often between two beats it is looked whether a call is unanswered.
_LOOKS = 5
#: A run whose call to an energised source was not answered in time has met its driver's error after this further time (s).
_NOTICE = 0.5
#: A run that was interrupted so long (s) ago, and has neither begun its shutdown nor its guardian's trust any more, is ended as it is.
_FUTILE = 60.0
_MUTE = text("the guardian, which does not answer")
#: What a guardian is said to have done that measured everything off after a run could not make it so.
SWITCHED_OFF = "the guardian has switched off what the run could not"
#: What a run does that has handled an error, but for calls that stop something.
_GOING_ON = (Energising, Commanding, SettingDone, ReadingTaken, StepStarted, StepFinished)


class Guard(Protocol):
    """Guardian of a run."""

    def hear(self, event: Event) -> None:
        """Take an event of the journal. Raises Interrupted where nothing may be energised any more."""

    def going_down(self) -> None:
        """Be told that the run carries out the shutdown itself."""

    def dismiss(self, *, journal_lost: bool, unsafe: bool = False) -> Sequence[str]:
        """Take the report that the run has ended with everything off, or not (`unsafe`); return what failed.

        May be called twice.
        """

    def record_in(self, journal: Recorder) -> None:
        """Record the beginning of the guardian's own record in the journal."""

    def about(self) -> GuardianStart | None:
        """Return what a run's record says of its guardian at the beginning, None where it has none."""

    def record_end(self) -> GuardianEnd | None:
        """Return where the guardian's own record ends, once it is dismissed; None where there is no guardian."""


class Unguarded:
    """Used if no guardian is needed: nothing remains energised after the run's process, or a person does everything."""

    def hear(self, event: Event) -> None:
        """Pass."""

    def going_down(self) -> None:
        """Pass."""

    def dismiss(self, *, journal_lost: bool, unsafe: bool = False) -> Sequence[str]:
        """Return no messages."""
        return ()

    def record_in(self, journal: Recorder) -> None:
        """Pass."""

    def about(self) -> GuardianStart | None:
        """Return None: there is no guardian."""
        return None

    def record_end(self) -> GuardianEnd | None:
        """Return None: there is no guardian."""
        return None


class GuardianLink:
    """Starts a guardian; nothing is energised before it is ready, nor after it has died or carried out the shutdown.

    It keeps the file descriptors `lifelines` open, so that others learn when it, too, has ended.
    """

    def __init__(
        self,
        charge: GuardianTask,
        life: ProgressStamps,
        interrupts: Interrupts,
        calls: CallWatches,
        scope: Scope,
        lifelines: Sequence[int] = (),
    ) -> None:
        self._scope = scope
        self._charge = charge
        self._anchor = RecordAnchor()
        self._life = life
        self._interrupts = interrupts
        self._calls = calls
        #: What the guardian was told of as unanswered: the role, since when, and the words for it.
        self._unanswered: tuple[str, float, Text] | None = None
        #: Instruments whose error the run has met, so that it ends by itself.
        self._failing: set[str] = set()
        #: What the guardian was told is energised, and whether that a block ended after an error.
        self._on: frozenset[str] = frozenset()
        self._unwinding = False
        self._lock = threading.Lock()
        self._news = threading.Condition()
        self._ready = self._leaving = False
        self._over = threading.Event()
        self._ended: Text | str = ""
        self._sent = self._echo = 0
        self._echoed = monotonic()
        self._down = self._taken = False
        #: What the guardian's own shutdown could not do; None before it has made one.
        self._walked: list[str] | None = None
        self._yielding: float | None = None
        self._process = subprocess.Popen(  # noqa: S603  our own interpreter, by systemd-run's own path
            [*scope.prefix, sys.executable, "-P", "-m", "bench.safety.guardian"],
            stdin=subprocess.PIPE,
            stdout=subprocess.PIPE,
            env={**os.environ, **scope.environment, "PYTHONPATH": str(Path(__file__).parents[3])},
            # Ctrl-C at the terminal is the run's to take, not the guardian's.
            start_new_session=True,
            pass_fds=lifelines,
        )
        self._send_line(charge.line())
        self._threads = [threading.Thread(target=work, daemon=True) for work in (self._listen, self._beat)]
        for thread in self._threads:
            thread.start()
        interrupts.listen(self._stop_requested)

    @property
    def pid(self) -> int:
        """The guardian's process."""
        return self._process.pid

    def hear(self, event: Event) -> None:
        """Take an event of the journal. Raises Interrupted where nothing may be energised any more."""
        self._life.stamp()
        if isinstance(event, Energising | Commanding):
            self._permit()
            self._anchor.begin()
        if self._unwinding and isinstance(event, _GOING_ON) and getattr(event, "call", "") not in STOPS:
            self._unwinding = False
            self._send({"handled": True})
        if (energised := self._calls.energised) != self._on:
            self._on = energised
            self._send({"on": sorted(energised)})
        match event:
            case DeEnergising():
                self._failing.add(event.instrument)
                self._unwinding = True
                self._send({"ending": event.instrument})
            case DeEnergised():
                # A block whose own end failed is still the guardian's to end.
                if event.error is None:
                    self._send({"ended": event.instrument})
            case InstrumentFailed():
                self._failing.add(event.instrument)
            case ReadingTaken() | SettingDone():
                self._failing.discard(event.instrument)
                if self._unanswered and self._unanswered[0] == event.instrument and not self._down:
                    # It answers again, but was switched off meanwhile: what is measured from here on is not what it seems.
                    self._interrupts.request(self._unanswered[2])

    def going_down(self) -> None:
        """Tell it that the run carries out the shutdown itself."""
        self._down = True
        self._send({"down": True})

    def dismiss(self, *, journal_lost: bool, unsafe: bool = False) -> Sequence[str]:
        """Dismiss it; if the journal is lost or the run could not switch everything off, it carries out the shutdown again.

        What it finds stands in its own record, and what it did in place of the run is returned.
        """
        if self._leaving:
            return ()
        self._leaving = True
        self._over.set()
        self._send({"done": True, "journal": not journal_lost, "unsafe": unsafe})
        with suppress(OSError, ValueError):
            self._stdin.close()
        # Its output ends with it: that is heard at once, where subprocess would look now and then.
        # One that is not ready yet leaves once it is.
        starting = 0.0 if self._ready else _START
        self._threads[0].join(0.0 if self._ended == _MUTE else starting + (_LEAVE_UNSAFE if unsafe else _LEAVE))
        try:
            self._process.wait(0.0 if self._threads[0].is_alive() else _REAP)
        except subprocess.TimeoutExpired:
            self._process.kill()
            self._process.wait()
            return [f"the guardian (process {self.pid}) did not leave and was ended"]
        finally:
            for thread in self._threads:
                thread.join()
            self._stdout.close()
        if not unsafe or self._walked is None:
            return ()
        if self._walked:
            return [f"the guardian could not either: {'; '.join(self._walked)}"]
        return [SWITCHED_OFF]

    def record_in(self, journal: Recorder) -> None:
        """Record the beginning of the guardian's own record in the journal."""
        self._anchor.record_in(journal)

    def about(self) -> GuardianStart | None:
        """Return what a run's record says of its guardian at the beginning."""
        return GuardianStart(self._charge.token, **self._scope.about())

    def record_end(self) -> GuardianEnd | None:
        """Return where the guardian's own record ends, as it said last."""
        return self._anchor.end()

    def _permit(self) -> None:
        """Return once the guardian is known to watch; raises Interrupted where it does not."""
        with self._news:
            if not self._news.wait_for(lambda: self._ready or self._ended, _START):
                raise Interrupted(text("the guardian, which was not ready after {time:g} s", time=_START))
        if not self._ended and monotonic() - self._echoed > self._charge.heartbeat:
            # This process may have been asleep, and the shutdown carried out meanwhile.
            number = self._send_beat()
            with self._news:
                self._news.wait_for(lambda: self._echo >= number or self._ended, _SILENCE)
                if self._echo < number and not self._ended:
                    self._ended = _MUTE
        if self._ended and not self._down:
            raise Interrupted(self._ended)

    def _listen(self) -> None:
        with suppress(OSError, ValueError):
            for line in self._stdout:
                self._take(decode(line))
        if not self._leaving:
            self._end(text("the guardian, which died"))

    def _take(self, message: Mapping[str, Any]) -> None:
        self._anchor.hear(message)
        with self._news:
            self._echoed = monotonic()
            self._echo = max(self._echo, message.get("echo", 0))
            self._ready = self._ready or "ready" in message
            self._news.notify_all()
        if "alarm" in message:
            self._end(message["alarm"])
        elif "took" in message and not self._leaving:
            self._taken = True
            self._forbid(text("the guardian, which carried out the shutdown: {cause}", cause=message["took"]))
            self._send({"awake": True})
            self._yielding = self._yielding or monotonic() + _YIELD
        elif "yours" in message:
            self._end("")
        elif "walked" in message:
            self._walked = list(message["walked"])

    def _beat(self) -> None:
        interval = self._charge.heartbeat / BEATS
        # Beats go on when the run is to end: it has the shutdown before it, which the guardian waits for.
        while not self._leaving:
            begun = monotonic()
            self._send_beat()
            for _ in range(_LOOKS):
                if self._over.wait(interval / _LOOKS):
                    return
                self._report_unanswered()
            now = monotonic()
            if now - begun > _SILENCE:
                # This process was asleep: the guardian gets its time to say what happened.
                self._echoed = now
            if self._taken and not self._down and self._interrupts.delays().get("started_after", 0.0) > _FUTILE:
                self._give_up()
            if self._yielding is not None and now >= self._yielding:
                self._end("")
            if self._ready and not self._ended and now - self._echoed > _SILENCE:
                self._end(_MUTE)

    def _give_up(self) -> None:
        """End a process that does not begin its shutdown although it was interrupted again and again; the guardian has switched off."""
        words = f"motorbench: the run did not begin its shutdown within {_FUTILE:g} s and is ended; its guardian has switched off\n"
        with suppress(OSError):
            os.write(2, words.encode())
        os._exit(1)

    def _report_unanswered(self) -> None:
        """Tell the guardian of an energised source that does not answer, once a call, and end a run that does not notice."""
        watch = self._calls.unanswered()
        if watch is None:
            return
        role, since = watch.role.value, watch.unanswered_since
        if not self._unanswered or self._unanswered[:2] != (role, since):
            words = text(
                "the {instrument}, which is energised and has not answered for {time:g} s",
                instrument=role,
                time=watch.reply_time,
            )
            self._unanswered = (role, since, words)
            self._send({"unanswered": str(words), "role": role})
        elif not self._down and role not in self._failing and monotonic() - since > watch.reply_time + _NOTICE:
            self._interrupts.request(self._unanswered[2])

    def _stop_requested(self, by: Text | str) -> None:
        self._send({"stop": str(by)})

    def _forbid(self, why: Text | str) -> None:
        """Have nothing energised any more."""
        with self._news:
            self._ended = self._ended or why
            self._news.notify_all()

    def _end(self, by: Text | str) -> None:
        """Interrupt the run, for the first reason that was given."""
        self._forbid(by)
        self._interrupts.request(self._ended)

    def _send_beat(self) -> int:
        self._sent += 1
        self._send({"beat": self._sent, "age": round(self._life.age(), 3)})
        return self._sent

    def _send(self, message: dict[str, Any]) -> None:
        self._send_line(encode(message))

    def _send_line(self, line: bytes) -> None:
        # A guardian that has died is heard of on the other pipe.
        with self._lock, suppress(OSError, ValueError):
            self._stdin.write(line)
            self._stdin.flush()

    @property
    def _stdin(self) -> IO[bytes]:
        stream = self._process.stdin
        assert stream is not None  # noqa: S101  asked for above
        return stream

    @property
    def _stdout(self) -> IO[bytes]:
        stream = self._process.stdout
        assert stream is not None  # noqa: S101  asked for above
        return stream
