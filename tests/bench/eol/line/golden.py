"""Gates of golden motors with a history that no records hold."""

from collections.abc import Callable, Mapping, Sequence
from datetime import date, datetime
from pathlib import Path

from bench.eol.line.admission.golden_gate import GoldenGate, wall_time
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


def gate_of(
    folder: Path,
    table: str,
    sockets: Sequence[str],
    tests: NoGoldenTests | None = None,
    now: Callable[[], datetime] = wall_time,
) -> GoldenGate:
    """A gate by the small plan with a table of its own."""
    (folder / "motor.toml").write_bytes(MOTOR.read_bytes())
    path = folder / "gate.toml"
    path.write_text(PLAN.replace('"small"', '"gate"') + table, encoding="utf-8")
    return GoldenGate(load_plan(path), {}, sockets, tests or NoGoldenTests(), now)


def open_gate(folder: Path) -> GoldenGate:
    """A gate that is always open."""
    return gate_of(folder, "", ["1"])
