"""Checks of settings left by the last user: reported, set as needed, kept, supervised, and restored on closing."""

import re
from collections.abc import Callable, Sequence
from contextlib import suppress
from typing import Any

from bench.testing.conformance.disturbed import WHAT, disturbances
from bench.testing.conformance.ends import TAKE_OVER
from bench.testing.conformance.manual import Left
from bench.testing.conformance.report import Checks, in_words
from bench.testing.conformance.session import Trial
from bench.testing.conformance.stand import OneInstrumentBench
from drivers.interfaces import InstrumentError, ReportedError
from drivers.interfaces.found_state import FoundSetting
from sim_instruments.faults.line_faults import Fault, FaultKind, MessageWatch

#: How many states are drawn from the simulated instrument's own table of what a last user may have left.
_DRAWN, _DRAWN_THOROUGHLY = 1, 4
_BACK = "Put back what was changed when it was opened"


def check_left(trial: Trial) -> None:
    """Check each setting that the manual names, and states drawn from the simulated instrument's table."""
    for left in trial.checks.manual.left:
        having = trial.having(**left.options)
        _taken_over(having, left)
        if left.wanted and left.error is None:
            _not_kept(having, left)
        if left.watched:
            _changed_meanwhile(having, left)
    if trial.thorough:
        _works_with(trial, [left for left in trial.checks.manual.left if _only_told(left) and not left.options])
    _refused_midway(trial, [left for left in trial.checks.manual.left if left.wanted and left.error is None])
    for seed in (None, *range(_DRAWN_THOROUGHLY if trial.thorough else _DRAWN)):
        _as_drawn(trial, seed)


def _named(left: Left) -> str:
    return f"left with {left.query} = {left.found}" if left.found else f"left with {left.query}"


def _taken_over(trial: Trial, left: Left) -> None:
    name, checks = _named(left), trial.checks
    with trial.stand() as made:
        trial.session.prepare(made)
        now = _left(made, left)
        before = now()
        made.open(guarding=True, elsewhere=True).close()
        checks.that(f"{name}: guarding changes nothing", now() == before, f"{now()}", "Leave it alone when guarding")
        if left.error is not None:
            with checks.refuses(f"{name}: refused", left.error, remedy="Ask when opening", says=(left.says,)):
                made.open().close()
            checks.that(f"{name}: left alone where refused", now() == before, f"{now()} instead of {before}", _BACK)
            return
        instrument = made.open()
        rows = [row for row in instrument.found_state if row.query.startswith(left.query)]
        checks.that(
            f"{name}: told", not left.told or len(rows) == 1, f"{len(rows)} rows tell it", "Give it in found_state"
        )
        for row in rows if left.told else ():
            _row(checks, name, row, left)
        if not left.wanted:
            checks.that(f"{name}: only told", now() == before, f"{now()} instead of {before}", "Leave it alone")
        else:
            checks.that(f"{name}: set", now() != before, f"it stays {before}", TAKE_OVER)
        if not left.alters:
            # What is only told may be a scale.
            wrong = trial.wrong(made, instrument)
            checks.that(f"{name}: it works", not wrong, wrong, TAKE_OVER)
        instrument.close()
        checks.that(f"{name}: put back", now() == before, f"{now()} instead of {before}", _BACK)


def _only_told(left: Left) -> bool:
    """Tell whether a setting is told, and changes neither what the driver does nor what is measured."""
    return not left.wanted and left.error is None and not left.alters


def _works_with(trial: Trial, rows: Sequence[Left]) -> None:
    """Check the full use beside everything that is only told."""
    if not rows:
        return
    with trial.stand() as made:
        trial.session.prepare(made)
        _all_left(made, rows)
        instrument = made.open()
        wrong = trial.wrong(made, instrument, full=True)
        trial.checks.that("left with what is only told: it works", not wrong, wrong, TAKE_OVER)
        instrument.close()


def _row(checks: Checks, name: str, row: FoundSetting, left: Left) -> None:
    remedy = "Tell what was found, what is needed, whether it was changed, and what another value does"
    checks.that(f"{name}: as found", row.found == left.found, f"it says {row.found}", remedy)
    right = row.changed if row.wanted == left.wanted != "" else row.wanted in ("", row.found) and not row.changed
    checks.that(f"{name}: as needed", right, f"'{row.wanted}', {'' if row.changed else 'not '}changed", remedy)
    checks.that(f"{name}: its effect", in_words(row.effect), f"{row.effect}", remedy)


def _not_kept(trial: Trial, left: Left) -> None:
    """Check that a setting which does not stay as it was set is told, with nothing held."""
    with trial.stand() as made:
        trial.session.prepare(made)
        now = _left(made, left)
        before, connections = now(), made.connections
        if made.transport == "visa":
            made.answer({f"^{left.query.split('?')[0]} ": b""})
        else:
            _keep_so(made, left)
        remedy = "Read back what was set, and raise ReportedError where it is another"
        with trial.checks.refuses(f"{_named(left)}, and kept so", ReportedError, remedy=remedy):
            made.open().close()
        held = made.connections - connections
        trial.checks.that("nothing is held of what is refused", held <= 0, f"{held} are open", "Close the connection")
        trial.checks.that(f"{_named(left)}: as before", now() == before, f"{now()} instead of {before}", _BACK)


