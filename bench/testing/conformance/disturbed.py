"""Checks with messages disturbed one by one: every error is reported, nothing stays on, and the next use is correct."""

from collections.abc import Callable, Iterator, Sequence
from contextlib import suppress
from dataclasses import dataclass
from functools import partial
from typing import Any

from bench.testing.conformance.manual import ProtectionTrip
from bench.testing.conformance.network_management import taken_out
from bench.testing.conformance.played import lose
from bench.testing.conformance.report import Checks, in_words
from bench.testing.conformance.session import Energise, Trial
from bench.testing.conformance.stand import OneInstrumentBench
from drivers.interfaces import InstrumentError, ReportedError
from sim_instruments.faults.line_faults import Fault, FaultKind, MessageWatch

#: A delay (s) beyond every time-out: the reply comes when another one is waited for; and one that is no fault.
LATE, LITTLE_LATE = 30.0, 0.05
WHAT = {
    FaultKind.SILENCE: "silence",
    FaultKind.HALF: "half a reply",
    FaultKind.GARBAGE: "garbage",
    FaultKind.LATE: "a late reply",
    FaultKind.NOT_A_NUMBER: "NaN",
    FaultKind.OVERFLOW: "overrange",
    FaultKind.EXCEPTION: "an exception",
    FaultKind.WRONG_UNIT: "another unit's reply",
    FaultKind.REPLACE: "a refusal",
}
_KINDS: dict[str, tuple[FaultKind, ...]] = {
    "visa": (FaultKind.SILENCE, FaultKind.HALF, FaultKind.LATE, FaultKind.NOT_A_NUMBER, FaultKind.OVERFLOW),
    "modbus": (FaultKind.SILENCE, FaultKind.HALF, FaultKind.EXCEPTION, FaultKind.WRONG_UNIT),
    "serial": (FaultKind.SILENCE, FaultKind.HALF, FaultKind.GARBAGE, FaultKind.NOT_A_NUMBER),
    "can": (FaultKind.SILENCE, FaultKind.HALF, FaultKind.REPLACE),
    "can-fd": (FaultKind.SILENCE, FaultKind.HALF, FaultKind.NOT_A_NUMBER),
}
_NO_READING = (FaultKind.NOT_A_NUMBER, FaultKind.OVERFLOW)


@dataclass(frozen=True)
class _Message:
    """A message of the undisturbed use: the how-manieth it is, its text, and whether something was energised then."""

    number: int
    text: str
    energised: bool


def disturb(trial: Trial) -> None:
    """Disturb each different message of a use, and once disconnect the line permanently.

    Each message is disturbed in two of the ways that its line can be, in turn; where the trial is thorough, in every way.
    """
    messages, took, transport = _heard(trial)
    for turn, message in enumerate(messages):
        kinds = disturbances(message.text, transport)
        many = len(kinds) if trial.thorough else 2
        for kind in sorted({kinds[(turn + step) % len(kinds)] for step in range(many if kinds else 0)}):
            _disturbed(trial, message, kind, took)
    with trial.opened() as (made, instrument):
        made.faults.add(Fault(FaultKind.LATE, lambda count, _: count % 2 == 1, delay=LITTLE_LATE, times=None))
        wrong = trial.wrong(made, instrument, safe=True)
    trial.checks.that("replies that come a little late", not wrong, wrong, "Wait for the reply time")
    fed = [one for one in messages if one.energised]
    for message in fed[: 3 if trial.thorough else 1]:
        _cut(trial, message)
        if transport.startswith("can"):
            _bus_down(trial, message)
    if trial.session.energise is not None:
        _unanswered(trial, trial.session.energise)


def check_trip(trial: Trial) -> None:
    """Check an internal fault of the instrument, if the manual states one, at each message up to the first that feeds energy.

    And what somebody else does to it while it feeds: what the manual states, and to a CANopen node another master.
    """
    manual = trial.checks.manual
    messages, took, transport = _heard(trial)
    fed = [one for one in messages if one.energised]
    if manual.trip is not None:
        for message in [*(one for one in messages if fed and one.number < fed[0].number), *fed[:1]]:
            _tripped(trial, manual.trip, message, took)
    if manual.stopped is not None:
        stopped = manual.stopped
        _stopped(trial, "stopped by somebody else", lambda _: stopped, fed)
    if transport == "can" and fed:
        _stopped(trial, "taken out of operation by another master (NMT)", taken_out, fed)


