"""Checks of a watchdog that the station requires: armed, read back, fed, disarmed at the end, and acting when it is not fed."""

from collections.abc import Set
from contextlib import suppress
from typing import Any

from bench.station.clock import SystemClock
from bench.testing.conformance.held_settings import held_settings
from bench.testing.conformance.played import lose
from bench.testing.conformance.session import Trial
from bench.testing.conformance.stand import OneInstrumentBench
from drivers.interfaces import InstrumentError, Watchdog
from sim_instruments.faults.line_faults import Fault, FaultKind, MessageWatch

#: How many of its times a use lasts in which it is fed, and after how many it has acted; after the last message it does not before so many.
_FED, _DEAD, _ALIVE = 2.5, 1.6, 0.85
#: How often in its time one looks whether it has acted.
_LOOKS = 50


def check_watchdog(trial: Trial, name: str, unwatched: Trial) -> None:
    """Check that only the user of the instrument arms the watchdog, and disarms it at the end.

    `unwatched` is the trial with the options beside it: what opening writes there arms nothing.
    A thorough trial waits some four of its times, of the wall's clock, to see that it acts.
    """
    asked, checks = trial.subject.options.watchdog, trial.checks
    with trial.stand(sockets=True) as made:
        trial.session.prepare(made)
        for _ in range(2):
            instrument: Any = made.open()
            armed = instrument.watchdog
            same = armed is not None and armed.time == asked.time
            remedy = "Arm what is asked for, and read it back"
            checks.that(f"{name}: armed", same, f"{armed}, asked for {asked}", remedy)
            guard: Any = made.open(guarding=True, elsewhere=True)
            checks.that(f"{name}: guarding arms nothing", guard.watchdog is None, f"{guard.watchdog}", "Leave it alone")
            guard.close()
            instrument.close()
            left = instrument.watchdog
            checks.that(f"{name}: close() ends the watch", left is None, f"{left}", "Put back what was set")
    _not_kept(trial, name)
    if unwatched.subject.options.watchdog is None:
        _as_found(trial, name, set(_writes(trial)) - set(_writes(unwatched)))
    if trial.thorough and trial.session.energise is not None:
        with trial.stand(sockets=True) as made:
            _acts(trial, made, name, asked)


def _messages(trial: Trial) -> list[str]:
    """Return the messages of opening and closing."""
    with trial.stand(sockets=True) as made:
        trial.session.prepare(made)
        made.listen()
        made.open().close()
        return [message for message, _ in made.messages]


def _writes(trial: Trial) -> list[str]:
    """Return the messages of opening and closing that write something."""
    return [message for message in dict.fromkeys(_messages(trial)) if message.startswith("write")]


def _as_found(trial: Trial, name: str, arming: Set[str]) -> None:
    """Check that what arms it is as it was found: after close(), and where a message is refused once it was written."""
    messages, kind = _messages(trial), FaultKind.EXCEPTION
    first = next((number for number, message in enumerate(messages, 1) if message in arming), len(messages))
    for number in (None, *range(first, len(messages) + 1)):
        with trial.stand(sockets=True) as made, held_settings(made, sorted(arming)) as held:
            trial.session.prepare(made)
            before = held()
            if number is not None:
                made.faults.add(Fault.at(FaultKind.REPLACE if made.transport == "can" else kind, number))
            opened = False
            with suppress(InstrumentError):
                instrument: Any = made.open()
                opened = True
                instrument.close()
            made.faults.clear()
            refused = "" if number is None else f", '{messages[number - 1]}' having been refused"
            what = f"{name}: as found {'after close()' if opened else 'where opening fails'}"
            # Where the very message that puts it back is refused, it stays.
            if number is None or not opened:
                wrong = f"{held()} instead of {before}{refused}"
                trial.checks.that(
                    what, held() == before, wrong, "Put back what was set, also before an error is raised"
                )


def _not_kept(trial: Trial, name: str) -> None:
    """Check that each setting which arms it is read back: where one is lost on its way, it is told, and nothing is armed."""
    remedy = "Read back what arms it, and put it back where it was not taken"
    for message in _writes(trial):
        with trial.stand(sockets=True) as made:
            trial.session.prepare(made)
            lose(made, message)
            with trial.checks.refuses(f"{name}: not taken", InstrumentError, remedy=f"{remedy} ({message})"):
                made.open().close()


def _acts(trial: Trial, made: OneInstrumentBench, name: str, asked: Watchdog) -> None:
    """Check that it does nothing while the instrument is used, and switches off once the line is cut."""
    checks, energise = trial.checks, trial.session.energise
    assert energise is not None  # noqa: S101  its caller has looked
    trial.session.prepare(made)
    instrument: Any = made.open()
    clock, last = SystemClock(), [0.0]

    def hears(*_: Any) -> bool:
        last.append(clock.now())
        return False

    made.faults.watch(MessageWatch(hears, lambda: None))
    with suppress(InstrumentError), energise(made, instrument):
        clock.sleep(_FED * asked.time)
        checks.that(f"{name}: fed", made.energised, f"it is off after {_FED:g} of its times", "Feed it in use")
        made.bench.connection(trial.subject.role.value).pull()
        cut = clock.now()
        while made.energised and clock.now() < cut + _DEAD * asked.time:
            clock.sleep(asked.time / _LOOKS)
        lived, early = clock.now() - last[-1], "Compare the unit and the step of its time with the manual"
        checks.that(f"{name}: acts not before", lived >= _ALIVE * asked.time, f"it is off after {lived:.3g} s", early)
        remedy = "Have it take the energy away, in time"
        checks.that(f"{name}: acts", not made.energised, f"it is on after {_DEAD:g} of its times", remedy)
        made.bench.connection(trial.subject.role.value).plug()
    with suppress(InstrumentError):
        instrument.close()
