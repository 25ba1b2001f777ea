"""Checks that the shutdown's measurements over the guardian's connection agree with those over the connection in use."""

from contextlib import nullcontext
from typing import Any

from bench.safety.shutdown_items import measured
from bench.station.shutdown_sequence import BELOW, ROLES_OF, Item, item
from bench.testing.conformance.report import Checks
from bench.testing.conformance.session import Trial
from drivers.interfaces import InstrumentError
from drivers.interfaces.found_state import FoundSetting

#: How far (relative, and in V, A or rad/s) two readings at nearly the same time may be apart.
_SHARE, _STEP = 0.1, 0.1
#: How long (s) it is fed before.
_FED = 2.0


def check_guarded(trial: Trial) -> None:
    """Check each measuring item of a shutdown that the role can do, while there is something to measure.

    A guardian's connection also has a found state, of as many settings as it has looked at.
    """
    with trial.stand() as made:
        trial.session.prepare(made)
        made.listen()
        alone: Any = made.open(guarding=True, elsewhere=True)
        state = alone.found_state
        right = isinstance(state, tuple) and all(isinstance(one, FoundSetting) for one in state)
        right = right and (bool(made.messages) or not state)
        trial.checks.that("found_state when guarding", right, f"{state!r}", "Give a tuple, empty for nothing looked at")
        alone.close()
    role, energise = trial.subject.role, trial.session.energise
    for do in (do for do in BELOW if role in ROLES_OF[do]):
        with trial.opened() as (made, instrument):
            guard: Any = made.open(guarding=True, elsewhere=True)
            with energise(made, instrument) if energise is not None else nullcontext():
                made.wait(_FED)
                _compare(trial.checks, item(do, role), instrument, guard)
            guard.close()


def _compare(checks: Checks, one: Item, instrument: Any, guard: Any) -> None:
    name, remedy = f"{one.do.value} by a second connection", "Ask there, too, what a reading rests on"
    try:
        before, found, after = (measured(one, each).value for each in (instrument, guard, instrument))
    except InstrumentError as error:
        checks.that(f"{name}: is read", False, f"{error}", remedy)
        return
    checks.that(f"{name}: is read", True, "", "")
    allowed = 0.5 * abs(after - before) + _SHARE * max(before, after) + _STEP
    checks.close(name, found, 0.5 * (before + after), allowed, remedy)
