"""Trials with a whole `motorbench run` that measures: ended at some moment, gone on with, and held against an undisturbed one."""

import json
import os
import random
import re
import signal
import subprocess
import sys
import threading
from collections import Counter
from collections.abc import Callable, Iterator, Sequence
from contextlib import suppress
from pathlib import Path
from time import monotonic
from typing import Any

from bench.journal.guardian_record import read_guardian
from bench.journal.journal_file import read_journal
from bench.virtual.served_world import ServedWorld
from tests.studies.energised.held import quiet
from tests.studies.kills.ends import STOPS
from tests.studies.kills.trial import PATIENCE, Queues, Trial
from tests.studies.kills.victim import judge_verification, wait_until_let_go

PROCEDURES = ("pole-pairs-static", "stator-resistance-dc")
#: Times the wall's clock: hands do not keep the study waiting, and static measurements bear it.
SPEEDUP = 50
_LONGEST = 30.0
_STEP = re.compile(r"^\[\d+/\d+\] (\S+)  §(\S+)  ")
_BEFORE, _AFTER = "before the run began", "after the run's end"
Ending = Callable[["subprocess.Popen[bytes]", list[int], random.Random], None]


class Bench:
    """One served bench with runs on it, one after the other; `length` (s) is an undisturbed one's."""

    def __init__(self, folder: Path, procedures: Sequence[str] = PROCEDURES) -> None:
        self.folder = folder
        self.procedures = procedures
        self.station = folder / "station.toml"
        words = ("--motor", "lg-400w", "--json", "--speedup", f"{SPEEDUP}", "--station-file", str(self.station))
        self.process = subprocess.Popen(
            [sys.executable, "-m", "bench", "sim", "serve", *words], stdout=subprocess.PIPE, text=True, env=quiet()
        )
        assert self.process.stdout is not None
        self.world = ServedWorld(json.loads(self.process.stdout.readline())["control"])
        began = monotonic()
        done = self.run("undisturbed", *procedures)
        self.length = monotonic() - began
        self.reference = done["parameters"]

    def command(self, runs: Path, *arguments: str) -> list[str]:
        words = ["--station", str(self.station), "--motor", "lg-400w", "--runs", str(runs)]
        return [sys.executable, "-m", "bench", "run", *arguments, *words, "--json", "--language", "en"]

    def run(self, name: str, *arguments: str) -> dict[str, Any]:
        """Run to the end and return what it told."""
        words = self.command(self.folder / name, *arguments)
        done = subprocess.run(words, capture_output=True, text=True, env=quiet(), timeout=300, check=False)
        with suppress(ValueError):
            return dict(json.loads(done.stdout))
        return {"status": "no answer", "cause": done.stdout[-160:] + done.stderr[-300:]}

    def close(self) -> None:
        """End the bench."""
        self.world.__exit__()
        self.process.terminate()
        self.process.communicate(timeout=20)


def kill_run(process: "subprocess.Popen[bytes]", _guardians: list[int], _draw: random.Random) -> None:
    process.send_signal(signal.SIGKILL)


def kill_both(process: "subprocess.Popen[bytes]", guardians: list[int], draw: random.Random) -> None:
    pids = [process.pid, *guardians]
    draw.shuffle(pids)
    for pid in pids:
        os.kill(pid, signal.SIGKILL)


def kill_guardian(process: "subprocess.Popen[bytes]", guardians: list[int], _draw: random.Random) -> None:
    for pid in guardians or [process.pid]:
        os.kill(pid, signal.SIGKILL)


def some_signals(process: "subprocess.Popen[bytes]", _guardians: list[int], draw: random.Random) -> None:
    for _number in range(draw.randrange(1, 5)):
        process.send_signal(draw.choice(STOPS))
        for _moment in range(int(10.0 ** draw.uniform(0.0, 4.5))):
            pass


def stop_container(process: "subprocess.Popen[bytes]", guardians: list[int], draw: random.Random) -> None:
    for pid in [process.pid, *guardians]:
        os.kill(pid, signal.SIGTERM)
    timer = threading.Timer(draw.uniform(2.0, 10.0), process.kill)
    timer.daemon = True
    timer.start()


def freeze(process: "subprocess.Popen[bytes]", _guardians: list[int], draw: random.Random) -> None:
    process.send_signal(signal.SIGSTOP)
    timer = threading.Timer(draw.uniform(1.0, 2.0), process.send_signal, (signal.SIGCONT,))
    timer.daemon = True
    timer.start()


ENDINGS: dict[str, Ending] = {
    "measuring: kill -9": kill_run,
    "measuring: kill -9, guardian too": kill_both,
    "measuring: kill -9 of the guardian": kill_guardian,
    "measuring: 1 to 4 signals": some_signals,
    "measuring: container stopped": stop_container,
    "measuring: SIGSTOP, SIGCONT": freeze,
}


_GUARDIAN_DIES = (
    "measuring: kill -9, guardian too",
    "measuring: kill -9 of the guardian",
    "measuring: container stopped",
)


