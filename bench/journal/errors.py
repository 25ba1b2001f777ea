"""Errors that keep a run's record from being written."""

import errno
from collections.abc import Sequence
from pathlib import Path

from bench.i18n.errors import InputError
from drivers.interfaces.text import Text, reason_of, text

_REMEDIES = {
    errno.ENOSPC: text("Make room on that disk"),
    errno.EDQUOT: text("Make room within the quota"),
    errno.EROFS: text("Make that disk writable again, or choose another with --runs"),
    errno.EFBIG: text("Raise the limit of a file's size"),
    errno.EIO: text("Check that disk: it reports errors"),
}


class RecordError(OSError):
    """The record cannot be written, so the run must end; the message names the file, the reason and what to do.

    `brief` leaves out what to do, for where the `remedy` is said once for several.
    """

    def __init__(self, path: Path, cause: OSError) -> None:
        self.path = path
        self.cause = cause
        reason = reason_of(cause)
        self.remedy = _REMEDIES.get(cause.errno or 0, text("Check the disk and the folder's permissions"))
        self.brief = text("{path} cannot be written: {reason}", path=path, reason=reason)
        self.text = text(
            "{path} cannot be written: {reason}. Nothing already in the journal is lost. {remedy}, then continue",
            path=path,
            reason=reason,
            remedy=self.remedy,
        )
        super().__init__(str(self.text))


class NoRoomError(InputError):
    """There is no room for a run's record, so it does not begin; `brief` and `remedy` as a RecordError's."""

    def __init__(self, folder: Path, reason: Text | str, size: int) -> None:
        self.brief = text(
            "{parent}: the disk has no room for a run ({strerror}): {size} KiB are reserved for its end alone",
            parent=folder,
            strerror=reason,
            size=size // 1024,
        )
        self.remedy = text("Free some space, or choose another disk with --runs")
        super().__init__(text("{brief}. {remedy}", brief=self.brief, remedy=self.remedy))


def briefly(cause: Text, unwritten: RecordError | NoRoomError | None) -> Text:
    """Return a cause without what to do where this is what it tells of."""
    if unwritten is None:
        return cause
    if cause == unwritten.text:
        return unwritten.brief
    return Text(cause.template, {name: _briefly(value, unwritten) for name, value in cause.values.items()})


def _briefly(value: object, unwritten: RecordError | NoRoomError) -> object:
    if isinstance(value, Text):
        return briefly(value, unwritten)
    if isinstance(value, Sequence) and not isinstance(value, str):
        return [_briefly(item, unwritten) for item in value]
    return value
