"""Checks of replies described in the manual: the call that receives one reports it, and waits for one that means "not yet"."""

import math
import re
import sys
from collections.abc import Callable, Iterator, Sequence
from contextlib import contextmanager, suppress
from typing import Any

from bench.testing.conformance.manual import NotYet, Reply
from bench.testing.conformance.played import put
from bench.testing.conformance.report import Checks, same_value
from bench.testing.conformance.session import Trial
from bench.testing.conformance.stand import OneInstrumentBench
from drivers.interfaces import InstrumentError
from sim_instruments.faults.line_faults import Fault, FaultKind

#: How often one is asked before what was not yet is so.
_LOOKS = 2
#: How far (relative, s) a driver's patience may be from the stated one.
_PATIENCE, _LOOK = 0.15, 0.15
#: What no message is.
_NONE = Reply("(?!)", None)


class _NotReportedError(Exception):
    """A call returned although it met the reply."""


class _Calls:
    """Stands before an instrument, counts the calls of its methods, and raises where one that met the reply returns."""

    def __init__(self, line: "_Line") -> None:
        self.line = line
        self.instrument: Any = None

    def __getattr__(self, name: str) -> Any:
        value = getattr(self.instrument, name)
        return (lambda *given, **named: self.call(name, value, *given, **named)) if callable(value) else value

    def call(self, name: str, act: Callable[..., Any], *given: Any, **named: Any) -> Any:
        """Call something; raises _NotReportedError where it returns nevertheless."""
        self.line.begin(name)
        struck, began = self.line.struck, self.line.now
        result = act(*given, **named)
        self.line.took.setdefault(name, []).append(self.line.now - began)
        if self.line.struck > struck and self.line.must_tell:
            self.line.returned(name, result)
        return self._block(name, result) if hasattr(result, "__enter__") else result

    @contextmanager
    def _block(self, name: str, block: Any) -> Iterator[Any]:
        inner = self.call(f"{name} begins", block.__enter__)
        try:
            yield inner
        except BaseException as error:
            if not block.__exit__(type(error), error, error.__traceback__):
                raise
        else:
            self.call(f"{name} ends", block.__exit__, None, None, None)


class _Line:
    """Replaces one reply's messages from the `begins`-th call on; calls are counted from 0, which is opening."""

    def __init__(
        self, made: OneInstrumentBench, reply: Reply | NotYet, begins: int | None, *, looks: int | None = None
    ) -> None:
        self._made, self._reply, self._begins, self._looks = made, reply, begins, looks
        self._pattern = re.compile(reply.message)
        self._fault = Fault(FaultKind.REPLACE, self._strikes, times=None)
        self._transport, self._row = made.transport, 0
        self._after = re.compile(reply.after if isinstance(reply, Reply) else "")
        self._beside = reply.beside if isinstance(reply, Reply) else {}
        self._between = re.compile(reply.between if isinstance(reply, NotYet) else "ERR")
        self._wanted = self._open = False
        self.number, self.struck, self.must_tell = -1, 0, begins is not None and looks is None
        #: The calls that have such messages, by their number; how long (s) each lasted, by its name.
        self.met: dict[int, str] = {}
        self.took: dict[str, list[float]] = {}
        #: When (s) the reply came first, and the times (s) of the row of messages that lasted longest.
        self.came = math.inf
        self.read = False
        self.longest, self._since, self._name = 0.0, 0.0, ""
        made.faults.add(self._fault)

    @property
    def now(self) -> float:
        """The bench time (s)."""
        return self._made.bench.clock.now()

    def begin(self, name: str) -> None:
        """Begin the next call."""
        self.number, self._name = self.number + 1, name
        self._wanted = self._reply.call in ("", name, name.partition(" ")[0])
        self._open = self._wanted and not self._after.pattern

    def returned(self, name: str, result: Any) -> None:
        """Raise where a call that met the reply returns, or returns another value than that of the reply."""
        reads = self._reply.reads if isinstance(self._reply, Reply) else {}
        if not reads:
            raise _NotReportedError(name)
        if result is None:
            return
        self.read = True
        for what, value in reads.items():
            found = result
            for part in what.split(".") if what else ():
                found = found[int(part)] if part.isdigit() else getattr(found, part)
            if not same_value(found, value):
                raise _NotReportedError(f"{name}: {what} is {found} instead of {value}")

    def _strikes(self, _: int, message: str) -> bool:
        if (
            self._wanted
            and self.struck
            and any(self._put(message, data) for pattern, data in self._beside.items() if re.search(pattern, message))
        ):
            return True
        if self._pattern.search(message) is None or not self._open:
            self._open = self._open or (self._wanted and self._after.search(message) is not None)
            # What asks for errors in between, or commands it again, is no other matter.
            self._row = self._row if self._between.search(message) else 0
            return False
        now = self.now
        self.met.setdefault(self.number, self._name)
        self._since = now if self._row == 0 else self._since
        self._row += 1
        self.longest = max(self.longest, now - self._since)
        if self._begins is None or self.number < self._begins:
            return False
        if self._looks is not None and self._row > self._looks:
            return False
        if isinstance(self._reply, Reply) and self.struck >= self._reply.times:
            return False
        if isinstance(self._reply, NotYet) and now - self._since > 10.0 * self._reply.patience + 10.0:
            return False
        self.struck += 1
        self.came = min(self.came, now)
        return self._put(message, self._reply.data)

    def _put(self, message: str, data: bytes | None) -> bool:
        self._fault.kind = FaultKind.SILENCE
        if data is not None:
            put(self._fault, self._transport, message, data)
        return True


