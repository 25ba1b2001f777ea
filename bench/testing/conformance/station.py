"""Options of a station file: accuracies that replace the maker's, and further sets of options with which it is used."""

from collections.abc import Mapping, Sequence
from dataclasses import fields, replace
from typing import Any

from bench.testing.conformance.connection import check_port
from bench.testing.conformance.interface import check_interface
from bench.testing.conformance.limits import check_limits
from bench.testing.conformance.process_data import check_process_data
from bench.testing.conformance.replies import check_replies
from bench.testing.conformance.report import Checks
from bench.testing.conformance.session import Trial
from bench.testing.conformance.stand import station_of
from bench.testing.conformance.watchdogs import check_watchdog
from drivers.interfaces import Accuracy, Watching


def check_station(trial: Trial, variants: Sequence[Mapping[str, Any]]) -> None:
    """Check that each accuracy of the station is stated by a reading, and that every variant of the options works."""
    given = {
        one.name: Accuracy(gain=0.1 + 0.01 * number, offset=0.01, source="the station's calibration")
        for number, one in enumerate(fields(trial.subject.options))
        if "Accuracy | None" in str(one.type)
    }
    if given:
        during = Checks()
        with trial.having(**given).opened() as (made, instrument):
            trial.session.brief(made, instrument, during)
        for name, accuracy in given.items():
            same = any(
                (one.gain, one.offset, one.source) == (accuracy.gain, 0.01, accuracy.source) for one in during.stated
            )
            trial.checks.that(f"{name} of the station", same, "no reading states it", "It replaces the maker's")
    for each in variants:
        variant = {name: value for name, value in each.items() if name not in ("manual", "simulated")}
        other, name = trial.having(**variant), f"with {variant}"
        if "simulated" in each:
            name = f"{name} of {each['simulated'].name}"
            other = replace(other, subject=replace(other.subject, simulated=each["simulated"]))
        if "manual" in each:
            stated = replace(other, checks=replace(trial.checks, manual=each["manual"]))
            for check in (check_interface, check_limits, check_port, check_replies):
                check(stated)
            continue
        other = replace(other, subject=replace(other.subject, station=station_of(other.subject.options)))
        if isinstance(other.subject.options, Watching) and other.subject.options.watchdog is not None:
            check_watchdog(other, name, trial)
            continue
        with other.opened(listening=True) as (made, instrument):
            wrong = other.wrong(made, instrument, full=True)
        check_process_data(other)
        trial.checks.that(f"{name}: it works", not wrong, wrong, "Take every option into account")
