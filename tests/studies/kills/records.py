"""Batches of the line whose own records are locked, cut off from writing, or damaged while they run."""

import json
import os
import random
import shutil
import sqlite3
import subprocess
import sys
import threading
from collections.abc import Callable, Iterator
from contextlib import closing, suppress
from pathlib import Path
from time import monotonic
from typing import Any

from bench.eol.store.spool import FOLDER
from tests.studies.energised.held import quiet
from tests.studies.kills.trial import PATIENCE, Trial

_MOTOR = Path(__file__).parents[3] / "docs" / "examples" / "eol" / "motor.toml"
_MOTORS = 6
_PLAN = """
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

[[limit]]
parameter = "stator_resistance"
percent = 60.0

[virtual]
resistance = 3.0
"""
_LINE = """
[line]
bench = "virtual"
sockets = 2
shared = ["lcr_meter"]
"""
#: Does something to the records and returns what takes it back.
Harm = Callable[[Path, random.Random], Callable[[], None]]


def locked(records: Path, _draw: random.Random) -> Callable[[], None]:
    """Somebody else writes and does not come to an end."""
    holder = sqlite3.connect(records, isolation_level=None, timeout=30.0, check_same_thread=False)
    holder.execute("BEGIN IMMEDIATE")

    def release() -> None:
        holder.rollback()
        holder.close()

    return release


def read_only(records: Path, _draw: random.Random) -> Callable[[], None]:
    """Nobody may write the file and its log any more; for root, who may write everything, they are made immutable (chattr).

    Not so the log's index, which is mapped memory: no program survives that.
    """
    files = [path for path in (records, Path(f"{records}-wal")) if path.exists()]
    root = os.geteuid() == 0
    for path in files:
        path.chmod(0o444)
        if root:
            subprocess.run(["chattr", "+i", str(path)], check=True)

    def allow() -> None:
        for path in files:
            if root:
                subprocess.run(["chattr", "-i", str(path)], check=True)
            path.chmod(0o644)

    return allow


def corrupt(records: Path, draw: random.Random) -> Callable[[], None]:
    """Pages of the file and of its log are written over."""
    whole = records.with_suffix(".whole")
    with closing(sqlite3.connect(records, timeout=30.0)) as source, closing(sqlite3.connect(whole)) as copy:
        source.backup(copy)
    for path in (records, Path(f"{records}-wal")):
        with suppress(OSError), path.open("r+b") as file:
            size = os.fstat(file.fileno()).st_size
            for offset in range(0, size, 512):
                if draw.random() < 0.7:
                    file.seek(offset)
                    file.write(draw.randbytes(512))

    def restore() -> None:
        for suffix in ("", "-wal", "-shm"):
            Path(f"{records}{suffix}").unlink(missing_ok=True)
        shutil.move(whole, records)

    return restore


HARMS: dict[str, Harm] = {"locked": locked, "read-only": read_only, "corrupt": corrupt}


def trials(folder: Path, count: int, draw: random.Random, kept: Path | None = None) -> Iterator[Trial]:
    """Do so many trials: a batch whose records are harmed for some seconds or to its end, then the same batch again."""
    for number in range(count):
        kind = draw.choice(list(HARMS))
        here = folder / f"{number:03d}-{kind}"
        here.mkdir()
        trial = _harmed(here, kind, draw)
        if not trial.good and kept is not None:
            trial.kept = str(shutil.copytree(here, kept / f"{os.getpid()}-{folder.name}-{here.name}"))
        yield trial


def _harmed(here: Path, kind: str, draw: random.Random) -> Trial:
    for name, content in (("plan.toml", _PLAN), ("line.toml", _LINE), ("motor.toml", _MOTOR.read_text("utf-8"))):
        (here / name).write_text(content, encoding="utf-8")
    seconds = draw.choice((2.0, 8.0, 60.0))
    trial = Trial(f"records {kind}", f"for {seconds:g} s" if seconds < 60.0 else "to the batch's end")
    records = here / "records.sqlite"
    process = _batch(here, _MOTORS)
    heal: Callable[[], None] | None = None
    began, harmed = monotonic(), 0.0
    while process.poll() is None:
        if heal is None and _kept(records):
            heal, harmed = HARMS[kind](records, draw), monotonic()
        elif heal is not None and harmed and monotonic() - harmed > seconds:
            harmed = 0.0
            heal()
        if monotonic() - began > 4.0 * PATIENCE:
            trial.faults.append("hangs: the batch has not ended")
            process.kill()
        threading.Event().wait(0.02)
    if heal is None:
        trial.then = "not harmed in time"
    elif harmed:
        heal()
    told = _told(trial, process, here / "first.txt")
    waits, measured = told.get("in_no_database", 0), told.get("motors", 0)
    trial.then = trial.then or f"{told.get('motors', 0)} motors, {waits} in files, {told.get('waits_because', '')}"
    again = _batch(here, _MOTORS)
    again.wait(4.0 * PATIENCE)
    told = _told(trial, again, here / "second.txt")
    trial.resumed = "completed" if told else "no answer"
    if kind != "corrupt" and measured != told.get("motors"):
        trial.then += f"; then {told.get('motors')}"
    numbers = _kept(records)
    trial.missing = _MOTORS - len(set(numbers))
    if len(numbers) != len(set(numbers)):
        trial.faults.append(f"records twice: {sorted(numbers)}")
    if left := [path.name for path in (here / "runs" / FOLDER).glob("*/*.json")]:
        trial.faults.append(f"left in files after the second batch: {left}")
    return trial


def _batch(here: Path, motors: int) -> "subprocess.Popen[str]":
    words = ["eol", "run", "plan.toml", "--station", "line.toml", "--records", str(here / "records.sqlite")]
    words += ["--runs", "runs", "--motors", str(motors), "--json", "--language", "en"]
    # Output of some lines, which a pipe takes.
    return subprocess.Popen(
        [sys.executable, "-m", "bench", *words],
        cwd=here,
        stdout=subprocess.PIPE,
        stderr=subprocess.PIPE,
        text=True,
        env=quiet(),
    )


def _told(trial: Trial, process: "subprocess.Popen[str]", file: Path) -> dict[str, Any]:
    output, said = process.communicate()
    file.write_text(f"{output}\n{said}\nstatus {process.returncode}\n", encoding="utf-8")
    trial.judge_stderr(said)
    try:
        return dict(json.loads(output))
    except ValueError:
        trial.faults.append(f"ended without its figures, status {process.returncode}: {said[-300:]}")
        return {}


def _kept(records: Path) -> list[int]:
    """Return the numbers of the motors that have a record; a file that is harmed tells none."""
    if not records.exists():
        return []
    with suppress(sqlite3.Error), closing(sqlite3.connect(records, timeout=1.0)) as connection:
        return [int(number) for (number,) in connection.execute("SELECT number FROM motor")]
    return []
