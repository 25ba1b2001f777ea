"""Results of conformance checks: one named finding for each check, with what was wrong and what to do."""

import math
from collections.abc import Callable, Collection, Iterator, Sequence
from contextlib import contextmanager
from dataclasses import dataclass, field
from typing import Any

from bench.testing.conformance.manual import Manual
from drivers.interfaces import Accuracy, InstrumentError, Reading, SetpointError

#: A reading counts as right within its stated limits of error and this many standard deviations of its noise.
_DEVIATIONS = 5.0


@dataclass(frozen=True)
class CheckFinding:
    """One check: whether it passed, what was wrong where it did not, and what to do about it."""

    check: str
    passed: bool
    wrong: str = ""
    remedy: str = ""

    def __str__(self) -> str:
        return f"{self.check}: passed" if self.passed else f"{self.check}: {self.wrong}. {self.remedy}"


@dataclass(frozen=True)
class ConformanceReport:
    """The findings on one plug-in; `subject` names it. `unchecked` states what could not be checked, and what is needed for it."""

    subject: str
    findings: tuple[CheckFinding, ...]
    unchecked: tuple[str, ...] = ()

    @property
    def failures(self) -> tuple[CheckFinding, ...]:
        """The checks that were not passed."""
        return tuple(finding for finding in self.findings if not finding.passed)

    @property
    def passed(self) -> bool:
        """True if there was a check and every check was passed."""
        return bool(self.findings) and not self.failures

    def require(self) -> None:
        """Raise AssertionError that lists each check that was not passed."""
        if not self.passed:
            lines = [str(finding) for finding in self.failures] or ["nothing was checked"]
            raise AssertionError(f"{self.subject} does not conform:\n" + "\n".join((*lines, *self.unchecked)))


def in_words(said: object) -> bool:
    """Tell whether a message consists of words, not only of a number or a name."""
    return any(character.isalpha() for character in str(said)) and not isinstance(said, int | float)


def same_value(found: Any, stated: Any) -> bool:
    """Tell whether something is as stated; numbers but for what is rounded."""
    both = isinstance(stated, float) and isinstance(found, int | float)
    return math.isclose(found, stated, rel_tol=1e-6, abs_tol=1e-12) if both else bool(found == stated)


def enter(result: Any) -> None:
    """Enter and leave the block that a method gives; nothing for what is none."""
    if hasattr(result, "__enter__"):
        with result:
            pass


class FirstFailure(BaseException):
    """Ends the checks at the first that fails, where no more is asked for."""


