"""What keeps a run's record from being written."""

import errno
from pathlib import Path

from drivers.interfaces.text import reason_of, text

_REMEDIES = {
    errno.ENOSPC: text("Make room on that disk"),
    errno.EDQUOT: text("Make room within the quota"),
    errno.EROFS: text("Have that disk writable again, or choose another by --runs"),
    errno.EFBIG: text("Raise the limit of a file's size"),
    errno.EIO: text("Look after that disk: it reports errors of its own"),
}


class RecordError(OSError):
    """The record cannot be written, so the run must end; the message names the file, the reason and what to do."""

    def __init__(self, path: Path, cause: OSError) -> None:
        self.path = path
        self.cause = cause
        self.text = text(
            "{path} cannot be written: {reason}. Nothing that stood in the journal is lost. {remedy}, then go on: with a run by "
            "--resume, with a batch by beginning it again",
            path=path,
            reason=reason_of(cause),
            remedy=_REMEDIES.get(cause.errno or 0, text("Look after the disk and the folder's permissions")),
        )
        super().__init__(str(self.text))
