"""Checks of opening over a disturbed line: an error or a correct result, and no resource kept if it did not open."""

import re
from collections.abc import Iterator, Sequence
from contextlib import suppress
from typing import Any

from bench.station.clock import SystemClock
from bench.testing.conformance.disturbed import LATE, LITTLE_LATE, WHAT, disturbances
from bench.testing.conformance.network_management import state_of
from bench.testing.conformance.played import play
from bench.testing.conformance.report import Checks, in_words
from bench.testing.conformance.session import Trial
from bench.testing.conformance.stand import OneInstrumentBench
from drivers.interfaces import InstrumentError
from sim_instruments.faults.line_faults import Fault, FaultKind, MessageWatch

#: How long (s, of the wall's clock) a reply takes on a real line: a serial adapter holds it back for some 16 ms.
_ON_ITS_WAY = 0.02
_TRIES = 3
_HELD = "Close the connection of what does not open"
_PUT_BACK = "Command at the end the state that the node told, not one that was only supposed"


def check_opening(trial: Trial) -> None:
    """Disturb each different message of opening, in two of the ways that its line can be, or in every way.

    Each question is also refused; and never answered, however often it is asked: each, or the last two.
    """
    messages, asked, transport = _heard(trial)
    with trial.stand() as undisturbed:
        left = state_of(undisturbed)
    different = {text: number for number, text in reversed(list(enumerate(messages, 1)))}
    for turn, (text, number) in enumerate(sorted(different.items(), key=lambda one: one[1])):
        kinds = disturbances(text, transport)
        many = len(kinds) if trial.thorough else 2
        for kind in sorted({kinds[(turn + step) % len(kinds)] for step in range(many if kinds else 0)}):
            with trial.stand() as made:
                made.faults.add(Fault.at(kind, number, delay=LATE))
                _opened(trial, made, f"{WHAT[kind]} when opening", text, left)
    with trial.stand() as made:
        made.faults.add(Fault(FaultKind.LATE, lambda count, _: count % 2 == 1, delay=LITTLE_LATE, times=None))
        right, remedy = _opened(trial, made, "a little late", "every other message", left), "Wait for the reply time"
        trial.checks.that("opening: replies that come a little late", right, "it does not open", remedy)
    _over_a_real_line(trial)
    questions = list(_questions(messages[:asked][::-1], transport))
    for text in questions if trial.thorough else questions[-2:]:
        _silent(trial, text)
    if transport != "serial":
        for text in questions:
            _refused(trial, text)


def _over_a_real_line(trial: Trial) -> None:
    """Check that it opens where every reply takes its time by the wall's clock, as on a real line.

    A busy machine may take longer once: one that waits too short never opens.
    """
    errors: list[str] = []
    while len(errors) < _TRIES and (error := _slowly(trial)):
        errors.append(error)
    remedy = f"Wait for a reply that is {_ON_ITS_WAY:g} s on its way"
    trial.checks.that("opening over a real line", len(errors) < _TRIES, " / ".join(errors), remedy)


def _slowly(trial: Trial) -> str:
    """Return the error of an opening over a real line, empty where there is none."""
    with trial.stand(sockets=True) as made:
        trial.session.prepare(made)

        def hears(*_: Any) -> bool:
            SystemClock().sleep(_ON_ITS_WAY)
            return False

        made.faults.watch(MessageWatch(hears, lambda: None))
        try:
            made.open().close()
        except InstrumentError as error:
            return f"{error}"
        return ""


def _heard(trial: Trial) -> tuple[list[str], int, str]:
    """Return the messages of opening and closing, how many of them open it, and what they go by."""
    with trial.stand() as made:
        trial.session.prepare(made)
        made.listen()
        instrument = made.open()
        asked = len(made.messages)
        instrument.close()
        return [text for text, _ in made.messages], asked, made.transport


