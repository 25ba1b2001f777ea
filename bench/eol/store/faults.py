"""Reasons why a database does not take a record: a temporary one, or the content of the record."""

from sqlalchemy.exc import DataError, DBAPIError, IntegrityError, SQLAlchemyError, StatementError

from bench.eol.store.database import reason
from bench.i18n.errors import InputError
from drivers.interfaces.text import Text, reason_of, text, text_of

#: SQLSTATE classes of what is wrong with the data: data, integrity, a trigger's own exception, a view's check.
_CONTENT = ("22", "23", "P0", "44")
#: SQLSTATE classes of a server or a connection that cannot work now, whatever it is asked to keep.
_SERVER = ("08", "25", "28", "3D", "40", "53", "55", "57", "58", "F0")

#: What keeping a record may raise.
FAULTS = (SQLAlchemyError, InputError, OSError, ValueError, TypeError, OverflowError)


class StoreError(Exception):
    """A record could not be kept now; trying again later may help."""

    def __init__(self, message: Text | str) -> None:
        super().__init__(message)
        self.text = message if isinstance(message, Text) else Text("{message}", {"message": message})


class RefusedError(StoreError):
    """A record is refused for what is in it; only another record or another database would help."""


class DoubtfulError(StoreError):
    """A record was refused, and the database's words do not tell whether it refuses all."""


def fault_of(error: Exception) -> StoreError:
    """Return what an error of keeping a record means."""
    if isinstance(error, StoreError):
        return error
    if isinstance(error, DBAPIError):
        return _by_database(error)
    if isinstance(error, InputError):
        return StoreError(text_of(error))
    if isinstance(error, StatementError | ValueError | TypeError | OverflowError):
        # The driver cannot put it into the database's words, whatever state that is in.
        return RefusedError(_foreign(error))
    if isinstance(error, OSError):
        return StoreError(reason_of(error))
    return StoreError(_foreign(error))


def program_fault(error: BaseException) -> Text:
    """Return the message for an unexpected error."""
    return text("a fault of the program, {kind}: {error}", kind=type(error).__name__, error=error)


def _foreign(error: Exception) -> Text:
    return Text("{kind}: {error}", {"kind": type(error).__name__, "error": str(error)})


def _by_database(error: DBAPIError) -> StoreError:
    words = reason(error)
    state = getattr(error.orig, "sqlstate", None)
    if isinstance(state, str):
        if state[:2] in _CONTENT:
            return RefusedError(words)
        return StoreError(words) if state[:2] in _SERVER or error.connection_invalidated else DoubtfulError(words)
    if isinstance(error, IntegrityError | DataError):
        return RefusedError(words)
    if "adapt" in words or "bind" in words:
        return RefusedError(words)
    return StoreError(words)
