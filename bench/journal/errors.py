"""Errors that keep a run's record from being written."""

import errno
from pathlib import Path

from drivers.interfaces.text import reason_of, text

_REMEDIES = {
    errno.ENOSPC: text("Make room on that disk"),
    errno.EDQUOT: text("Make room within the quota"),
    errno.EROFS: text("Make that disk writable again, or choose another with --runs"),
    errno.EFBIG: text("Raise the limit of a file's size"),
    errno.EIO: text("Check that disk: it reports errors"),
}


class RecordError(OSError):
    """The record cannot be written, so the run must end; the message names the file, the reason and what to do.

    `brief` leaves out what to do, for where the `remedy` was said already.
    """

    def __init__(self, path: Path, cause: OSError) -> None:
        self.path = path
        self.cause = cause
        reason = reason_of(cause)
        self.remedy = _REMEDIES.get(cause.errno or 0, text("Check the disk and the folder's permissions"))
        self.brief = text("{path} cannot be written: {reason}", path=path, reason=reason)
        self.text = text(
            "{path} cannot be written: {reason}. Nothing already in the journal is lost. {remedy}, then "
            "continue: a run with --resume, a batch by starting it again",
            path=path,
            reason=reason,
            remedy=self.remedy,
        )
        super().__init__(str(self.text))