@dataclass
class Checks:
    """Collects findings by the name of the check; a check that failed once stays failed.

    With `first_only`, FirstFailure is raised at the first failure.
    """

    found: dict[str, CheckFinding] = field(default_factory=dict)
    first_only: bool = False
    manual: Manual = field(default_factory=Manual)
    #: The accuracies that were stated by readings.
    stated: list[Accuracy] = field(default_factory=list)
    #: What could not be looked at.
    unchecked: list[str] = field(default_factory=list)

    @property
    def wrong(self) -> str:
        """The checks that were not passed, in one line; empty where all were."""
        return "; ".join(str(one) for one in self.found.values() if not one.passed)

    def that(self, check: str, holds: bool, wrong: str, remedy: str) -> None:
        """Note whether something holds."""
        if not holds and self.found.get(check, CheckFinding(check, True)).passed:
            self.found[check] = CheckFinding(check, False, wrong, remedy)
            if self.first_only:
                raise FirstFailure
        else:
            self.found.setdefault(check, CheckFinding(check, True))

    def close(self, check: str, found: float, actual: float, tolerance: float, remedy: str) -> None:
        """Note whether a number is finite and within a tolerance of the actual one, in the same unit."""
        holds = math.isfinite(found) and abs(found - actual) <= tolerance
        self.that(check, holds, f"{found:.6g} instead of {actual:.6g} (± {tolerance:.2g})", remedy)

    def reading(self, check: str, reading: Reading, actual: float, unit: str, slack: float = 0.0) -> None:
        """Note whether a reading has its declared unit, states an accuracy and its source, and holds it (`slack` on top)."""
        remedy = "Compare scale, sign and unit with the maker's manual"
        self.that(f"{check}: unit", reading.unit == unit, f"{reading.unit!r} instead of {unit!r}", remedy)
        self.accuracy(check, reading.accuracy, reading.value, unit, actual, slack)

    def accuracy(
        self, check: str, stated: Accuracy, value: float, unit: str, actual: float, slack: float = 0.0
    ) -> None:
        """Note whether a value is within its stated limits of error of the actual one."""
        self.stated.append(stated)
        half = abs(stated.gain * value) + stated.offset + stated.resolution
        right = half + stated.noise > 0.0 and in_words(stated.source)
        advice = "Give gain, offset and resolution as the manual states them, and its place as the source"
        self.that(f"{check}: accuracy is stated", right, f"{stated}", advice)
        steps = stated.resolution <= 0.5 * abs(actual) + 10.0 * slack
        right = (steps and half <= 0.2 * abs(actual) + 10.0 * slack + 2.0 * stated.resolution) or actual == 0.0
        advice = "Compare the stated accuracy with the manual: relative or in the unit, per cent or parts"
        self.that(f"{check}: accuracy is plausible", right, f"± {half:.3g} {unit} of {actual:.3g} {unit}", advice)
        self.as_stated(check, stated)
        allowed = half + _DEVIATIONS * stated.noise + slack
        remedy = "Compare scale, sign and unit with the maker's manual"
        self.close(f"{check}: value", value, actual, allowed, f"The unit is {unit}. {remedy}")

    def as_stated(self, check: str, stated: Accuracy) -> None:
        """Note whether an accuracy is the manual's, where the author gives that by the name of the check."""
        if (manual := self.manual.accuracies.get(check)) is not None:
            self.same_accuracy(check, stated, manual)

    def same_accuracy(self, check: str, stated: Accuracy, manual: Accuracy) -> None:
        """Note whether two accuracies are the same; their sources where the manual states one."""
        same = all(
            math.isclose(getattr(stated, part), getattr(manual, part), rel_tol=1e-6, abs_tol=1e-15)
            for part in ("gain", "offset", "resolution", "noise")
        ) and manual.source in ("", stated.source)
        self.that(f"{check}: accuracy as the manual states it", same, f"{stated} instead of {manual}", "Correct it")

    @contextmanager
    def refuses(
        self, check: str, *errors: type[BaseException], remedy: str, says: Collection[str] = ("",)
    ) -> Iterator[None]:
        """Note whether the block raises one of these errors, in words, and that `says` one of these."""
        names = " or ".join(error.__name__ for error in errors)
        try:
            yield
        except errors as error:
            what = error.what if isinstance(error, InstrumentError) else error
            said = in_words(what) and any(one in str(error) for one in says)
            self.that(check, said, f"the error says '{what}'", f"Say what was wrong in words: {' or '.join(says)}")
        except Exception as error:  # noqa: BLE001  whatever a driver raises is a finding
            self.that(check, False, f"{type(error).__name__} instead of {names}: {error}", remedy)
        else:
            self.that(check, False, f"no {names} was raised", remedy)

    def rejects(self, check: str, act: Callable[..., Any], *wrong: Sequence[Any]) -> None:
        """Note whether a method refuses each of these arguments, at the latest when the block that it gives is entered."""
        for arguments in wrong:
            with self.refuses(check, SetpointError, remedy="Check before anything is sent"):
                enter(act(*arguments))

    def report(self, subject: str) -> ConformanceReport:
        """Return what was found."""
        return ConformanceReport(subject, tuple(self.found.values()), tuple(self.unchecked))
