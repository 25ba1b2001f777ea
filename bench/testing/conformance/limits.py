"""Checks of set points: refused without sending anything beyond the limits of model, station or manual, accepted at the limit."""

import inspect
import math
from typing import Any

from bench.testing.conformance.manual import StatedLimits
from bench.testing.conformance.report import Checks, enter
from bench.testing.conformance.session import Trial
from bench.testing.conformance.stand import OneInstrumentBench
from drivers.interfaces import AbilityError, InstrumentError, Role, SetpointError
from drivers.interfaces.declarations import Declaration, declarations


def check_limits(trial: Trial) -> None:
    """Check the limits that the instrument states of itself, those that the station lowers, and the manual's."""
    subject, checks = trial.subject, trial.checks
    remedy = "Check every set point against the model's and the station's limit before anything is sent"
    for lowered in (False, True):
        options, lowering = subject.options, trial
        bounds = {
            amount.own: getattr(options, amount.own)
            for each in declarations(subject.role.interface).values()
            for amount in each.amounts.values()
            if hasattr(options, amount.own)
        }
        if lowered:
            if not bounds:
                return
            with trial.opened() as (_, instrument):
                least = {own: 0.5 * getattr(instrument, own) for own in bounds}
            lowering = trial.having(**least)
        # The machine behind stays what it is: only the driver's limits are lowered.
        with lowering.opened(listening=True) as (made, instrument):
            if lowered:
                for own, least_value in least.items():
                    stated = getattr(instrument, own)
                    checks.close(f"{own} of the station", stated, least_value, 1e-9 * abs(least_value), remedy)
            _refused(made, instrument, subject.role, checks, remedy)
            for one in () if lowered else checks.manual.limits:
                _as_stated(made, instrument, one, checks, remedy)


def _refused(made: OneInstrumentBench, instrument: Any, role: Role, checks: Checks, remedy: str) -> None:
    for name, declared in declarations(role.interface).items():
        if not is_offered(instrument, declared):
            _not_offered(made, instrument, name, declared, checks)
            continue
        for argument, amount in declared.amounts.items():
            if not amount.own:
                continue
            highest = float(getattr(instrument, amount.own))
            checks.that(f"{amount.own} is positive", highest > 0.0, f"{highest}", "State the largest value")
            allowed = _allowed(declared, role)
            wrong = [1.001 * highest + 1e-6, math.nan, math.inf, -1.001 * highest - 1e-6]
            for value in (one for one in wrong if not math.isinf(highest)):
                made.messages.clear()
                what = f"{name}: {argument} = {'beyond' if value == value else 'NaN'}"
                with checks.refuses(what, SetpointError, remedy=remedy):
                    enter(getattr(instrument, name)(**{**allowed, argument: value}))
                sent = [message for message, _ in made.messages]
                checks.that(f"{name}: nothing is sent for what is refused", not sent, f"{sent}", remedy)
                checks.that(f"{name}: nothing is on for what is refused", not made.energised, "it is on", remedy)
        for vector, components in declared.vectors.items():
            most = {one: 0.9 * float(getattr(instrument, amount.own)) for one, amount in components.items()}
            made.messages.clear()
            with checks.refuses(f"{name}: {vector} beyond", SetpointError, remedy=remedy):
                enter(getattr(instrument, name)(**{**_allowed(declared, role), **most}))
            sent = [message for message, _ in made.messages]
            checks.that(f"{name}: nothing is sent for what is refused", not sent, f"{sent}", remedy)


def _allowed(declared: Declaration, role: Role) -> dict[str, Any]:
    """Return what a method may be called with: nothing but what it cannot do without."""
    given = {other: 0.0 if one is inspect.Parameter.empty else one for other, one in declared.arguments.items()}
    least: dict[str, Any] = {"duration": 1.0 if role is Role.INSULATION_TESTER else 0.01, "strokes": 1}
    if role is Role.LCR_METER:
        least["level"] = 1.0
    return {**given, **{name: value for name, value in least.items() if name in given}}


def is_offered(instrument: Any, declared: Declaration) -> bool:
    """Tell whether an instrument says that it can do what a method takes."""
    return declared.ability is None or declared.ability in instrument.abilities


def _not_offered(made: OneInstrumentBench, instrument: Any, name: str, declared: Declaration, checks: Checks) -> None:
    """Check that what an instrument says it cannot do is refused by name, with nothing sent."""
    made.messages.clear()
    remedy = "Leave the method out: the interface's own refuses it"
    with checks.refuses(f"{name}: what it does not offer", AbilityError, remedy=remedy):
        enter(
            getattr(instrument, name)(*(0.0 for one in declared.arguments.values() if one is inspect.Parameter.empty))
        )
    sent = [message for message, _ in made.messages]
    checks.that(f"{name}: nothing is sent for what is not offered", not sent, f"{sent}", remedy)


def _as_stated(made: OneInstrumentBench, instrument: Any, stated: StatedLimits, checks: Checks, remedy: str) -> None:
    what = f"{stated.method}: {stated.argument} as the manual states it"

    def call(value: float) -> None:
        enter(getattr(instrument, stated.method)(**{**stated.beside, stated.argument: stated.of(value)}))

    for value in (stated.lowest, stated.highest):
        try:
            call(value)
        except SetpointError as error:
            checks.that(what, False, f"{value:g} is refused: {error}", remedy)
        except InstrumentError as error:
            # At its limit it may be that nothing settles; the value was taken.
            checks.that(what, True, f"{error}", remedy)
        instrument.make_safe()
    beyond = stated.beyond or stated.step or 1e-3 * max(abs(stated.lowest), abs(stated.highest))
    between = [stated.lowest + 0.5 * stated.step] if stated.step else []
    below = stated.beyond or min(beyond, abs(stated.lowest) * 1e-3 or beyond)
    for value in (stated.lowest - below, stated.highest + beyond, *between):
        made.messages.clear()
        with checks.refuses(what, SetpointError, remedy=f"{remedy} ({value:g})"):
            call(value)
        sent = [message for message, _ in made.messages]
        checks.that(f"{stated.method}: nothing is sent for what is refused", not sent, f"{sent}", remedy)
