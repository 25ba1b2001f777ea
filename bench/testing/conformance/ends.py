"""That everything is off where a block ends, however it ends, and whatever the instrument was found in."""

from contextlib import nullcontext, suppress
from typing import Any

from bench.testing.conformance.report import Checks
from bench.testing.conformance.session import Trial
from bench.testing.conformance.stand import Stand
from drivers.interfaces import InstrumentError

TAKE_OVER = "Bring the instrument into the state that is needed, whatever it was found in"
_SAFE = "Take the energy away in a finally clause, and confirm that it is"


class _InterruptionError(Exception):
    """What the block of a caller may raise."""


def check_ends(trial: Trial) -> None:
    """Check that a block ends with everything off, however it ends, and that what does not switch off is told."""
    session, checks, energise = trial.session, trial.checks, trial.session.energise
    with trial.opened() as (made, instrument):
        instrument.make_safe()
        checks.that("make_safe when off", not made.energised, "it is on", _SAFE)
        if energise is None:
            return
        for error in (None, _InterruptionError, KeyboardInterrupt):
            with suppress(_InterruptionError, KeyboardInterrupt), energise(made, instrument):
                checks.that("a block feeds energy", made.energised, "nothing is on", "Switch on in the block")
                if error is not None:
                    raise error
            how = "normally" if error is None else f"by {error.__name__.strip('_')}"
            checks.that(f"off where a block ends {how}", not made.energised, "it is on", _SAFE)
        with suppress(InstrumentError), energise(made, instrument):
            instrument.make_safe()
            checks.that("make_safe in a block", not made.energised, "it is on", _SAFE)
        guard = made.open(guarding=True, elsewhere=True)
        with suppress(InstrumentError), energise(made, instrument):
            guard.make_safe()
            checks.that("make_safe by a second connection", not made.energised, "it is on", "Ask nothing when guarding")
        guard.close()
    if session.stuck:
        with trial.opened() as (made, instrument):
            _stuck(made, instrument, energise, session.stuck, checks)


def _stuck(made: Stand, instrument: Any, energise: Any, output: str, checks: Checks) -> None:
    remedy = "Ask after switching off whether it is, and raise where it is not"
    with checks.refuses("off that does not take", InstrumentError, remedy=remedy), energise(made, instrument):
        made.world.damage.stick(output, "on")
    with checks.refuses("make_safe that does not take", InstrumentError, remedy=remedy):
        instrument.make_safe()
    made.world.damage.stick(output, None)
    instrument.make_safe()
    checks.that("off once it obeys again", not made.energised, "it is on", remedy)


def check_found(trial: Trial) -> None:
    """Check that one opened with its output on can be made safe at once, and used after that."""
    session, checks = trial.session, trial.checks
    with trial.stand() as made:
        session.prepare(made)
        first = made.open()
        left = session.energise(made, first) if session.energise is not None else nullcontext()
        left.__enter__()
        second = made.open(elsewhere=True)
        second.make_safe()
        checks.that("found on: make_safe", not made.energised, "it is on", _SAFE)
        wrong = trial.wrong(made, second)
        checks.that("found on: works after make_safe", not wrong, wrong, TAKE_OVER)
        second.close()
        with suppress(Exception):
            left.__exit__(None, None, None)
        first.close()
