"""Checks whether the instrument that answers has the serial number in the station file."""

from drivers.interfaces import Identity, IdentityError
from drivers.interfaces.text import text


def check_serial_number(name: str, answering: Identity, expected: str | None, command: str) -> None:
    """Raise IdentityError where another serial number answers `command` than the one expected, if one is."""
    if expected is not None and answering.serial_number != expected:
        raise IdentityError(
            name,
            text(
                "serial number {serial_number} answers, expected {expected}",
                serial_number=answering.serial_number,
                expected=expected,
            ),
            command=command,
            remedy=text("Correct the serial number, and the calibration with it, in the station file"),
        )
