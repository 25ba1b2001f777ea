"""Rule of whether a motor may be tested: one for all stations and databases, out of what is known of its serial number."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass

from bench.eol.plan_file import RetestSection
from bench.eol.store.claims import STALE_BY_PERSON, SerialClaim
from bench.eol.store.earlier_tests import EarlierTest
from bench.eol.verdict import Verdict
from drivers.interfaces.text import Text, lines, text

VERDICTS: Mapping[Verdict, Text] = {
    Verdict.PASS: text("pass"),
    Verdict.FAIL: text("fail"),
    Verdict.ERROR: text("error"),
    Verdict.ABORTED: text("aborted"),
}
_JUDGED = (Verdict.PASS, Verdict.FAIL)


@dataclass(frozen=True)
class AdmittedTest:
    """A motor may be tested; it is the serial number's test of this number, permitted by a person or by the plan.

    `judged_before` tells that an earlier test came to a verdict.
    """

    test_number: int = 1
    again_by: str = ""
    judged_before: bool = False


@dataclass(frozen=True)
class RefusedTest:
    """A motor may not be tested, and why; a person may answer for it where that is said.

    `judged` tells that its batch has it tested already, with a verdict.
    """

    why: Text
    by_person: bool = False
    judged: bool = False


def decide(
    serial_number: str, model: str, earlier: Sequence[EarlierTest], rule: RetestSection, person: str = ""
) -> AdmittedTest | RefusedTest:
    """Decide on a serial number with the `earlier` tests, in their order; `person` is who answers for one that the rule refuses.

    What was found good or bad stays so until the rule or a person has it tested again; a test that came to no verdict
    leaves the permission it had.
    """
    number, judged = len(earlier) + 1, any(test.verdict in _JUDGED for test in earlier)
    if not earlier:
        return AdmittedTest()
    last = earlier[-1]
    if last.model != model:
        # Nobody can answer for that: the limits are another type's.
        return RefusedTest(
            text(
                "serial number {serial} is a motor of the type {model}, but this plan is for {planned}; {tested}",
                serial=serial_number,
                model=last.model,
                planned=model,
                tested=_tested(serial_number, earlier),
            )
        )
    forbidden = _forbidden(earlier, rule)
    if forbidden is None:
        return AdmittedTest(number, judged_before=judged)
    if person:
        return AdmittedTest(number, person, judged)
    return RefusedTest(
        lines(
            (
                _tested(serial_number, earlier),
                forbidden,
                text("to test it anyway, a person must take the responsibility: --again --person NAME"),
            ),
            between="; ",
        ),
        by_person=True,
    )


def in_other_capitals_tested(serial_number: str, other: Sequence[EarlierTest]) -> Text:
    """Return what is said of a serial number that differs from one with these tests, in their order, in capitals only."""
    return text(
        "serial number {serial} differs from {known} in capitals only, and would be another motor; {tested}. If it is the same motor, "
        "scan {known}",
        serial=serial_number,
        known=other[-1].serial_number,
        tested=_tested(other[-1].serial_number, other),
    )


def takes_again(verdict: Verdict, test_number: int, rule: RetestSection) -> bool:
    """Tell whether a test came to no verdict on the motor, and the rule takes it again by itself."""
    if verdict in _JUDGED or verdict.value not in rule.verdicts:
        return False
    return verdict is Verdict.ABORTED or test_number < rule.most_tests


def under_test(claim: SerialClaim) -> Text:
    """Return why a serial number that somebody else tests now is refused."""
    return text(
        "serial number {serial} is under test at station {station}, socket {socket}, as motor {number} of batch {batch} "
        "since {time}. If that test has ended without a record, continue that batch, or {minutes} minutes after the beginning let a named "
        "person take the motor: --again --person NAME",
        serial=claim.serial_number,
        station=claim.station,
        socket=claim.socket,
        number=claim.number,
        batch=claim.batch,
        time=claim.since.astimezone().strftime("%Y-%m-%d %H:%M"),
        minutes=round(STALE_BY_PERSON.total_seconds() / 60.0),
    )


def _forbidden(earlier: Sequence[EarlierTest], rule: RetestSection) -> Text | None:
    """Return why the rule does not take a motor again, None where it does."""
    counted = sum(test.verdict is not Verdict.ABORTED for test in earlier)
    if counted >= rule.most_tests:
        return text("the plan allows {most} tests of a motor (again.most_tests)", most=rule.most_tests)
    permitted, closed_by = True, Verdict.PASS
    for test in earlier:
        if test.verdict not in _JUDGED and not (permitted or test.again_by):
            # It was made without anybody knowing of those before it.
            continue
        permitted = test.verdict.value in rule.verdicts
        closed_by = closed_by if permitted else test.verdict
    return None if permitted else _not_after(closed_by, rule)


def _not_after(verdict: Verdict, rule: RetestSection) -> Text:
    allowed = ", ".join(sorted(rule.verdicts)) or "–"
    return text(
        "after the verdict {verdict} the plan does not test a motor again (again.verdicts: {allowed})",
        verdict=VERDICTS[verdict],
        allowed=allowed,
    )


def _tested(serial_number: str, earlier: Sequence[EarlierTest]) -> Text:
    last = earlier[-1]
    words = text(
        "serial number {serial} was tested before: {verdict} at station {station}, socket {socket}, on {time}, as motor "
        "{number} of batch {batch}",
        serial=serial_number,
        verdict=VERDICTS[last.verdict],
        station=last.station,
        socket=last.socket,
        time=last.started.astimezone().strftime("%Y-%m-%d %H:%M"),
        number=last.number,
        batch=last.batch,
    )
    if len(earlier) == 1:
        return words
    return text("{words} (test {count} of it)", words=words, count=len(earlier))
