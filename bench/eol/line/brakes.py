"""Brakes: too many motors in a row that did not pass tell of the station or of a lot, and not of these motors."""

from collections import Counter
from collections.abc import Iterator, Sequence
from dataclasses import dataclass

from bench.eol.plan_file import BrakeSection
from bench.eol.record import MotorRecord
from bench.eol.told_causes import cause_of
from bench.eol.verdict import Verdict
from drivers.interfaces.text import Text, text

#: A golden motor that does not pass is tested once more; the socket is not to be trusted then.
_GOLDEN_TESTS = 2


@dataclass(frozen=True)
class AppliedBrake:
    """The reason why a socket takes no more motors, or the whole line if none is named."""

    socket: str
    why: Text


def left_on(record: MotorRecord, what: Sequence[str]) -> AppliedBrake:
    """Return the brake of a socket at which something could not be switched off: nobody is to touch the next motor there."""
    return AppliedBrake(
        record.socket,
        text(
            "socket {socket} takes no more motors: after {serial}, {what}. It may still be on: switch it off by hand, at the mains "
            "switch or with the emergency stop, before anybody touches the motor",
            socket=record.socket,
            serial=record.serial_number,
            what="; ".join(what),
        ),
    )


class Brakes:
    """Counts, at each socket and over the line, the motors in a row that failed or could not be measured.

    One that could not be measured ends no row of failed ones, and one that was aborted ends none at all.
    """

    def __init__(self, rule: BrakeSection) -> None:
        self._of_line = rule.line_fails, rule.line_errors
        self._of_socket = rule.socket_fails, rule.socket_errors
        self._rows: dict[str, tuple[int, int]] = {}
        self._golden: Counter[str] = Counter()

    def observe(self, record: MotorRecord) -> Iterator[AppliedBrake]:
        """Take in a record; give the brakes that apply from now on."""
        if record.verdict is Verdict.ABORTED:
            return
        if record.golden:
            yield from self._observe_golden(record)
            return
        for where, most in ((record.socket, self._of_socket), ("", self._of_line)):
            bad, unmeasured = self._rows.get(where, (0, 0))
            bad = 0 if record.verdict is Verdict.PASS else bad + 1
            unmeasured = unmeasured + 1 if record.verdict is Verdict.ERROR else 0
            self._rows[where] = bad, unmeasured
            if unmeasured and unmeasured == most[1]:
                happened = text("{count} motors in a row could not be measured", count=unmeasured)
                yield AppliedBrake(where, _words(where, record, happened))
            elif bad and bad == most[0]:
                yield AppliedBrake(
                    where, _words(where, record, text("{count} motors in a row did not pass", count=bad))
                )

    def _observe_golden(self, record: MotorRecord) -> Iterator[AppliedBrake]:
        if record.verdict is Verdict.PASS:
            self._golden[record.socket] = 0
            return
        self._golden[record.socket] += 1
        if self._golden[record.socket] == _GOLDEN_TESTS:
            yield AppliedBrake(
                record.socket,
                text(
                    "socket {socket} takes no more motors: no golden motor passed there in {count} tests, the last one was "
                    "{serial}: {cause}",
                    socket=record.socket,
                    count=_GOLDEN_TESTS,
                    serial=record.serial_number,
                    cause=cause_of(record),
                ),
            )


def _words(where: str, record: MotorRecord, happened: Text) -> Text:
    if where:
        return text(
            "socket {socket} takes no more motors: {happened}, the last one was {serial}: {cause}",
            socket=where,
            happened=happened,
            serial=record.serial_number,
            cause=cause_of(record),
        )
    return text(
        "the line takes no more motors: {happened}, the last one was {serial} at socket {socket}: {cause}",
        happened=happened,
        serial=record.serial_number,
        socket=record.socket,
        cause=cause_of(record),
    )
