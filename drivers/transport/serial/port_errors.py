"""Reasons why a serial port cannot be opened, and remedies; importing this imports no transport library."""

import errno
from collections.abc import Iterator

from drivers.interfaces import CommunicationError
from drivers.interfaces.system_errors import MEANINGS
from drivers.interfaces.text import Text, text, text_of

_LISTED = text("Give a serial port; motorbench station scan lists those of this computer")
_ABSENT = text("Connect the adapter; motorbench station scan lists the serial ports of this computer")
_NOT_ALLOWED = text("Add yourself to the group of the port (often dialout) and log in anew")
_BUSY = text("End the program that has it open")
_OTHERS = text("Check the adapter and its cable")

_REASONS = {
    errno.ENOTTY: text("it is no serial port"),
    errno.EISDIR: text("it is a folder, not a serial port"),
    errno.EAGAIN: text("another program has it open"),
    errno.EBUSY: text("another program has it open"),
}
_REMEDIES = {
    errno.ENOTTY: _LISTED,
    errno.EISDIR: _LISTED,
    errno.ENOTDIR: _LISTED,
    errno.ENOENT: _ABSENT,
    errno.ENODEV: _ABSENT,
    errno.ENXIO: _ABSENT,
    errno.EACCES: _NOT_ALLOWED,
    errno.EPERM: _NOT_ALLOWED,
    errno.EAGAIN: _BUSY,
    errno.EBUSY: _BUSY,
}


def reason_and_remedy(error: BaseException) -> tuple[Text, Text]:
    """Return why opening a port failed, and what to do."""
    for number in _numbers(error):
        if number in _REASONS:
            return _REASONS[number], _REMEDIES[number]
        if number in MEANINGS:
            return Text(MEANINGS[number]), _REMEDIES.get(number, _OTHERS)
    return text_of(error), _OTHERS


def not_opened(name: str, address: str, error: BaseException) -> CommunicationError:
    """Return the error of an instrument whose serial port cannot be opened; it is to be raised from `error`."""
    reason, remedy = reason_and_remedy(error)
    return CommunicationError(
        name, text("cannot be opened at {address} ({error})", address=address, error=reason), remedy=remedy
    )


def _numbers(error: BaseException | None) -> Iterator[int]:
    """Yield the system's error numbers in an error and in what it came of: pyserial puts some of them into words."""
    while error is not None:
        number = getattr(error, "errno", None)
        # What the terminal interface raises (termios.error) is no OSError, but has its number first.
        first = error.args[0] if error.args else None
        for one in (number, first):
            if isinstance(one, int):
                yield one
        error = error.__cause__ or error.__context__
