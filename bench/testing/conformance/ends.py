"""Checks that everything is off when a block ends, however it ends and whatever state the instrument was found in."""

import math
from contextlib import nullcontext, suppress
from typing import Any

from bench.testing.conformance.report import Checks
from bench.testing.conformance.session import Energise, Trial
from bench.testing.conformance.stand import OneInstrumentBench
from drivers.interfaces import Clock, InstrumentError
from sim_instruments.faults.line_faults import MessageWatch

TAKE_OVER = "Bring the instrument into the state that is needed, whatever it was found in"
#: How many of a use's waits are interrupted.
_WAITS = 4
#: At how many of the messages that switch off.
_MESSAGES = 3
_SAFE = "Take the energy away in a finally clause, and confirm that it is"


class _InterruptionError(Exception):
    """An exception of the caller's own, raised inside a driver's block."""


class _Clock:
    """A clock at which somebody presses Ctrl-C while a driver waits for the `strikes`-th time, the `slept`-th being the last."""

    def __init__(self, clock: Clock) -> None:
        self._clock, self.slept, self.strikes = clock, 0, math.inf
        self.now = clock.now

    def sleep(self, seconds: float) -> None:
        """Wait for a time (s), or for half of it."""
        self.slept += 1
        self._clock.sleep(seconds if self.slept != self.strikes else 0.5 * seconds)
        if self.slept == self.strikes:
            raise KeyboardInterrupt


def _interrupted(trial: Trial, turn: float) -> int:
    """Check that Ctrl-C while a driver waits for the `turn`-th time leaves nothing on; return how often it waits."""
    with trial.stand() as made:
        trial.session.prepare(made)
        made.clock = clock = _Clock(made.bench.clock)
        instrument = made.open()
        clock.slept, clock.strikes = 0, turn
        with suppress(KeyboardInterrupt, InstrumentError):
            trial.session.brief(made, instrument, Checks())
        trial.checks.that("off after Ctrl-C while it waits", not made.energised, "it is on", _SAFE)
        instrument.close()
        return clock.slept


def _interrupted_off(trial: Trial, energise: Energise) -> None:
    """Check that Ctrl-C at one of the first messages that switch off, which is lost by it, leaves nothing on."""
    for turn in range(1, _MESSAGES + 1):
        pressed: list[int] = []

        def press(turn: int = turn, pressed: list[int] = pressed) -> None:
            pressed.append(turn)
            raise KeyboardInterrupt

        gone_on = False
        with trial.opened() as (made, instrument):
            try:
                with energise(made, instrument):
                    made.faults.watch(MessageWatch.at(turn, press))
            except KeyboardInterrupt:
                gone_on = True
            except InstrumentError as error:
                trial.checks.that("off after Ctrl-C while it switches off", False, f"{error}", _SAFE)
            trial.checks.that("off after Ctrl-C while it switches off", not made.energised, "it is on", _SAFE)
        right, remedy = gone_on or not pressed, "Raise it again once the energy is taken away"
        trial.checks.that("Ctrl-C while it switches off goes on", right, "it is lost", remedy)


def check_ends(trial: Trial) -> None:
    """Check that a block ends with everything off, however it ends, and that an output that stays on is reported."""
    session, checks, energise = trial.session, trial.checks, trial.session.energise
    waits = _interrupted(trial, math.inf) if trial.subject.role.feeds else 0
    for turn in range(1, waits + 1, max(1, waits // _WAITS)):
        _interrupted(trial, turn)
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
    _interrupted_off(trial, energise)
    if session.stuck:
        with trial.opened() as (made, instrument):
            _stuck(made, instrument, energise, session.stuck, checks)


def _stuck(made: OneInstrumentBench, instrument: Any, energise: Any, output: str, checks: Checks) -> None:
    remedy = "Ask after switching off whether it is, and raise where it is not"
    with checks.refuses("off that does not take", InstrumentError, remedy=remedy), energise(made, instrument):
        made.world.damage.stick(output, "on")
    with checks.refuses("make_safe that does not take", InstrumentError, remedy=remedy):
        instrument.make_safe()
    made.world.damage.stick(output, None)
    instrument.make_safe()
    checks.that("off once it obeys again", not made.energised, "it is on", remedy)


def check_found(trial: Trial) -> None:
    """Check that one opened with its output on can be made safe at once, and used after that.

    One that the manual has running in another way is used at once.
    """
    session, checks = trial.session, trial.checks
    if (runs := checks.manual.running) is not None:
        with trial.opened() as (made, instrument):
            runs(made.simulated)
            wrong = trial.wrong(made, instrument)
            checks.that("found running: works", not wrong, wrong, TAKE_OVER)
    with trial.stand() as made:
        session.prepare(made)
        first = made.open()
        left = session.energise(made, first) if session.energise is not None else nullcontext()
        left.__enter__()
        # Whoever has it on may have left its settings anyhow.
        made.find()
        second = made.open(elsewhere=True)
        second.make_safe()
        checks.that("found on: make_safe", not made.energised, "it is on", _SAFE)
        wrong = trial.wrong(made, second)
        checks.that("found on: works after make_safe", not wrong, wrong, TAKE_OVER)
        second.close()
        with suppress(Exception):
            left.__exit__(None, None, None)
        first.close()