def _heard(trial: Trial) -> tuple[list[_Message], float, str]:
    """Return the different messages of a use that nothing disturbs, how long (s) it takes, and what they go by."""
    with trial.opened(listening=True) as (made, instrument):
        made.messages.clear()
        began = made.bench.clock.now()
        trial.brief(made, instrument)
        took = made.bench.clock.now() - began
        return list(_different(made.messages)), took, made.transport


def _different(messages: Sequence[tuple[str, bool]]) -> Iterator[_Message]:
    seen: set[tuple[str, bool]] = set()
    for number, (text, energised) in enumerate(messages, 1):
        if (text, energised) not in seen:
            seen.add((text, energised))
            yield _Message(number, text, energised)


def disturbances(text: str, transport: str) -> list[FaultKind]:
    """Return the ways in which a message can be disturbed."""
    return [kind for kind in _KINDS[transport] if _strikes(kind, text, transport)]


def _strikes(kind: FaultKind, text: str, transport: str) -> bool:
    if transport == "visa":
        if "?" not in text:
            return False
        return kind not in _NO_READING or not ("DATA" in text.upper() or "ERR" in text.upper())
    return True


def _disturbed(trial: Trial, message: _Message, kind: FaultKind, took: float) -> None:
    what, checks = WHAT[kind], trial.checks
    with trial.opened() as (made, instrument):
        made.faults.add(Fault.at(kind, message.number, delay=LATE))
        if kind is FaultKind.SILENCE and message.text.startswith("write") and made.transport == "modbus":
            lose(made, message.text, message.number)
        began = made.bench.clock.now()
        # What the instrument itself refuses is not sent again by itself: it was told, and whoever hears it makes safe.
        one_use(trial, made, instrument, what, message.text, refusal=kind in (FaultKind.EXCEPTION, FaultKind.REPLACE))
        passed = made.bench.clock.now() - began
        right, advice = passed <= took + trial.session.longest, "Wait no longer than the reply time"
        checks.that(f"{what}: in time", right, f"{passed:.3g} s instead of {took:.3g} s ('{message.text}')", advice)
        made.faults.clear()
        wrong = trial.wrong(made, instrument, safe=True)
        remedy = "Throw away what may still come before the next exchange"
        checks.that(f"{what}: the next exchange is in step", not wrong, f"after '{message.text}': {wrong}", remedy)


def one_use(
    trial: Trial, made: OneInstrumentBench, instrument: Any, what: str, text: str, *, refusal: bool = False
) -> None:
    """Check that a brief use ends with right values or an InstrumentError, with nothing left on.

    `what` becomes of the message `text`. After a `refusal` that was told, what stays on is for whoever hears it.
    """
    during, told, checks = Checks(), False, trial.checks
    try:
        trial.session.brief(made, instrument, during)
        instrument.make_safe()
    except InstrumentError as error:
        told = True
        checks.that(f"{what}: is told", in_words(error.what), f"it says '{error.what}'", "Say what was wrong in words")
    except Exception as error:  # noqa: BLE001  whatever a driver raises is a finding
        finding = f"{type(error).__name__} at '{text}': {error}"
        checks.that(f"{what}: is told", False, finding, "Raise InstrumentError where the instrument is at fault")
    wrong = during.wrong
    remedy = "Refuse a reply that is not whole, no number, or beyond the range"
    checks.that(f"{what}: never becomes a value", not wrong, f"'{text}': {wrong}", remedy)
    remedy = "Switch off in a finally clause, and send it again where the first time failed"
    off = (told and refusal) or not made.energised
    checks.that(f"{what}: nothing stays on", off, f"it is on after '{text}'", remedy)


