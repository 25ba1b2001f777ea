"""A line of real sockets: a worker that dies or freezes while something is energised, and its guardian."""

import json
import os
import re
import signal
import subprocess
import sys
import threading
from collections.abc import Callable, Iterator
from contextlib import contextmanager, suppress
from datetime import datetime
from pathlib import Path
from typing import Any

import pytest
from tomli_w import dumps as toml_text

from bench.eol.line.batch_log import BatchMotor
from bench.eol.line.counts import Counts
from bench.eol.line.workers import worker_slots
from bench.eol.verdict import Verdict
from bench.journal.guardian_record import read_guardian
from bench.motor.motor_file import load_motor
from bench.safety.ownership.claims import claims_of
from bench.safety.ownership.owner import HeldError, holders, owning
from bench.safety.ownership.state_folder import state_folder
from bench.station.station_file import load_station
from bench.virtual.virtual_station import describe
from sim_instruments.server.served_bench import ServedBench
from tests.bench.eol.wire import Wire

PLAN = """
[plan]
name = "small"
motor = "motor.toml"
guard = "shared"
on_failure = "go_on"

[[procedure]]
name = "stator-resistance-dc"
settings = { levels = 3, settle = 0.03, wiring_settle = 0.03, winding_temperature = 25.0 }
"""


@contextmanager
def served_line(
    bench: Any, wires: list[Wire] | None = None
) -> Iterator[Callable[[], tuple[Counts, str, dict[str, Any]]]]:
    """Give what runs two motors on a served virtual bench: counts, why it was stopped, and the bench's truth after it.

    The supply's wire is put into `wires`, where that is given.
    """
    (bench.folder / "plan.toml").write_text(PLAN, encoding="utf-8")
    (bench.folder / "serials.txt").write_text("R1\nR2\n", encoding="utf-8")
    station = bench.folder / "station.toml"
    motor = load_motor(str(bench.folder / "motor.toml"))
    with ServedBench(motor.virtual_motor(), speedup=10.0, fixture=True, pages={"/motor": {"truth": {}}}) as served:
        described = describe(served.preferred(), served.control, served.interlocks())
        for entry in described["instruments"].values():
            # The bench is served by this process, which a busy machine may hold up: that is no instrument's silence here.
            entry["reply_time"] = 5.0
        if wires is not None:
            supply = described["instruments"]["supply"]
            name, port = re.findall(r"::(hislip0),(\d+)::", supply["address"])[0]
            wires.append(Wire("127.0.0.1", int(port)))
            supply["address"] = f"TCPIP0::127.0.0.1::{name},{wires[0].port}::INSTR"
        station.write_text(toml_text(described), encoding="utf-8")

        def run() -> tuple[Counts, str, dict[str, Any]]:
            counts, stopped = bench.run(station=str(station), serials=str(bench.folder / "serials.txt"), motors=None)
            return counts, stopped, served.bench.world.truth()

        yield run


def folder_of(bench: Any, serial: str) -> Path:
    return Path(bench.folder / "runs" / "small" / "000" / f"000001-{serial}")


def when_energised(bench: Any, act: Callable[[int], None]) -> threading.Event:
    """Have something done to the first motor's worker as soon as it has energised something."""
    done = threading.Event()

    def begun(motor: BatchMotor) -> None:
        if motor.number > 1:
            return
        journal = folder_of(bench, motor.serial_number) / "journal.jsonl"

        def watch() -> None:
            pause = threading.Event()
            for _ in range(1200):
                if journal.is_file() and b'"kind":"energised"' in journal.read_bytes():
                    (worker,) = bench.workers()
                    act(worker)
                    done.set()
                    return
                pause.wait(0.05)

        threading.Thread(target=watch, daemon=True).start()

    bench.listener.when_begun = begun
    return done


def guardian_events(bench: Any) -> list[dict[str, Any]]:
    content = (folder_of(bench, "R1") / "guardian.jsonl").read_text(encoding="utf-8")
    return [json.loads(line) for line in content.splitlines()]


def kill(worker: int) -> None:
    os.kill(worker, signal.SIGKILL)


def freeze(worker: int) -> None:
    os.kill(worker, signal.SIGSTOP)


def thaw(frozen: list[int]) -> None:
    for process in frozen:
        with suppress(ProcessLookupError):
            os.kill(process, signal.SIGCONT)


def all_have_let_go() -> None:
    """Wait until no guardian is at its instruments any more."""
    pause = threading.Event()
    while holders(state_folder()):
        pause.wait(0.05)


@pytest.mark.parametrize(
    ("act", "cause"),
    [(kill, "was ended by SIGKILL"), (freeze, "did not respond for 2 s and was ended by SIGKILL")],
)
def test_a_motor_is_done_with_only_after_its_guardian_is(
    bench: Any, monkeypatch: pytest.MonkeyPatch, act: Callable[[int], None], cause: str
) -> None:
    monkeypatch.setattr(worker_slots, "_SILENCE_LIMIT", 2.0)
    acted = when_energised(bench, act)
    with served_line(bench) as run:
        counts, stopped, truth = run()
    assert not truth["output_on"]
    assert acted.is_set()
    assert stopped == ""
    assert counts.motors == 2
    lost, measured = bench.listener.records
    assert lost.verdict is Verdict.ERROR
    assert f"{cause}, in Stator resistance, four-wire direct current at step S1/2" in lost.cause
    assert (measured.verdict, measured.cause) == (Verdict.PASS, "")
    events = guardian_events(bench)
    assert [event["kind"] for event in events if event["kind"] in ("took", "walked", "left")] == [
        "took",
        "walked",
        "left",
    ]
    assert datetime.fromisoformat(events[-1]["wall"]) <= lost.ended
    assert measured.started >= lost.ended


