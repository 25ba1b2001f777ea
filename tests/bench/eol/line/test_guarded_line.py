"""A line of real sockets: a worker that dies while something is energised, and its guardian."""

import json
import os
import signal
import threading
from datetime import datetime
from typing import Any

from bench.eol.line.ledger import Begun
from bench.eol.verdict import Verdict
from bench.files.motor_file import load_motor
from bench.files.toml_text import toml_text
from bench.virtual_station import describe
from sim_instruments.served_bench import ServedBench

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


def test_a_motor_is_done_with_only_after_its_guardian_is(bench: Any) -> None:
    energised = threading.Event()

    def kill_when_energised(motor: Begun) -> None:
        if motor.number > 1:
            return
        journal = bench.folder / "runs" / "small" / "000" / f"000001-{motor.serial_number}" / "journal.jsonl"

        def watch() -> None:
            pause = threading.Event()
            for _ in range(1200):
                if journal.is_file() and b'"kind":"energised"' in journal.read_bytes():
                    energised.set()
                    (worker,) = bench.workers()
                    os.kill(worker, signal.SIGKILL)
                    return
                pause.wait(0.05)

        threading.Thread(target=watch, daemon=True).start()

    bench.ear.when_begun = kill_when_energised
    (bench.folder / "plan.toml").write_text(PLAN, encoding="utf-8")
    (bench.folder / "serials.txt").write_text("R1\nR2\n", encoding="utf-8")
    station = bench.folder / "station.toml"
    motor = load_motor(str(bench.folder / "motor.toml"))
    with ServedBench(motor.virtual_motor(), speedup=10.0, fixture=True, pages={"/motor": {"truth": {}}}) as served:
        station.write_text(
            toml_text(describe(served.preferred(), served.control, served.interlocks())), encoding="utf-8"
        )
        counts, stopped = bench.run(station=str(station), serials=str(bench.folder / "serials.txt"), motors=None)
        assert not served.bench.world.truth()["output_on"]
    assert energised.is_set()
    assert stopped == ""
    assert counts.motors == 2
    lost, measured = bench.ear.records
    assert lost.verdict is Verdict.ERROR
    assert "was ended by SIGKILL, in stator-resistance-dc at step E9/2" in lost.cause
    assert measured.verdict is Verdict.PASS
    told = (bench.folder / "runs" / "small" / "000" / "000001-R1" / "guardian.jsonl").read_text(encoding="utf-8")
    events = [json.loads(line) for line in told.splitlines()]
    assert [event["kind"] for event in events if event["kind"] in ("took", "walked", "left")] == [
        "took",
        "walked",
        "left",
    ]
    assert datetime.fromisoformat(events[-1]["wall"]) <= lost.ended
    assert measured.started >= lost.ended
