"""What current the supply's voltage drives through the winding."""

from typing import Any

from drivers.interfaces.text import text
from procedures.core.procedure import Procedure

#: What the winding may take of the supply's highest voltage; leads, contacts and warm copper take the rest.
_OF_VOLTAGE = 0.8


def within_voltage(procedure: Procedure[Any], wanted: float) -> float:
    """Return the current (A) that is wanted between two lines, or the smaller one that the supply's highest voltage drives, which is told.

    Where the winding's resistance is not known it is the one wanted.
    """
    phase = procedure.known_value("stator_resistance")
    if phase is None:
        return wanted
    voltage = procedure.bench.supply.maximum_voltage
    most = _OF_VOLTAGE * voltage / (2.0 * phase)
    if wanted <= most:
        return wanted
    if "current_within_voltage" not in procedure.findings:
        procedure.notice(
            "supply-voltage",
            text(
                "the supply's {voltage:.3g} V do not drive {wanted:.3g} A through two phases of {phase:.3g} Ω: {most:.3g} A are used. An "
                "output of more volts allows more",
                voltage=voltage,
                wanted=wanted,
                phase=phase,
                most=most,
            ),
        )
    procedure.findings["current_within_voltage"] = most
    return most
