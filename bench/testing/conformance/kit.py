"""All conformance checks as one object for a test, which fails with the list of all findings."""

import warnings
from collections.abc import Sequence
from pathlib import Path
from typing import Any

from bench.i18n.errors import InputError
from bench.plugins.catalogue import BrokenPlugin
from bench.plugins.catalogues import Catalogues, installed
from bench.plugins.files import load_file
from bench.testing.conformance.driver import check_driver
from bench.testing.conformance.export import check_export
from bench.testing.conformance.procedure import check_procedure
from bench.testing.conformance.report import ConformanceReport
from bench.testing.conformance.safety_devices import (
    ContactPlace,
    RelayPlace,
    check_interlock,
    check_watchdog_relay,
)
from bench.testing.conformance.simulated_instrument import check_simulated_instrument


class UncheckedWarning(UserWarning):
    """Something of a plug-in could not be checked."""


class Conformance:
    """Checks plug-ins; `runs` is the folder for the records of procedures."""

    def __init__(self, runs: Path) -> None:
        self._runs = runs
        self._catalogues: Catalogues = installed()

    def files(self, *paths: Path | str) -> "Conformance":
        """Add plug-in files, as a station's [plugins] names them. Raises InputError for one that is not there, or unusable."""
        files = [load_file(Path(path).resolve(), str(path)) for path in paths]
        for file in files:
            if file.error is not None:
                raise InputError(BrokenPlugin("", file.origin, file.error).sentence)
        self._catalogues = self._catalogues.with_files(files)
        return self

    def driver(self, driver: Any, **how: Any) -> ConformanceReport:
        """Check a driver as `check_driver` does. Raises AssertionError that lists what does not conform."""
        return _required(check_driver(driver, catalogues=self._catalogues, **how))

    def interlock(self, driver: Any, place: ContactPlace, **how: Any) -> ConformanceReport:
        """Check a driver of contacts as `check_interlock` does. Raises AssertionError likewise."""
        return _required(check_interlock(driver, place, catalogues=self._catalogues, **how))

    def watchdog_relay(self, driver: Any, place: RelayPlace, **how: Any) -> ConformanceReport:
        """Check a driver of relays as `check_watchdog_relay` does. Raises AssertionError likewise."""
        return _required(check_watchdog_relay(driver, place, catalogues=self._catalogues, **how))

    def simulated_instrument(self, simulated: Any, **how: Any) -> ConformanceReport:
        """Check a simulated instrument as `check_simulated_instrument` does. Raises AssertionError likewise."""
        return _required(check_simulated_instrument(simulated, catalogues=self._catalogues, **how))

    def procedure(self, name: str, settings: Sequence[str] = (), **how: Any) -> ConformanceReport:
        """Check a procedure as `check_procedure` does; warns where a figure has no known truth. Raises AssertionError likewise."""
        return _required(check_procedure(name, self._runs, settings=settings, catalogues=self._catalogues, **how))

    def export(self, export: Any) -> ConformanceReport:
        """Check an export as `check_export` does. Raises AssertionError likewise."""
        return _required(check_export(export, catalogues=self._catalogues))


def _required(report: ConformanceReport) -> ConformanceReport:
    report.require()
    for sentence in report.unchecked:
        warnings.warn(f"{report.subject}: {sentence}", UncheckedWarning, stacklevel=3)
    return report
