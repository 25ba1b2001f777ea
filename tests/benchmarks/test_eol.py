"""The end of a line: `pytest tests/benchmarks/test_eol.py --benchmark-enable -n 0` on a machine with nothing else to do.

Motors a second through the whole example plan with 4 sockets, what a record costs in SQLite, and what 100 000 motors leave in
the coordinator's memory.
"""

import gc
import io
import os
import threading
import tracemalloc
import uuid
from collections.abc import Sequence
from contextlib import closing
from dataclasses import replace
from datetime import UTC, datetime
from multiprocessing.connection import Connection, Pipe
from pathlib import Path
from typing import Any

import pytest

from bench.eol.line.admission.admission_desk import AdmissionDesk
from bench.eol.line.admission.golden_gate import GoldenGate
from bench.eol.line.admission.next_motor import Admission, RefusedSerial
from bench.eol.line.admission.serial_numbers import generated_serials
from bench.eol.line.batch import run_batch
from bench.eol.line.batch_listener import BatchListener
from bench.eol.line.batch_log import BatchLog
from bench.eol.line.coordinator import Coordinator
from bench.eol.line.preparation.line_file import load_line
from bench.eol.line.preparation.prepare import BatchRequest
from bench.eol.line.record_writer import RecordWriter
from bench.eol.line.workers.messages import Batch, MotorDone, NoMoreMotors, Ready, Task, WorkerSetup
from bench.eol.line.workers.worker_process import ForkServer
from bench.eol.plan import load_plan
from bench.eol.record import CheckRecord, MeasuredFigure, MotorRecord
from bench.eol.store.claims import SerialClaim
from bench.eol.store.database import open_database
from bench.eol.store.earlier_tests import EarlierTest
from bench.eol.store.spool import Spool
from bench.eol.verdict import Verdict
from bench.motor.motor_file import load_motor
from drivers.interfaces.text import Text
from tests.bench.eol.line.golden import NoGoldenTests

EXAMPLE = Path(__file__).parents[2] / "docs" / "examples" / "eol"


class TroubleListener(BatchListener):
    """Keeps what went wrong and nothing else."""

    def __init__(self) -> None:
        self.troubles: list[str] = []

    def refused(self, refused: RefusedSerial) -> None:
        self.troubles.append(str(refused.why))

    def trouble(self, words: Text) -> None:
        self.troubles.append(str(words))


def enabled(config: pytest.Config) -> bool:
    return bool(config.getoption("--benchmark-enable"))


def test_motors_a_second_with_four_sockets(benchmark: Any, tmp_path: Path, request: pytest.FixtureRequest) -> None:
    motors, sockets = (200, 4) if enabled(request.config) else (2, 1)
    listener = TroubleListener()

    def batch() -> None:
        request = BatchRequest(
            EXAMPLE / "plan.toml",
            "virtual",
            tmp_path,
            sockets=sockets,
            motors=motors,
            records=str(tmp_path / "r.sqlite"),
        )
        counts, stopped = run_batch(request, listener, io.StringIO())
        assert (counts.motors, stopped, listener.troubles) == (motors, "", [])

    benchmark.pedantic(batch, rounds=1)
    if benchmark.stats is not None:
        benchmark.extra_info["motors_per_second"] = motors / benchmark.stats.stats.mean


def a_record(number: int, batch: str) -> MotorRecord:
    now = datetime.now(UTC)
    measured = tuple(
        MeasuredFigure(f"parameter_{k}", 1.0 + 0.01 * k, "Ω", 1e-3, 2e-3, 0.5, 1.5, Verdict.PASS) for k in range(13)
    )
    checks = tuple(CheckRecord(f"procedure-{k}", 1, Verdict.PASS, 10.0) for k in range(6))
    return MotorRecord(
        str(uuid.uuid4()), batch, number, "plan", "0" * 64, "line", "1", "", "LG-400W", f"V{number:06d}", now, now,
        Verdict.PASS, True, 60.0, measured, checks, "", "runs/b/000/000001-V000001", "0" * 64,
    )  # fmt: skip


def test_a_record_in_sqlite(benchmark: Any, tmp_path: Path) -> None:
    writer = RecordWriter(
        open_database(str(tmp_path / "records.sqlite")), Spool(tmp_path / "unstored", "records.sqlite")
    )
    numbers = iter(range(1, 1_000_000))

    def fresh() -> tuple[tuple[MotorRecord], dict[str, Any]]:
        return (a_record(next(numbers), "b"),), {}

    benchmark.pedantic(writer.save, setup=fresh, rounds=200)
    assert writer.records.count("b") >= 1
    writer.close()


