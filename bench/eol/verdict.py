"""What is said of a measurement, a check and a motor."""

from collections.abc import Iterable
from enum import Enum


class Verdict(Enum):
    """`error`: the station could not measure, which says nothing of the motor; `aborted`: a person ended it."""

    PASS = "pass"  # noqa: S105  a verdict, no password
    FAIL = "fail"
    ERROR = "error"
    ABORTED = "aborted"


#: Of several verdicts the one that counts most: a motor that failed has failed, whatever else went wrong.
_ORDER = (Verdict.ABORTED, Verdict.FAIL, Verdict.ERROR, Verdict.PASS)


def together(verdicts: Iterable[Verdict]) -> Verdict:
    """Return the verdict on the whole; nothing at all is an error, for nothing was found good."""
    present = set(verdicts)
    return next((verdict for verdict in _ORDER if verdict in present), Verdict.ERROR)