def _refused_midway(trial: Trial, rows: Sequence[Left]) -> None:
    """Check that what was set is put back where opening fails after that: a message of it is refused, or not answered."""
    rows = [left for left in rows if not left.options]
    if not rows:
        return
    with trial.stand() as made:
        trial.session.prepare(made)
        _all_left(made, rows)
        made.listen()
        instrument = made.open()
        different: dict[str, int] = {}
        for number, (text, _) in enumerate(made.messages, 1):
            different.setdefault(text, number)
        transport = made.transport
        instrument.close()
    kind = {"modbus": FaultKind.EXCEPTION, "can": FaultKind.REPLACE}.get(transport, FaultKind.SILENCE)
    disturbed = [text for text in different if kind in disturbances(text, transport)]
    for text in disturbed if trial.thorough else disturbed[-2:]:
        with trial.stand() as made:
            trial.session.prepare(made)
            nows = _all_left(made, rows)
            before = [now() for now in nows]
            # What is asked again after silence stays silent; a line that refuses goes on.
            again = Fault.on(kind, f"^{re.escape(text)}$", times=None)
            made.faults.add(again if kind is FaultKind.SILENCE else Fault.at(kind, different[text]))
            with suppress(InstrumentError):
                made.open().close()
            made.faults.clear()
            after = [now() for now in nows]
        wrong = [
            f"{left.query} is {new} instead of {old}"
            for left, new, old in zip(rows, after, before, strict=True)
            if new != old
        ]
        what = f"{WHAT[kind]} after '{text}' of opening: {', '.join(wrong)}"
        trial.checks.that("put back where opening fails", not wrong, what, _BACK)


def _all_left(made: OneInstrumentBench, rows: Sequence[Left]) -> list[Callable[[], Any]]:
    """Leave every setting so; return what asks for each."""
    return [_left(made, left) for left in rows]


def _changed_meanwhile(trial: Trial, left: Left) -> None:
    with trial.opened() as (made, instrument):
        trial.session.brief(made, instrument, Checks())
        _left(made, left)
        remedy = "Look at it again before each use that rests on it"
        with trial.checks.refuses(f"{_named(left)} during use", ReportedError, remedy=remedy):
            trial.session.brief(made, instrument, Checks())
            trial.session.full(made, instrument, Checks())


def _as_drawn(trial: Trial, seed: int | None) -> None:
    """Check one state: as it is found, or as a seed draws it from the simulated instrument's table."""
    name = "as found" if seed is None else f"as a last user may leave it ({seed})"
    checks, during = trial.checks, Checks()
    with trial.stand(hostile=seed) as made:
        trial.session.prepare(made)
        try:
            instrument: Any = made.open()
        except InstrumentError as error:
            told = seed is not None and in_words(error.what)
            checks.that(f"{name}: is told", told, f"{error}", "Take over what may be set, and tell what may not")
            return
        rows = instrument.found_state
        for row in rows:
            right = row.changed is (row.wanted not in ("", row.found))
            wrong = f"{row.query}: {row.found}, wanted is '{row.wanted}', {'' if row.changed else 'not '}changed"
            checks.that(f"{name}: changed is what was another", right, wrong, "Tell what was changed, and no more")
        changed = [row for row in rows if row.changed and made.transport == "visa"]
        for row in changed:
            now = asked(made, row.query)
            right = row.wanted in now or row.found not in now
            checks.that(f"{name}: {row.query} is set", right, f"it is {now}", TAKE_OVER)
        try:
            trial.session.brief(made, instrument, during)
        except InstrumentError as error:
            told = seed is not None and in_words(error.what)
            checks.that(f"{name}: is told", told, f"{error}", "Take over what may be set, and tell what may not")
        checks.that(f"{name}: never becomes a value", not during.wrong, during.wrong, TAKE_OVER)
        instrument.close()
        for row in changed:
            back = asked(made, row.query)
            checks.that(f"{name}: {row.query} is put back", row.found in back, f"{back} instead of {row.found}", _BACK)


def _left(made: OneInstrumentBench, left: Left) -> Callable[[], Any]:
    """Leave a setting so, and return what asks for it as it is at present."""
    if isinstance(left.leave, str):
        for message in (*left.leave.split(";;"), "*CLS"):
            made.simulated.write(message.encode() + b"\n")
    else:
        left.leave(made.simulated)
    if left.now is not None:
        now = left.now
        return lambda: now(made.simulated)
    return lambda: asked(made, left.query)


def _keep_so(made: OneInstrumentBench, left: Left) -> None:
    """Have a setting be as it was left again before each message."""

    def again(*_: Any) -> bool:
        if not isinstance(left.leave, str):
            left.leave(made.simulated)
        return False

    made.faults.watch(MessageWatch(again, lambda: None))


def asked(made: OneInstrumentBench, query: str) -> str:
    """Return what the simulated instrument answers to a query."""
    made.simulated.write(query.encode() + b"\n")
    return bytes(made.simulated.read(200, 1.0)[0]).decode("latin-1").strip()
