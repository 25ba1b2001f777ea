"""What keeps a run's record from being written."""

import errno
from pathlib import Path

_REMEDIES = {
    errno.ENOSPC: "Make room on that disk",
    errno.EDQUOT: "Make room within the quota",
    errno.EROFS: "Have that disk writable again, or choose another by --runs",
    errno.EFBIG: "Raise the limit of a file's size",
    errno.EIO: "Look after that disk: it reports errors of its own",
}


class RecordError(OSError):
    """The record cannot be written, so the run must end; the message names the file, the reason and what to do."""

    def __init__(self, path: Path, cause: OSError) -> None:
        self.path = path
        self.cause = cause
        reason = cause.strerror or str(cause)
        remedy = _REMEDIES.get(cause.errno or 0, "Look after the disk and the folder's permissions")
        super().__init__(
            f"{path} cannot be written: {reason}. Nothing that stood in the journal is lost. {remedy}, then go on with --resume"
        )
