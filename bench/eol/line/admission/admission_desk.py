"""Admission of a serial number: its pattern, another test of it in progress, and its earlier tests."""

from collections.abc import Callable, Sequence
from dataclasses import dataclass, field, replace
from datetime import UTC, datetime
from typing import Protocol, TypeVar

from bench.eol.admission_rule import AdmittedTest, RefusedTest, decide, in_other_capitals_tested, under_test
from bench.eol.plan_file import RetestSection
from bench.eol.serial_number import spelled
from bench.eol.store.claims import SerialClaim
from bench.eol.store.earlier_tests import EarlierTest, in_order
from bench.eol.store.faults import StoreError
from bench.eol.verdict import Verdict
from bench.i18n.errors import InputError
from drivers.interfaces.text import Text, lines, text, text_of

_Answer = TypeVar("_Answer")


class ClaimRegister(Protocol):
    """Claims serial numbers and tells of their earlier tests; each method raises StoreError."""

    def claim(self, wanted: SerialClaim, *, by_person: bool = False) -> SerialClaim | None:
        """Claim a serial number; return who has it instead."""

    def release(self, claim: SerialClaim) -> None:
        """Release the claim."""

    def tests_here(self, serial_number: str) -> list[EarlierTest]:
        """Return its tests at this station."""

    def tests_elsewhere(self, serial_number: str) -> list[EarlierTest]:
        """Return its tests that the server knows of."""


@dataclass
class AdmissionDesk:
    """Decides for one batch of a station; `person` answers for motors that the plan's rule refuses, empty where nobody does.

    `check` refuses what is no serial number of the plan (InputError), `identifier` gives a motor's record's; `trouble` is called
    with what could not be looked up. With `spelling_stated` the plan itself says which serial numbers it takes, capitals and all.
    """

    register: ClaimRegister
    check: Callable[[str], None]
    identifier: Callable[[int], str]
    trouble: Callable[[Text], None]
    batch: str
    station: str
    model: str
    rule: RetestSection = field(default_factory=RetestSection)
    person: str = ""
    spelling_stated: bool = False
    _permitted: dict[str, str] = field(default_factory=dict)
    _reported: str = ""

    def permit(self, serial_number: str, person: str) -> None:
        """Accept a person's responsibility for one serial number the next time it comes, from any thread."""
        self._permitted[spelled(serial_number)] = person

    def admit(self, serial_number: str, number: int, socket: str, person: str = "") -> AdmittedTest | RefusedTest:
        """Admit a serial number as the batch's motor of this number, or say why not; a `person` had permitted it before."""
        person = self._permitted.pop(serial_number, "") or person or self.person
        try:
            self.check(serial_number)
        except InputError as error:
            return RefusedTest(text_of(error))
        claim = SerialClaim(
            serial_number, self.identifier(number), self.batch, number, self.station, socket, datetime.now(UTC)
        )
        # Claimed before anything is looked up: whoever claims it after this one finds its record.
        faults: list[StoreError] = []
        holder = _asked(lambda: self.register.claim(claim, by_person=bool(person)), None, faults)
        if holder is not None:
            return RefusedTest(under_test(holder), by_person=True)
        none: Sequence[EarlierTest] = ()
        here = _asked(lambda: self.register.tests_here(serial_number), none, faults)
        elsewhere = _asked(lambda: self.register.tests_elsewhere(serial_number), none, faults)
        unknown = self._unknown(serial_number, faults)
        known = in_order([*here, *elsewhere])
        earlier = [test for test in known if test.is_of(serial_number)]
        decision = unknown or decide(serial_number, self.model, earlier, self.rule, person)
        if not earlier and known and isinstance(decision, AdmittedTest):
            decision = self._beside_another(serial_number, known, decision, person)
        if isinstance(decision, RefusedTest):
            _asked(lambda: self.register.release(claim), None, [])
            own = [test for test in earlier if test.identifier == self.identifier(test.number)]
            decision = replace(decision, judged=any(test.verdict in (Verdict.PASS, Verdict.FAIL) for test in own))
            if not own and earlier and earlier[-1].batch == self.batch:
                other = text("this batch {batch} is another one of the same name", batch=self.batch)
                decision = replace(decision, why=lines((decision.why, other), between="; "))
        return decision

    def _beside_another(
        self, serial_number: str, other: Sequence[EarlierTest], decision: AdmittedTest, person: str
    ) -> AdmittedTest | RefusedTest:
        """Refuse a motor that is probably a tested one, scanned with Caps Lock on, unless a plan's pattern or a person takes it."""
        words = in_other_capitals_tested(serial_number, other)
        if self.spelling_stated:
            self.trouble(words)
            return decision
        if person:
            return replace(decision, again_by=person)
        how = text(
            "if it is another motor, a person must take the responsibility (--again --person NAME), or the plan must state which serial "
            "numbers it takes (serial_pattern)"
        )
        return RefusedTest(lines((words, how), between="; "), by_person=True)

    def _unknown(self, serial_number: str, faults: Sequence[StoreError]) -> RefusedTest | None:
        """Say what could not be looked up, and refuse the motor where the plan has it so."""
        if not faults:
            if self._reported:
                self.trouble(
                    text("from serial number {serial} on, earlier tests are looked up again", serial=serial_number)
                )
            self._reported = ""
            return None
        why = text_of(faults[0])
        if self.rule.unknown == "refuse":
            return RefusedTest(
                text(
                    "serial number {serial} is refused, because the records that would show an earlier test "
                    "cannot be read: {error}",
                    serial=serial_number,
                    error=why,
                )
            )
        if str(why) != self._reported:
            self._reported = str(why)
            self.trouble(
                text(
                    "serial number {serial} and those after it are measured, although the records that would "
                    "show an earlier test cannot be read: {error}",
                    serial=serial_number,
                    error=why,
                )
            )
        return None


def _asked(ask: Callable[[], _Answer], otherwise: _Answer, faults: list[StoreError]) -> _Answer:
    try:
        return ask()
    except StoreError as error:
        faults.append(error)
        return otherwise