def trials(folder: Path, count: int, draw: random.Random, kept: Path | None = None) -> Iterator[Trial]:
    """Do so many trials, each ending in its turn; three quarters of the moments are within 0.4 s after something is energised."""
    bench = Bench(folder)
    try:
        kinds = list(ENDINGS)
        for number in range(count):
            yield disturb(bench, number, kinds[number % len(kinds)], draw)
    finally:
        bench.close()


def disturb(bench: Bench, number: int, kind: str, draw: random.Random) -> Trial:
    """Start a run, end it, and look."""
    runs, at = bench.folder / f"run-{number}", draw.uniform(0.0, bench.length)
    said = bench.folder / f"run-{number}.err"
    with said.open("wb") as err:
        words = bench.command(runs, *bench.procedures)
        process = subprocess.Popen(words, stdout=subprocess.DEVNULL, stderr=err, env=quiet())
        if draw.random() < 0.75:
            while process.poll() is None and not bench.world.truth()["energised"]:
                threading.Event().wait(0.005)
            at = draw.uniform(0.0, 0.4)
        threading.Event().wait(at)
        trial = Trial(kind, f"{at:.3f} s")
        _end(bench, trial, process, runs, draw)
    _examine(trial, runs, said.read_text(encoding="utf-8", errors="replace"))
    if trial.then not in (_BEFORE, _AFTER):
        _resume(bench, trial, next(runs.glob("*/")))
    return trial


def _end(bench: Bench, trial: Trial, process: "subprocess.Popen[bytes]", runs: Path, draw: random.Random) -> None:
    guardians = _guardians(runs)
    queues = Queues((process.pid, *guardians, bench.process.pid))
    trial.energised = bool(bench.world.truth()["energised"])
    if process.poll() is None:
        ENDINGS[trial.kind](process, guardians, draw)
    began = monotonic()
    all_die = ENDINGS[trial.kind] is kill_both
    while bench.world.truth()["energised"]:
        if monotonic() - began > (2.0 if all_die else _LONGEST):
            if all_die:
                trial.without_computer = "on until the resume: output_on"
            else:
                trial.faults.append("left energised")
                trial.off_after = float("inf")
            break
        threading.Event().wait(0.005)
    else:
        trial.off_after = monotonic() - began if trial.energised else 0.0
        trial.starved = queues.longest()
    try:
        process.wait(PATIENCE)
    except subprocess.TimeoutExpired:
        trial.faults.append(f"hangs: not ended within {PATIENCE:g} s")
        process.kill()
        process.wait()


def _guardians(runs: Path) -> list[int]:
    """Return the guardian's process, where one is there already and has not left."""
    events = [event for folder in runs.glob("*/") for event in read_guardian(folder)]
    if not events or events[-1].kind == "left":
        return []
    return [int(event.data["pid"]) for event in events if event.kind == "started"][-1:]


def _examine(trial: Trial, runs: Path, said: str) -> None:
    trial.judge_stderr(said)
    journals = list(runs.glob("*/journal.jsonl"))
    if not journals or not (events := read_journal(journals[0]).events):
        trial.then = _BEFORE
        return
    told = Counter(_STEP.findall("\n".join(line for line in said.splitlines() if line.startswith("["))))
    kept: Counter[tuple[str, str]] = Counter()
    procedure = ""
    for event in events:
        if event.kind == "procedure_started":
            procedure = event.data["procedure"]
        elif event.kind == "step_started":
            kept[procedure, event.data["step"]] += 1
    trial.missing = sum((told - kept).values())
    end = events[-1].data if events[-1].kind == "run_finished" else None
    trial.then = "killed" if end is None else str(end["status"])
    if end is not None:
        trial.judge_cause(str(end["cause"]))
    if trial.then == "completed":
        trial.then = _AFTER
    judge_verification(trial, journals[0].parent, finished=end is not None, resumed=trial.then == _AFTER)


def _resume(bench: Bench, trial: Trial, folder: Path) -> None:
    wait_until_let_go(folder)
    told = bench.run(folder.parent.name, "--resume", str(folder))
    trial.resumed = str(told.get("status", told.get("error", "no answer")))
    if trial.resumed != "completed":
        trial.faults.append(f"the resumed run: {trial.resumed}: {str(told.get('cause'))[:300]}")
        return
    wrong = [name for name, entry in bench.reference.items() if not _agree(entry, told["parameters"].get(name))]
    if wrong:
        trial.faults.append(f"figures other than the undisturbed run's: {', '.join(wrong)}")
    judge_verification(trial, folder, finished=True, resumed=trial.kind in _GUARDIAN_DIES)


def _agree(first: dict[str, Any], second: dict[str, Any] | None) -> bool:
    """Tell whether two figures agree within their 95 % intervals together (each k = 3 of both is far beyond chance)."""
    if second is None:
        return False
    spread = 3.0 * (float(first["standard_uncertainty"]) ** 2 + float(second["standard_uncertainty"]) ** 2) ** 0.5
    return abs(float(first["value"]) - float(second["value"])) <= max(spread, 1e-12 * abs(float(first["value"])))
