"""A small plan, and a listener that keeps what it hears."""

import io
from collections.abc import Callable, Iterator
from contextlib import closing
from dataclasses import replace
from datetime import UTC, datetime
from pathlib import Path

import pytest

from bench.eol.line.admission.next_motor import RefusedSerial
from bench.eol.line.batch import run_batch
from bench.eol.line.batch_listener import BatchListener
from bench.eol.line.batch_log import BatchMotor
from bench.eol.line.counts import Counts
from bench.eol.line.preparation.prepare import BatchRequest
from bench.eol.line.workers.worker_process import ForkServer
from bench.eol.record import MotorRecord
from bench.eol.store.waiting import Waiting
from drivers.interfaces.text import Text

PLAN = """
[plan]
name = "small"
motor = "motor.toml"
guard = "shared"
minimum_ratio = 0.0
on_failure = "go_on"
keep_waveforms = "none"

[[procedure]]
name = "stator-resistance"
settings = { repeats = 1, aperture = "SHOR", winding_temperature = 25.0 }

[[procedure]]
name = "pole-pairs-back-emf"
every = 2

[[limit]]
parameter = "stator_resistance"
percent = 60.0

[[limit]]
parameter = "pole_pairs"
low = 4
high = 4

[virtual]
resistance = 3.0
"""
LINE = """
[line]
bench = "virtual"
sockets = 2
shared = ["lcr_meter"]
"""
MOTOR = Path(__file__).parents[4] / "docs" / "examples" / "eol" / "motor.toml"


class RecordingListener(BatchListener):
    """Keeps what it hears; `when_begun` is called as a motor begins."""

    def __init__(self) -> None:
        self.records: list[MotorRecord] = []
        self.refusals: list[RefusedSerial] = []
        self.troubles: list[str] = []
        self.noticed: list[str] = []
        self.waitings: list[Waiting] = []
        self.when_waits: Callable[[Waiting], None] = lambda _: None
        self.when_begun: Callable[[BatchMotor], None] = lambda _: None
        self.when_done: Callable[[MotorRecord], None] = lambda _: None

    def begun(self, motor: BatchMotor, socket: str) -> None:
        self.when_begun(motor)

    def done(self, record: MotorRecord) -> None:
        self.records.append(record)
        self.when_done(record)

    def refused(self, refused: RefusedSerial) -> None:
        self.refusals.append(refused)

    def waits(self, waiting: Waiting) -> None:
        self.waitings.append(waiting)
        self.when_waits(waiting)

    def noted(self, words: Text) -> None:
        self.noticed.append(str(words))

    def trouble(self, words: Text) -> None:
        self.troubles.append(str(words))


class Bench:
    """Runs batches of the small plan in a folder of its own."""

    def __init__(self, folder: Path, fork_server: ForkServer) -> None:
        self.folder = folder
        self.fork_server = fork_server
        (folder / "motor.toml").write_bytes(MOTOR.read_bytes())
        (folder / "plan.toml").write_text(PLAN, encoding="utf-8")
        (folder / "line.toml").write_text(LINE, encoding="utf-8")
        self.listener = RecordingListener()
        self.request = BatchRequest(
            plan=folder / "plan.toml",
            station=str(folder / "line.toml"),
            runs=folder / "runs",
            motors=4,
            seed=7,
            records=str(folder / "records.sqlite"),
        )

    def workers(self) -> set[int]:
        """Return the processes of the workers that are there."""
        content = Path(f"/proc/{self.fork_server.pid}/task/{self.fork_server.pid}/children").read_text(encoding="ascii")
        return {int(word) for word in content.split()}

    def run(self, typed: str = "", **changed: object) -> tuple[Counts, str]:
        return run_batch(replace(self.request, **changed), self.listener, io.StringIO(typed), self.fork_server)  # type: ignore[arg-type]


@pytest.fixture(scope="session")
def fork_server() -> Iterator[ForkServer]:
    """One for all batches: what a worker needs is loaded once."""
    with closing(ForkServer()) as fork_server:
        yield fork_server


@pytest.fixture
def bench(tmp_path: Path, fork_server: ForkServer) -> Bench:
    return Bench(tmp_path, fork_server)


@pytest.fixture
def make_bench(tmp_path: Path, fork_server: ForkServer) -> Callable[[str], Bench]:
    def make(name: str) -> Bench:
        folder = tmp_path / name
        folder.mkdir()
        return Bench(folder, fork_server)

    return make


@pytest.fixture
def timeless() -> Callable[[MotorRecord], MotorRecord]:
    """What of a record does not depend on when and where it was made."""

    def stripped(record: MotorRecord) -> MotorRecord:
        never = datetime(2000, 1, 1, tzinfo=UTC)
        return replace(record, identifier="", started=never, ended=never, run="", journal_sha256="", waveforms={})

    return stripped
