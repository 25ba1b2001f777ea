"""Checks of a driver's class, methods, identity and watchdog."""

import inspect
from dataclasses import fields
from typing import Any

from bench.testing.conformance.session import Trial, plain_readings
from drivers.interfaces import Identity, MeasurementError, Watching
from drivers.interfaces.declarations import declarations


def check_interface(trial: Trial) -> None:
    """Check class, methods, identity, watchdog, and what is said before anything was configured."""
    subject, checks = trial.subject, trial.checks
    standard = {one.name: one.default for one in fields(subject.driver.options)}
    for name, value in checks.manual.defaults.items():
        there = standard.get(name)
        checks.that(f"default of {name}", there == value, f"{there} instead of {value}", "Compare with the reference")
    with trial.opened() as (_, instrument):
        interface = subject.role.interface
        is_one = interface in type(instrument).__mro__
        remedy = f"Derive its class from {interface.__module__}.{interface.__name__}"
        checks.that("interface", is_one, f"{type(instrument).__name__} is no {interface.__name__}", remedy)
        for name, declared in declarations(interface).items():
            if declared.is_property or not callable(getattr(type(instrument), name, None)):
                continue
            parameters = list(inspect.signature(getattr(instrument, name)).parameters.values())
            have = {one.name: one.default for one in parameters}
            right, advice = have == dict(declared.arguments), "Take the interface's names and defaults"
            checks.that(f"signature of {name}", right, f"{have} instead of {dict(declared.arguments)}", advice)
            offered = declared.ability is None or declared.ability in instrument.abilities
            own = getattr(type(instrument), name) is not getattr(interface, name)
            advice = "State in `abilities` what it can do, and have a method for each"
            wrong = f"{declared.ability} is {'' if offered else 'not '}stated"
            checks.that(f"ability of {name}", declared.ability is None or offered is own, wrong, advice)
        if (stated_abilities := subject.driver.abilities) is not None:
            wrong = f"{instrument.abilities}, the driver declares {stated_abilities}"
            same = instrument.abilities == stated_abilities
            checks.that("abilities", same, wrong, "Declare of the driver what its instrument states")
        identity = instrument.identity
        known = isinstance(identity, Identity) and bool(identity.model)
        checks.that("identity", known, f"{identity}", "Ask the instrument when it is opened")
        if (stated := checks.manual.identity) is not None:
            wrong = f"{identity} instead of {stated}"
            checks.that("identity as stated", identity == stated, wrong, "Compare its parts")
        same = instrument.identity == identity
        checks.that("identity stays", same, "it changes", "Keep what was asked when it was opened")
        if isinstance(subject.options, Watching):
            asked, armed = subject.options.watchdog, instrument.watchdog
            wrong = f"{armed}, asked for {asked}"
            checks.that("watchdog", armed is None or asked is not None, wrong, "Arm what is asked for")
        if "configure" in declarations(interface) and not subject.role.feeds:
            _unready(trial, instrument)
        if "configure_acquisition" in declarations(interface):
            remedy = "Raise MeasurementError where no record was set up yet"
            with checks.refuses("initiate() before configure_acquisition()", MeasurementError, remedy=remedy):
                instrument.initiate()
        for arguments, accuracy in checks.manual.accuracies_at.items():
            if isinstance(accuracy, type):
                remedy = "Raise where the manual states none"
                with checks.refuses(f"accuracy_at{arguments}: none is stated", accuracy, remedy=remedy):
                    instrument.accuracy_at(*arguments)
                continue
            found = instrument.accuracy_at(*arguments)
            several = (found, accuracy) if isinstance(accuracy, tuple) else ((found,), (accuracy,))
            for is_so, is_stated in zip(*several, strict=True):
                checks.same_accuracy(f"accuracy_at{arguments}", is_so, is_stated)


def _unready(trial: Trial, instrument: Any) -> None:
    remedy = "Raise MeasurementError where nothing was configured yet"
    for name in plain_readings(trial.subject.role):
        with trial.checks.refuses(f"{name}() before configure()", MeasurementError, remedy=remedy):
            getattr(instrument, name)()
