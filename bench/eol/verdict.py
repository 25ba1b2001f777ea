"""Verdicts on a measurement, a check and a motor."""

from collections.abc import Iterable
from enum import Enum


class Verdict(Enum):
    """`error`: the station could not measure, which says nothing of the motor; `aborted`: a person ended it.

    `not_judged` is said of a figure only: it was withheld, and its motor is an error.
    """

    PASS = "pass"  # noqa: S105  a verdict, no password
    FAIL = "fail"
    ERROR = "error"
    ABORTED = "aborted"
    NOT_JUDGED = "not_judged"

    @classmethod
    def of_motors(cls) -> "tuple[Verdict, ...]":
        """Return those that a motor may have."""
        return cls.PASS, cls.FAIL, cls.ERROR, cls.ABORTED


#: Of several verdicts the one that counts most: a motor that failed has failed, whatever else went wrong.
_ORDER = (Verdict.ABORTED, Verdict.FAIL, Verdict.ERROR, Verdict.NOT_JUDGED, Verdict.PASS)


def together(verdicts: Iterable[Verdict]) -> Verdict:
    """Return the verdict on the whole; nothing at all is an error, for nothing was found good."""
    present = set(verdicts)
    gravest = next((verdict for verdict in _ORDER if verdict in present), Verdict.ERROR)
    return Verdict.ERROR if gravest is Verdict.NOT_JUDGED else gravest
