"""Gates of golden motors with a history that no records hold."""

from collections.abc import Callable, Mapping, Sequence
from datetime import UTC, date, datetime, timedelta
from pathlib import Path

from bench.eol.line.admission.golden_gate import GoldenGate
from bench.eol.line.wall_clock import WallClock
from bench.eol.plan import load_plan
from tests.bench.eol.line.conftest import MOTOR, PLAN


class NoGoldenTests:
    """A station at which no golden motor was tested, unless one passed at a time."""

    def __init__(
        self, passed: Mapping[str, datetime] | None = None, figures: Mapping[str, Sequence[float]] | None = None
    ):
        self.passed, self.figures = dict(passed or {}), dict(figures or {})

    def last_passed(self, socket: str, now: datetime) -> datetime | None:
        return self.passed.get(socket)

    def history(self, socket: str, serial_number: str, tests: int, since: date | None) -> Mapping[str, Sequence[float]]:
        return self.figures


class SetClock(WallClock):
    """A clock that a test sets: by a time alone it goes as it should; `running` has it set to that time while less has passed."""

    def __init__(self, now: Callable[[], datetime], running: Callable[[], timedelta] | None = None) -> None:
        self._told, self._ran = now, running

    def now(self) -> datetime:
        return self._told()

    def running(self) -> timedelta:
        return self._ran() if self._ran else self._told() - datetime(2000, 1, 1, tzinfo=UTC)


def gate_of(
    folder: Path,
    table: str,
    sockets: Sequence[str],
    tests: NoGoldenTests | None = None,
    clock: WallClock | None = None,
) -> GoldenGate:
    """A gate by the small plan with a table of its own."""
    (folder / "motor.toml").write_bytes(MOTOR.read_bytes())
    path = folder / "gate.toml"
    path.write_text(PLAN.replace('"small"', '"gate"') + table, encoding="utf-8")
    return GoldenGate(load_plan(path), {}, sockets, tests or NoGoldenTests(), clock)


def open_gate(folder: Path) -> GoldenGate:
    """A gate that is always open."""
    return gate_of(folder, "", ["1"])
