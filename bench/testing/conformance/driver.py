"""Check a driver through its real protocol, with its simulated instrument on a virtual bench."""

from collections.abc import Iterator, Mapping, Sequence
from contextlib import contextmanager, suppress
from typing import Any

from bench.i18n.errors import InputError, fault
from bench.plugins.catalogues import Catalogues, installed
from bench.station.library_logs import quieten_libraries
from bench.testing.conformance.altered import check_altered
from bench.testing.conformance.connection import check_connection
from bench.testing.conformance.disturbed import check_trip, disturb
from bench.testing.conformance.ends import check_ends, check_found
from bench.testing.conformance.found import check_left
from bench.testing.conformance.guarded import check_guarded
from bench.testing.conformance.interface import check_interface
from bench.testing.conformance.limits import check_limits
from bench.testing.conformance.manual import Manual
from bench.testing.conformance.models import check_model
from bench.testing.conformance.network_management import check_network_management
from bench.testing.conformance.opening import check_opening
from bench.testing.conformance.recognition import check_recognition
from bench.testing.conformance.replies import check_replies
from bench.testing.conformance.report import Checks, ConformanceReport, FirstFailure
from bench.testing.conformance.session import Trial, session_of
from bench.testing.conformance.stand import DriverUnderTest, Found, station_of
from bench.testing.conformance.station import check_station
from drivers.catalogue import Driver
from drivers.interfaces import Role
from drivers.interfaces.text import text
from sim_instruments.catalogue import SimulatedInstrument


def check_driver(
    driver: Driver | str,
    *,
    role: Role | None = None,
    options: Any = None,
    found: Found | None = None,
    catalogues: Catalogues | None = None,
    seed: int = 0,
    manual: Manual | None = None,
    variants: Sequence[Mapping[str, Any]] = (),
    thorough: bool = False,
    first_only: bool = False,
) -> ConformanceReport:
    """Check a driver, given itself or by its name, with the simulated instrument that its declaration names.

    `role` is for a name that has drivers of several. `options` are an instance of the driver's options, or a mapping for it.
    `found` changes the simulated instrument before the driver meets it: settings that somebody may have left. `catalogues`
    hold the plug-ins, the installed ones where they are not given. `manual` is what the maker states. `variants` are other
    options, each beside the others, with which it is used as well; with a `manual` among them it is held to that instead, and
    with `simulated`, a SimulatedInstrument, it is used with another instrument of its family.
    `thorough` disturbs each message in every way, `first_only` ends at the first failure.

    Raises InputError for a driver or a simulated instrument that is not there.
    """
    quieten_libraries()
    subject = subject_of(driver, role, options, catalogues or installed(), found=found)
    checks = Checks(first_only=first_only, manual=manual or Manual())
    trial = Trial(subject, session_of(subject.role), checks, seed, thorough)
    with suppress(FirstFailure):
        for check in (
            check_interface,
            check_recognition,
            _use,
            check_limits,
            check_ends,
            check_guarded,
            check_found,
            check_left,
            check_network_management,
            check_connection,
            check_opening,
            check_replies,
        ):
            with told(checks, check.__name__.strip("_")):
                check(trial)
        for model in checks.manual.models:
            with told(checks, "models"):
                check_model(trial, model)
        with told(checks, "options of the station"):
            check_station(trial, variants)
        with told(checks, "disturbed line"):
            disturb(trial)
            check_trip(trial)
            check_altered(trial)
    return checks.report(f"{subject.driver.name} ({subject.role.value})")


def subject_of(
    driver: Driver | str,
    role: Role | None,
    options: Any,
    catalogues: Catalogues,
    simulated: SimulatedInstrument | None = None,
    found: Found | None = None,
) -> DriverUnderTest:
    """Return what is checked, by a driver or its name; `simulated` is the declared one where it is not given.

    Raises InputError for what is no driver, or has no simulated instrument.
    """
    if isinstance(driver, str):
        named = catalogues.drivers.need(driver, lambda why: InputError(why))
        chosen = [each for each in named if role in (None, each.role)]
        if len(chosen) != 1:
            roles = ", ".join(each.role.value for each in named)
            raise InputError(
                text("{driver} has drivers of several roles; give one of {roles}", driver=driver, roles=roles)
            )
        driver = chosen[0]
    if not isinstance(driver, Driver):
        raise InputError(text("{driver!r} is no driver: give a Driver(…), or the name of one", driver=driver))
    if simulated is None:
        if not driver.simulated:
            raise InputError(
                text("{driver} names no simulated instrument: give Driver(simulated=…)", driver=driver.name)
            )
        simulated = catalogues.simulated_instruments.need(driver.simulated, lambda why: InputError(why))
    result = options if isinstance(options, driver.options) else driver.options(**(options or {}))
    return DriverUnderTest(driver, result, simulated, station_of(result), found)


@contextmanager
def told(checks: Checks, what: str) -> Iterator[None]:
    """Turn any unexpected error of a check into a finding. Raises InputError if required options are missing."""
    try:
        yield
    except InputError:
        # Whoever checks has to state more; it says nothing of the driver.
        raise
    except Exception as error:  # noqa: BLE001  whatever a driver raises is a finding
        remedy = "A driver raises InstrumentError where the instrument is at fault, and nothing in proper use"
        checks.that(f"{what}: no other error", False, str(fault(error)), remedy)


def _use(trial: Trial) -> None:
    with trial.opened(listening=True) as (made, instrument):
        trial.session.brief(made, instrument, trial.checks)
        trial.session.full(made, instrument, trial.checks)
        # And once more: what one use leaves must not spoil the next.
        trial.session.brief(made, instrument, trial.checks)
