"""Yields by motor while records come in: a motor counts once, however often it is tested."""

from bench.eol.record import MotorRecord
from bench.eol.verdict import Verdict


class MotorYield:
    """Counts the motors that were judged, those of them that never were before, and what passed.

    A test that came to no verdict says nothing of its motor, and golden motors are none of the batch's. `first_pass` are those
    of the `new` motors that passed at once, `final` those of all that passed in the end.
    """

    def __init__(self) -> None:
        self._passes: dict[str, bool] = {}
        self._judged_before: set[str] = set()
        self.new = 0
        self.first_pass = 0
        self.final = 0

    @property
    def motors(self) -> int:
        """The motors that were judged."""
        return len(self._passes)

    def judged_before(self, serial_number: str) -> None:
        """Note that the records have a verdict on a motor, before its record comes."""
        self._judged_before.add(serial_number)

    def add(self, record: MotorRecord) -> None:
        """Take in a record, in the order in which they are kept."""
        if record.golden or record.verdict not in (Verdict.PASS, Verdict.FAIL):
            return
        serial_number, passed = record.serial_number, record.verdict is Verdict.PASS
        before = self._passes.get(serial_number)
        if before is None and serial_number not in self._judged_before:
            self.new += 1
            self.first_pass += record.first_pass
        self.final += passed - bool(before)
        self._passes[serial_number] = passed
