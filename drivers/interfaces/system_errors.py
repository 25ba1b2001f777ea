"""Messages for the operating system's error numbers."""

import errno
import os

#: English templates by error number; other languages are in the catalogue.
MEANINGS = {
    errno.EACCES: "permission denied",
    errno.EADDRINUSE: "the address is in use already",
    errno.EADDRNOTAVAIL: "this computer has no such address",
    errno.EBADF: "it is closed already",
    errno.EBUSY: "the device or file is busy",
    errno.ECONNABORTED: "the connection was broken off",
    errno.ECONNREFUSED: "the connection was refused: nothing listens there",
    errno.ECONNRESET: "the other side closed the connection",
    errno.EDQUOT: "the disk quota is used up",
    errno.EEXIST: "it exists already",
    errno.EFBIG: "the file is larger than allowed",
    errno.EHOSTUNREACH: "the computer cannot be reached",
    errno.EINVAL: "an argument is not valid",
    errno.EIO: "the device reports an input or output error",
    errno.EISDIR: "it is a folder, not a file",
    errno.ELOOP: "too many symbolic links",
    errno.EMFILE: "this process has too many open files",
    errno.ENAMETOOLONG: "the name is too long",
    errno.ENETUNREACH: "the network cannot be reached",
    errno.ENFILE: "the system has too many open files",
    errno.ENODEV: "there is no such device",
    errno.ENOENT: "there is no such file or folder",
    errno.ENOMEM: "there is not enough memory",
    errno.ENOSPC: "no space is left on the disk",
    errno.ENOTCONN: "there is no connection",
    errno.ENOTDIR: "a part of the path is not a folder",
    errno.ENOTEMPTY: "the folder is not empty",
    errno.ENXIO: "there is no such device or address",
    errno.EPERM: "the operation is not permitted",
    errno.EPIPE: "the other side closed the connection",
    errno.EROFS: "the disk is read-only",
    errno.ETIMEDOUT: "there was no answer in time",
}
#: What a name server does not know (socket.EAI_NONAME); the socket module is not imported for one number.
_UNKNOWN_HOST = "the computer's name is not known"


def meaning(error: OSError) -> str:
    """Return what the error's number means, nothing where the number is not the operating system's or is not known."""
    if type(error).__name__ == "gaierror":
        return _UNKNOWN_HOST
    if error.errno is None:
        return MEANINGS[errno.ETIMEDOUT] if isinstance(error, TimeoutError) else ""
    # Libraries put numbers of their own into errors of this kind (ssl): the system's are told by class or words.
    own = type(error).__module__ == "builtins" and type(error) is not OSError
    if own or os.strerror(error.errno) in str(error.strerror):
        return MEANINGS.get(error.errno, "")
    return ""
