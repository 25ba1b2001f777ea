"""Yields by motor while records come in: a motor counts once, however often it is tested."""

from bench.eol.record import MotorRecord
from bench.eol.verdict import Verdict


class MotorYield:
    """Counts the motors that were judged, those that passed at their first judgement, and those that passed in the end.

    A test that came to no verdict says nothing of its motor, and golden motors are none of the batch's.
    """

    def __init__(self) -> None:
        self._passes: dict[str, bool] = {}
        self.first_pass = 0
        self.final = 0

    @property
    def motors(self) -> int:
        """The motors that were judged."""
        return len(self._passes)

    def add(self, record: MotorRecord) -> None:
        """Take in a record, in the order in which they are kept."""
        if record.golden or record.verdict not in (Verdict.PASS, Verdict.FAIL):
            return
        passed = record.verdict is Verdict.PASS
        before = self._passes.get(record.serial_number)
        if before is None:
            # One that a person has tested again was judged in an earlier batch.
            self.first_pass += record.first_pass and not record.again_by
        self.final += passed - bool(before)
        self._passes[record.serial_number] = passed