@pytest.mark.parametrize("killed", [False, True])
def test_a_socket_whose_supply_could_not_be_switched_off_takes_no_other_motor(bench: Any, killed: bool) -> None:
    """Its network is unplugged while it feeds: neither the run nor its guardian reaches it, and it stays on."""
    wires: list[Wire] = []

    def unplug(worker: int) -> None:
        wires[0].cut()
        if killed:
            kill(worker)

    acted = when_energised(bench, unplug)
    with served_line(bench, wires) as run:
        counts, _, truth = run()
        assert acted.is_set()
        assert truth["output_on"], "otherwise nothing is to be said"
    (lost,) = bench.listener.records
    assert (lost.serial_number, lost.verdict, counts.unfinished) == ("R1", Verdict.ERROR, True)
    (brake,) = counts.brakes
    assert brake.socket == "1"
    assert "socket 1 takes no more motors: after R1, supply could not be made safe (output_off)" in str(brake.why)
    assert "It may still be on: switch it off by hand" in str(brake.why)


def test_a_batch_ends_at_the_second_request_although_worker_and_guardian_are_frozen(
    bench: Any, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(worker_slots, "_SILENCE_LIMIT", 60.0)
    monkeypatch.setattr(worker_slots, "_STOP_LIMIT", 1.0)
    frozen: list[int] = []

    def freeze_both(worker: int) -> None:
        children = [Path(task, "children").read_text() for task in Path(f"/proc/{worker}/task").iterdir()]
        frozen.extend(int(word) for word in " ".join(children).split())
        for process in (*frozen, worker):
            freeze(process)
        # Two that are pending at once would be one.
        pause, requested = threading.Event(), signal.getsignal(signal.SIGINT).__self__  # type: ignore[union-attr]
        for count in (1, 2):
            os.kill(os.getpid(), signal.SIGINT)
            while requested.count < count:
                pause.wait(0.01)

    when_energised(bench, freeze_both)
    try:
        with served_line(bench) as run:
            _, stopped, _ = run()
            thaw(frozen)
            all_have_let_go()
    finally:
        thaw(frozen)
    assert len(frozen) == 1, "the worker has one child, its guardian"
    assert stopped == "Ctrl-C"
    (lost,) = bench.listener.records
    assert lost.verdict is Verdict.ABORTED
    assert "had not ended 1 s after the second request to stop and was ended by SIGKILL" in lost.cause
    assert any(
        "its guardian has not ended for 1 s; check that everything" in words for words in bench.listener.troubles
    )


@pytest.mark.slow
def test_a_batch_has_the_instruments_of_all_its_sockets(bench: Any) -> None:
    claims: list[Any] = []
    seen: list[str] = []

    def begun(_: BatchMotor) -> None:
        with owning(state_folder(), "another") as other:
            with pytest.raises(HeldError) as refused:
                other.claim(claims)
            seen.append(str(refused.value))

    with served_line(bench) as run:
        claims += claims_of(load_station(bench.folder / "station.toml"))
        bench.listener.when_begun = begun
        with owning(state_folder(), "motorbench run") as first:
            first.claim(claims[:1])
            with pytest.raises(HeldError, match=r"in use by .* with motorbench run \("):
                run()
        assert not (bench.folder / "runs").exists()
        counts, _, _ = run()
        with owning(state_folder(), "motorbench run") as last:
            last.claim(claims)
    assert counts.motors == 2
    assert len(seen) == 2
    assert "with motorbench eol run, batch small (process" in seen[0]
    assert f"folder {bench.folder / 'runs' / 'small'})" in seen[0]


@pytest.mark.slow
def test_the_workers_of_a_batch_that_was_killed_have_its_instruments(bench: Any, tmp_path: Path) -> None:
    with served_line(bench):
        station = bench.folder / "station.toml"
        command = [
            sys.executable,
            "-m",
            "bench",
            "eol",
            "run",
            str(bench.folder / "plan.toml"),
            "--station",
            str(station),
        ]
        command += ["--serials", str(bench.folder / "serials.txt"), "--runs", str(bench.folder / "runs")]
        command += ["--records", str(tmp_path / "records.sqlite")]
        # What it leaves behind has its output still open.
        batch = subprocess.Popen(command, stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL)
        journal = folder_of(bench, "R1") / "journal.jsonl"
        pause = threading.Event()
        while not (journal.is_file() and b'"kind":"energised"' in journal.read_bytes()):
            assert batch.poll() is None
            pause.wait(0.05)
        (started,) = [event for event in read_guardian(folder_of(bench, "R1")) if event.kind == "started"]
        guardian = int(started.data["pid"])
        os.kill(guardian, signal.SIGSTOP)
        try:
            batch.kill()
            batch.wait()
            (left,) = [holder for holder in holders(state_folder()) if holder.pid == batch.pid]
            assert left.gone
            with owning(state_folder(), "another") as other, pytest.raises(HeldError, match="which has ended"):
                other.claim(claims_of(load_station(station)))
        finally:
            os.kill(guardian, signal.SIGCONT)
        all_have_let_go()
        with owning(state_folder(), "another") as other:
            other.claim(claims_of(load_station(station)))