def test_two_thousand_records_leave_nothing_in_the_writer_s_memory(
    benchmark: Any, tmp_path: Path, request: pytest.FixtureRequest
) -> None:
    motors = 2000 if enabled(request.config) else 300
    writer = RecordWriter(
        open_database(str(tmp_path / "records.sqlite")), Spool(tmp_path / "unstored", "records.sqlite")
    )
    held: list[int] = []

    def batch() -> None:
        tracemalloc.start()
        for number in range(1, motors + 1):
            writer.save(a_record(number, "b"))
            if number in (motors // 4, motors):
                gc.collect()
                held.append(tracemalloc.get_traced_memory()[0])
        tracemalloc.stop()

    benchmark.pedantic(batch, rounds=1)
    assert writer.records.count("b") == motors
    writer.close()
    benchmark.extra_info["bytes_more_after_the_first_quarter"] = held[1] - held[0]
    assert held[1] - held[0] < 200_000


class QuickWorker:
    """In place of a worker's process: a thread that measures nothing and is done at once."""

    def __init__(self, fork_server: ForkServer, setup: WorkerSetup, status: int, owner: Sequence[int] = ()) -> None:
        self.connection, self._far = Pipe()
        self.lifeline, self._end = os.pipe()
        threading.Thread(target=self._work, args=(self._far,), daemon=True).start()

    def send(self, message: Any) -> None:
        self.connection.send(message)

    def close(self) -> str:
        self.connection.close()
        os.close(self.lifeline)
        return ""

    def _work(self, far: Connection) -> None:
        far.send(Ready())
        while not isinstance(message := far.recv(), NoMoreMotors):
            if isinstance(message, Task):
                record = replace(a_record(message.number, "b"), serial_number=message.serial_number)
                far.send(MotorDone(record, message.at + 60.0))
        far.close()
        os.close(self._end)


def resident() -> float:
    """Return the memory (MiB) that this process has."""
    return int(Path("/proc/self/statm").read_text(encoding="ascii").split()[1]) * os.sysconf("SC_PAGE_SIZE") / 2**20


def test_a_hundred_thousand_motors_leave_nothing_in_memory(
    benchmark: Any, tmp_path: Path, monkeypatch: pytest.MonkeyPatch, request: pytest.FixtureRequest
) -> None:
    monkeypatch.setattr("bench.eol.line.workers.worker_slots.WorkerProcess", QuickWorker)
    motors = 100_000 if enabled(request.config) else 400
    plan = load_plan(EXAMPLE / "plan.toml")
    line = load_line("virtual", 4)
    listener, seen = TroubleListener(), dict[int, float]()
    log = BatchLog(tmp_path / "b", {"plan": plan.sha256})
    batch_request = BatchRequest(EXAMPLE / "plan.toml", "virtual", tmp_path)
    batch = Batch("b", log.uid, plan, {}, load_motor(plan.motor), line.name, str(tmp_path / "b"), batch_request)

    class NoRegister:
        """Knows of no tests, so that only the coordinator is measured."""

        def claim(self, wanted: SerialClaim, *, by_person: bool = False) -> None:
            return None

        def release(self, claim: SerialClaim) -> None:
            pass

        def tests_here(self, serial_number: str) -> list[EarlierTest]:
            return []

        def tests_elsewhere(self, serial_number: str) -> list[EarlierTest]:
            return []

    class Counting:
        count = 0

        def save(self, record: MotorRecord) -> None:
            self.count += 1
            if self.count in (motors // 10, motors):
                seen[self.count] = resident()

    writer = Counting()
    serials = generated_serials("V{number:06d}", motors)
    desk = AdmissionDesk(NoRegister(), plan.check_serial, log.identifier, listener.trouble, "b", line.name, "LG-400W")
    gate = GoldenGate(plan, {}, [socket.name for socket in line.sockets], NoGoldenTests())
    admission = Admission(serials, [], desk, gate)
    with closing(ForkServer()) as fork_server:
        coordinator = Coordinator(line, batch, plan.checks, admission, writer, log, listener, fork_server)
        benchmark.pedantic(coordinator.run, rounds=1)
    log.close()
    assert (writer.count, listener.troubles) == (motors, [])
    benchmark.extra_info["mib_more_after_the_first_tenth"] = seen[motors] - seen[motors // 10]
    assert seen[motors] - seen[motors // 10] < 8.0
