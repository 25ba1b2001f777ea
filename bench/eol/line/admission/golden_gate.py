"""The gate of each socket: no motor is taken there until a golden one has passed, at a shift's start and every few hours."""

from collections.abc import Mapping, Sequence
from datetime import date, datetime, timedelta
from typing import Protocol

from bench.eol.limits import ParameterLimits
from bench.eol.line.wall_clock import WallClock
from bench.eol.plan import Plan
from bench.eol.record import MotorRecord
from bench.eol.statistics.golden_limits import limits_of_history
from bench.eol.store.faults import FAULTS
from bench.eol.verdict import Verdict
from drivers.interfaces.text import Text, text

#: By so much a clock may be set without a word.
_DRIFT = timedelta(minutes=5)


class GoldenHistory(Protocol):
    """Golden motors in a station's records."""

    def last_passed(self, socket: str, now: datetime) -> datetime | None:
        """Return when (UTC) before `now` one passed at a socket, None where none has, or one did not pass since."""

    def history(self, socket: str, serial_number: str, tests: int, since: date | None) -> dict[str, Sequence[float]]:
        """Return its figures by parameter in its first tests there, nothing where there are too few."""


class GoldenGate:
    """Knows of each socket since when a golden motor is due there; always open where the plan names none.

    `limits` are the plan's, which hold until a golden motor has enough tests of its own.
    """

    def __init__(
        self,
        plan: Plan,
        limits: Mapping[str, ParameterLimits],
        sockets: Sequence[str],
        history: GoldenHistory,
        clock: WallClock | None = None,
    ) -> None:
        self._plan, self._rule, self._limits = plan, plan.golden_test, limits
        self._history, self._clock = history, clock or WallClock()
        self.sockets = frozenset(sockets)
        self._passed: dict[str, datetime | None] = {}
        #: How the clock stood when each passed: if it was set since, nobody knows how long ago that is, nor which shift this is.
        self._stood = dict.fromkeys(sockets, self._clock.standing())
        self._tested: dict[str, int] = dict.fromkeys(sockets, 0)
        if self._rule.serial_numbers:
            now = self._clock.now()
            self._passed = {socket: history.last_passed(socket, now + _DRIFT) for socket in sockets}

    def is_golden(self, serial_number: str) -> bool:
        """Tell whether a serial number is a golden motor's."""
        return serial_number in self._rule.serial_numbers

    def as_listed(self, serial_number: str) -> str:
        """Return the golden motor's serial number that this one differs from in capitals only, or itself where there is none.

        Scanned with Caps Lock on, a golden motor would be tested and counted as any other.
        """
        listed = self._rule.serial_numbers
        folded = serial_number.casefold()
        if serial_number in listed:
            return serial_number
        return next((golden for golden in listed if golden.casefold() == folded), serial_number)

    def due(self, socket: str) -> Text | None:
        """Return why a socket takes no motor but a golden one now, None where it takes any."""
        if not self._rule.serial_numbers:
            return None
        passed = self._passed.get(socket)
        now = self._clock.now()
        if passed is None:
            why = text("no golden motor has passed there with this plan yet, or the last one did not pass")
        elif passed > now + _DRIFT:
            time = passed.astimezone().strftime("%Y-%m-%d %H:%M")
            why = text("the last one passed there at {time}, which is still to come: the clock was put back", time=time)
        elif abs(moved := self._clock.standing() - self._stood[socket]) > _DRIFT:
            why = _set_by(moved)
        elif (start := self._shift_start(now)) is not None and passed < start:
            why = text("the shift began at {time}", time=start.astimezone().strftime("%H:%M"))
        elif now - passed >= timedelta(hours=self._rule.every):
            time = passed.astimezone().strftime("%Y-%m-%d %H:%M")
            why = text(
                "the last one passed there at {time}, and it is due every {hours:g} h",
                time=time,
                hours=self._rule.every,
            )
        else:
            return None
        return text(
            "a golden motor ({names}) is due at socket {socket}: {why}",
            names=", ".join(self._rule.serial_numbers),
            socket=socket,
            why=why,
        )

    def next_golden(self, socket: str) -> str:
        """Return the serial number of the golden motor whose turn it is at a socket."""
        return self._rule.serial_numbers[self._tested.get(socket, 0) % len(self._rule.serial_numbers)]

    def limits(self, serial_number: str, socket: str) -> Mapping[str, ParameterLimits]:
        """Return a golden motor's limits at a socket: from its own history there where it is long enough, else the plan's."""
        try:
            history = self._history.history(socket, serial_number, self._rule.tests, self._rule.since)
        except FAULTS:
            # The plan's limits are wider, and hold for it as for any motor.
            return self._limits
        # A figure that one of the tests lacks keeps the plan's.
        return {**self._limits, **limits_of_history(history)}

    def done(self, record: MotorRecord) -> None:
        """Take in a record that was kept."""
        if record.golden:
            self._tested[record.socket] = self._tested.get(record.socket, 0) + 1
            if record.verdict is Verdict.PASS:
                self._passed[record.socket] = record.ended
                self._stood[record.socket] = self._clock.standing()
            elif record.verdict is not Verdict.ABORTED:
                self._passed[record.socket] = None

    def _shift_start(self, now: datetime) -> datetime | None:
        """Return when (UTC) the present shift began."""
        here = now.astimezone()
        starts = [
            datetime.combine(here.date() - timedelta(days=day), start).astimezone()
            for start in self._rule.shifts
            for day in (0, 1)
        ]
        return max((start for start in starts if start <= here), default=None)


def _set_by(moved: timedelta) -> Text:
    minutes = round(abs(moved).total_seconds() / 60.0)
    if moved > timedelta():
        return text("the clock was set forward by {minutes} min after the last one had passed there", minutes=minutes)
    return text("the clock was put back by {minutes} min after the last one had passed there", minutes=minutes)