def check_replies(trial: Trial) -> None:
    """Check each reply that the manual speaks of, in each call that may meet it, and how long calls last."""
    checks = trial.checks
    if checks.manual.takes:
        with trial.stand() as made:
            line = _Line(made, _NONE, None)
            _use(trial, made, line)
        for name, (least, most) in checks.manual.takes.items():
            took = line.took.get(name, ())
            right = bool(took) and all(least <= one <= most for one in took)
            remedy = "Compare its waits with the manual"
            checks.that(f"{name}() lasts {least:g} s to {most:g} s", right, f"{took} s", remedy)
    for reply in checks.manual.replies:
        name = f"{_shown(reply.data)} to {reply.message}"
        if reply.error is None and not reply.reads:
            _goes_on(trial, reply, f"{name} is no error")
            continue
        for number, call in _calls(trial, reply, name):
            if call != "make_safe" or not reply.reads:
                _met(trial, reply, number, f"{name}: {call}", reply.error)
    for waited in checks.manual.not_yet:
        name = f"not yet: {waited.message}"
        _goes_on(trial, waited, f"{name} is waited for")
        longest = [_met(trial, waited, number, f"{name} for good", None) for number, _ in _calls(trial, waited, name)]
        if longest and not math.isnan(waited.patience):
            allowed, remedy = _PATIENCE * waited.patience + _LOOK, "Count from the first look, in s"
            checks.close(f"{name}: patience (s)", max(longest), waited.patience, allowed, remedy)


def _calls(trial: Trial, reply: Reply | NotYet, name: str) -> Sequence[tuple[int, str]]:
    """Return the first of each method's calls that may meet a reply."""
    with trial.stand() as made:
        line = _Line(made, reply, None)
        _use(trial, made, line)
    first = {call: number for number, call in reversed(line.met.items())}
    met = [(number, call) for call, number in first.items()]
    trial.checks.that(f"{name}: there are such messages", bool(met), "none is sent", "Compare it with the messages")
    return met


def _use(trial: Trial, made: OneInstrumentBench, line: _Line, checks: Checks | None = None) -> None:
    calls = _Calls(line)
    trial.session.prepare(made)
    calls.instrument = calls.call("open", made.open)
    try:
        trial.session.brief(made, calls, checks or Checks())
        calls.make_safe()
    finally:
        calls.instrument.close()


def _goes_on(trial: Trial, reply: Reply | NotYet, what: str) -> None:
    """Check that the reply, as long as it comes, is no error."""
    during = Checks()
    with trial.stand() as made:
        try:
            line = _Line(made, reply, 0, looks=_LOOKS if isinstance(reply, NotYet) else sys.maxsize)
            _use(trial, made, line, during)
            during.that("it comes", line.struck > 0, "no such message is sent", "Compare it with the messages")
            took = max((line.took[call][-1] for call in line.met.values()), default=0.0)
            within = reply.within if isinstance(reply, Reply) else math.inf
            during.that("in time", took <= within, f"{took:.3g} s", f"Go on within {within:g} s")
        except InstrumentError as error:
            during.that("no error", False, f"{error}", "It is a proper reply")
    trial.checks.that(what, not during.wrong, during.wrong, "Go on")


def _met(trial: Trial, reply: Reply | NotYet, number: int, what: str, error: type[InstrumentError] | None) -> float:
    """Check that the reply, from a call on, is told, or read; return how long (s) the same question was asked at most."""
    remedy = "Look at every reply, and raise where it is not what the manual announces"
    with trial.stand() as made:
        line = _Line(made, reply, number)
        line.must_tell = isinstance(reply, Reply)
        if isinstance(reply, Reply) and reply.reads:
            try:
                # What comes after it is no matter.
                with suppress(InstrumentError):
                    _use(trial, made, line)
            except _NotReportedError as wrong:
                trial.checks.that(what, False, f"{wrong}", "Compare scale, sign and unit with the manual")
            trial.checks.that(what, line.read, "no value is returned", "It is a proper reply")
        elif isinstance(reply, NotYet) and not reply.told:
            _use(trial, made, line)
        else:
            says, within = (reply.says, reply.within) if isinstance(reply, Reply) else ("", math.inf)
            with trial.checks.refuses(what, error or InstrumentError, remedy=remedy, says=(says,)):
                try:
                    _use(trial, made, line)
                except InstrumentError:
                    late = line.now - line.came
                    advice = f"Tell it within {within:g} s"
                    trial.checks.that(f"{what}: in time", late <= within, f"{late:.3g} s", advice)
                    raise
    return line.longest


def _shown(data: bytes | None) -> str:
    if data is None:
        return "silence"
    return f"'{data.decode('latin-1') if data.isascii() else data.hex(' ')}'"