def _questions(texts: Sequence[str], transport: str) -> Iterator[str]:
    for text in dict.fromkeys(texts):
        # A stream asks by words; what it sets is no question.
        asks = (
            "?" in text and "ERR" not in text if transport == "visa" else re.match(r"read|stream (?!.*\bset\b)", text)
        )
        if asks:
            yield text


def _opened(trial: Trial, made: OneInstrumentBench, what: str, text: str, left: str) -> bool:
    """Open with what disturbs it; return whether it opened. What did not is told, and opens once nothing disturbs it.

    A CANopen node that did is afterwards in the state in which it was `left`.
    """
    checks = trial.checks
    trial.session.prepare(made)
    before = made.connections
    try:
        instrument: Any = made.open()
    except InstrumentError as error:
        checks.that(f"{what}: is told", in_words(error.what), f"it says '{error.what}'", "Say what was wrong in words")
        held = made.connections - before
        checks.that(f"{what}: nothing is held", held <= 0, f"{held} connections are open after '{text}'", _HELD)
        made.faults.clear()
        instrument = _again(made)
        wrong = trial.wrong(made, instrument)
        checks.that(f"{what}: opened again, it works", not wrong, f"after '{text}': {wrong}", _HELD)
        instrument.close()
        return False
    made.faults.clear()
    during = Checks()
    try:
        trial.session.brief(made, instrument, during)
    except InstrumentError as error:
        checks.that(f"{what}: is told", in_words(error.what), f"it says '{error.what}'", "Say what was wrong in words")
    remedy = "Ask again, or refuse to open"
    checks.that(f"{what}: never becomes a value", not during.wrong, f"'{text}': {during.wrong}", remedy)
    instrument.close()
    wrong = f"after '{text}' it is {state_of(made)} instead of {left}"
    checks.that(f"{what}: the node's state is put back", state_of(made) == left, wrong, _PUT_BACK)
    return True


def _again(made: OneInstrumentBench) -> Any:
    """Open once more; an error that waits from the first time may be told before that."""
    with suppress(InstrumentError):
        return made.open()
    return made.open()


def _silent(trial: Trial, text: str) -> None:
    """Check a question that is never answered, however often it is asked: it is told, or done without."""
    with trial.stand() as made:
        trial.session.prepare(made)
        before = made.connections
        made.faults.add(Fault.on(FaultKind.SILENCE, f"^{re.escape(text.strip())}\\r?$", times=None))
        try:
            made.open().close()
        except InstrumentError as error:
            said, check = in_words(error.what), "no answer at all when opening: is told"
            trial.checks.that(check, said, f"'{text}': {error.what}", "Say what was wrong in words")
        except Exception as error:  # noqa: BLE001  whatever a driver raises is a finding
            finding, advice = f"{type(error).__name__} at '{text}': {error}", "Raise InstrumentError"
            trial.checks.that("no answer at all when opening: is told", False, finding, advice)
        held = made.connections - before
        trial.checks.that("no answer at all when opening: nothing is held", held <= 0, f"{held} after '{text}'", _HELD)


def _refused(trial: Trial, text: str) -> None:
    """Check a question that is refused: what others of the family have not is done without, and all else is told."""
    with trial.stand() as made:
        play(made, {f"^{re.escape(text.strip())}\\r?$": None})
        opened = _opened_so(trial, made, text)
    lacks = trial.checks.manual.lacks
    if lacks is None:
        return
    may = any(re.search(pattern, text) for pattern in lacks)
    wrong = f"'{text}' is refused, and it {'opens' if opened else 'does not open'}"
    trial.checks.that("what it may lack at opening", opened is may, wrong, "Compare with the family's other models")


def _opened_so(trial: Trial, made: OneInstrumentBench, text: str) -> bool:
    """Tell whether it opens where a question is refused for good."""
    trial.session.prepare(made)
    try:
        made.open().close()
    except InstrumentError as error:
        message = in_words(error.what)
        trial.checks.that("a refusal when opening: is told", message, f"'{text}': {error.what}", "Say it in words")
        return False
    return True
