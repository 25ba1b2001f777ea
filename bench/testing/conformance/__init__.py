"""Checks whether a user's driver, simulated instrument, procedure or export fulfils what motorbench requires of it."""

from bench.testing.conformance.driver import check_driver
from bench.testing.conformance.export import check_export
from bench.testing.conformance.manual import Left, Manual, Model, NotYet, ProtectionTrip, Reply, StatedLimits
from bench.testing.conformance.procedure import check_procedure
from bench.testing.conformance.report import CheckFinding, ConformanceReport
from bench.testing.conformance.safety_devices import (
    ContactPlace,
    RelayPlace,
    check_interlock,
    check_watchdog_relay,
)
from bench.testing.conformance.simulated_instrument import check_simulated_instrument

__all__ = [
    "CheckFinding",
    "ConformanceReport",
    "ContactPlace",
    "Left",
    "Manual",
    "Model",
    "NotYet",
    "ProtectionTrip",
    "RelayPlace",
    "Reply",
    "StatedLimits",
    "check_driver",
    "check_export",
    "check_interlock",
    "check_procedure",
    "check_simulated_instrument",
    "check_watchdog_relay",
]