def _cut(trial: Trial, message: _Message) -> None:
    """Check a cable that comes out at a message: it is told, and once it is back make_safe takes the energy away."""
    with trial.opened() as (made, instrument):
        cable = made.bench.connection(trial.subject.role.value)
        made.faults.watch(MessageWatch.at(message.number, cable.pull))
        with trial.checks.refuses("a line that is cut", InstrumentError, remedy="Raise CommunicationError"):
            trial.brief(made, instrument)
        cable.plug()
        with suppress(ReportedError):
            # What it says of the message that was cut.
            instrument.make_safe()
        off, remedy = not made.energised, "Renew the connection"
        trial.checks.that("make_safe once the line is mended", off, "it is on", remedy)


def _bus_down(trial: Trial, message: _Message) -> None:
    """Check a CAN bus that goes down at a message: it is told, and nothing stays on."""
    with trial.opened() as (made, instrument):
        made.faults.watch(MessageWatch.at(message.number, made.take_bus_down))
        with trial.checks.refuses("a bus that goes down", InstrumentError, remedy="Raise CommunicationError"):
            trial.brief(made, instrument)
        with suppress(ReportedError):
            instrument.make_safe()
        off, remedy = not made.energised, "Open the bus anew to switch off"
        trial.checks.that("a bus that goes down: nothing stays on", off, f"it is on after '{message.text}'", remedy)


def _unanswered(trial: Trial, energise: Energise) -> None:
    """Check that make_safe takes the energy away where no question is answered."""
    with trial.opened() as (made, instrument), suppress(InstrumentError), energise(made, instrument):
        made.faults.add(Fault(FaultKind.SILENCE, lambda _, text: "?" in text or text.startswith("read"), times=None))
        with suppress(InstrumentError):
            instrument.make_safe()
        off, remedy = not made.energised, "Send what takes the energy away before anything is asked"
        trial.checks.that("make_safe where no question is answered", off, "it is on", remedy)


def _stopped(
    trial: Trial, what: str, done: Callable[[OneInstrumentBench], ProtectionTrip], fed: Sequence[_Message]
) -> None:
    """Check that what somebody else did is told as what it is, at one of the messages at least, and does not last."""
    told, checks = list[str](), trial.checks
    for message in fed:
        with trial.opened() as (made, instrument):
            stopped = done(made)
            made.faults.watch(MessageWatch.at(message.number, partial(stopped.make, made.simulated)))
            try:
                trial.brief(made, instrument)
            except InstrumentError as error:
                told.append(f"{error}")
            with suppress(InstrumentError):
                instrument.make_safe()
            wrong = trial.wrong(made, instrument)
            right = bool(wrong) is not stopped.resets
            checks.that(f"{what}: afterwards", right, wrong or "it is gone", f"Begin anew (after '{message.text}')")
    remedy = "Look at the state with each reading while it feeds, and tell what is found"
    checks.that(f"{what}: is told", any(stopped.says in one for one in told), f"it is told: {told}", remedy)


def _tripped(trial: Trial, trip: ProtectionTrip, message: _Message, took: float) -> None:
    """Check a fault of the instrument's own at a message: it is told as what it is, and does not stay where it can be reset."""
    what, remedy = f"a fault of its own at '{message.text}'", "Look at the instrument's state wherever it is waited for"
    with trial.opened() as (made, instrument):
        made.faults.watch(MessageWatch.at(message.number, lambda: trip.make(made.simulated)))
        began = made.bench.clock.now()
        with trial.checks.refuses(what, ReportedError, remedy=remedy, says=(trip.says,)):
            trial.brief(made, instrument)
        late = made.bench.clock.now() - began - took
        trial.checks.that(f"{what}: in time", late <= trip.within, f"{late:.3g} s too late", remedy)
        with suppress(ReportedError):
            instrument.make_safe()
        wrong = trial.wrong(made, instrument)
        advice = "Reset it in make_safe"
        trial.checks.that(f"{what}: afterwards", bool(wrong) is not trip.resets, wrong or "it is gone", advice)
