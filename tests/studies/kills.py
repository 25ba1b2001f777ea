"""Kills runs at random moments and sees what is left: `python -m tests.studies.kills --kills 200 --seed 1 --workers 6`.

Half of the moments are drawn from the whole run, half from the first 0.4 s after something was energised. Every run
measures through real sockets on a virtual bench in a process of its own, and is killed with -9. Then the bench is asked
whether anything is still energised, the journal whether anything is missing that was told, and the run is gone on with.
"""

import argparse
import json
import os
import random
import re
import signal
import subprocess
import sys
import tempfile
import threading
import time
from collections import Counter
from collections.abc import Sequence
from concurrent.futures import ThreadPoolExecutor
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from bench.record.journal_file import read_journal
from bench.safety.ownership import holders
from bench.safety.state_folder import state_folder
from bench.served_world import ServedWorld

PROCEDURES = ("pole-pairs-static", "stator-resistance-dc")
QUIET = {**os.environ, "OPENBLAS_NUM_THREADS": "1"}
#: Times the wall's clock: hands do not keep the study waiting, and static measurements bear it.
SPEEDUP = 50
#: Off within this (s) of the kill, as promised.
PROMISED = 1.0
_STEP = re.compile(r"^\[\d+/\d+\] (\S+)  §(\S+)  ")


@dataclass(frozen=True)
class Kill:
    """One kill: when (s after the start), whether anything was on, how long it stayed on (s), and what was found after."""

    at: float
    energised: bool
    off_after: float
    missing: int
    then: str
    wrong: tuple[str, ...] = ()


class Bench:
    """One served bench with runs on it, one after the other."""

    def __init__(self, folder: Path, procedures: Sequence[str]) -> None:
        self.folder = folder
        self.procedures = procedures
        self.station = folder / "station.toml"
        words = ("--motor", "lg-400w", "--json", "--speedup", f"{SPEEDUP}", "--station-file", str(self.station))
        self.process = subprocess.Popen(
            [sys.executable, "-m", "bench", "sim", "serve", *words], stdout=subprocess.PIPE, text=True, env=QUIET
        )
        assert self.process.stdout is not None
        self.world = ServedWorld(json.loads(self.process.stdout.readline())["control"])
        began = time.monotonic()
        done = self.run("undisturbed", *procedures)
        self.length = time.monotonic() - began
        self.reference = json.loads(done)["parameters"]

    def command(self, runs: Path, *arguments: str) -> list[str]:
        words = [
            "--station",
            str(self.station),
            "--motor",
            "lg-400w",
            "--runs",
            str(runs),
            "--json",
            "--language",
            "en",
        ]
        return [sys.executable, "-m", "bench", "run", *arguments, *words]

    def run(self, name: str, *arguments: str) -> str:
        done = subprocess.run(
            self.command(self.folder / name, *arguments),
            capture_output=True,
            text=True,
            env=QUIET,
            timeout=300,
            check=False,
        )
        return done.stdout

    def kill(self, number: int, chance: random.Random) -> Kill:
        """Start a run, kill it, and look."""
        runs, at = self.folder / f"kill-{number}", chance.uniform(0.0, self.length)
        said = self.folder / f"kill-{number}.err"
        with said.open("wb") as err:
            process = subprocess.Popen(
                self.command(runs, *self.procedures), stdout=subprocess.DEVNULL, stderr=err, env=QUIET
            )
            if number % 2:
                self._until_energised(process)
                at = chance.uniform(0.0, 0.4)
            threading.Event().wait(at)
            process.send_signal(signal.SIGKILL)
            killed = time.monotonic()
            energised = bool(self.world.truth()["energised"])
            process.wait()
        while self.world.truth()["energised"]:
            if time.monotonic() - killed > 30.0:
                return Kill(at, energised, float("inf"), 0, "left energised")
            threading.Event().wait(0.005)
        off_after = time.monotonic() - killed if energised else 0.0
        journals = list(runs.glob("*/journal.jsonl"))
        if not journals or not (journal := read_journal(journals[0])).events:
            return Kill(at, energised, off_after, 0, "before the run began")
        told = Counter(_STEP.findall(said.read_text(encoding="utf-8", errors="replace")))
        kept: Counter[tuple[str, str]] = Counter()
        procedure = ""
        for event in journal.events:
            if event.kind == "procedure_started":
                procedure = event.data["procedure"]
            elif event.kind == "step_started":
                kept[procedure, event.data["step"]] += 1
        missing = sum((told - kept).values())
        if journal.events[-1].kind == "run_finished":
            return Kill(at, energised, off_after, missing, "after the run's end")
        return self._resumed(at, energised, off_after, missing, journals[0].parent)

    def _until_energised(self, process: "subprocess.Popen[bytes]") -> None:
        while process.poll() is None and not self.world.truth()["energised"]:
            threading.Event().wait(0.005)

    def _resumed(self, at: float, energised: bool, off_after: float, missing: int, folder: Path) -> Kill:
        # The guardian of the killed run lets go of the instruments once it has measured that they are off.
        while any(holder.folder == str(folder.resolve()) for holder in holders(state_folder())):
            threading.Event().wait(0.05)
        told = self._json(self.run(folder.parent.name, "--resume", str(folder)))
        if "error" in told:
            return Kill(
                at, energised, off_after, missing, "refused: " + re.sub(r"[\d.]+", "#", str(told["error"]))[:120]
            )
        if told.get("status") != "completed":
            return Kill(at, energised, off_after, missing, f"{told.get('status')}: {str(told.get('cause'))[:160]}")
        wrong = tuple(name for name, entry in self.reference.items() if not _agree(entry, told["parameters"].get(name)))
        proof = subprocess.run(
            [sys.executable, "-m", "bench", "results", "verify", str(folder), "--json"],
            capture_output=True,
            text=True,
            env=QUIET,
            check=False,
        )
        if self._json(proof.stdout).get("verdict") != "untouched":
            wrong += ("the journal's proof",)
        return Kill(at, energised, off_after, missing, "resumed and completed", wrong)

    @staticmethod
    def _json(words: str) -> dict[str, Any]:
        try:
            return dict(json.loads(words))
        except ValueError:
            return {"status": "no answer", "cause": words[-160:]}

    def close(self) -> None:
        """End the bench."""
        self.world.__exit__()
        self.process.terminate()
        self.process.communicate(timeout=20)


def _agree(first: dict[str, Any], second: dict[str, Any] | None) -> bool:
    """Tell whether two figures agree within their 95 % intervals together (each k = 3 of both is far beyond chance)."""
    if second is None:
        return False
    spread = 3.0 * (float(first["standard_uncertainty"]) ** 2 + float(second["standard_uncertainty"]) ** 2) ** 0.5
    return abs(float(first["value"]) - float(second["value"])) <= max(spread, 1e-12 * abs(float(first["value"])))


def study(kills: int, seed: int, workers: int, procedures: Sequence[str] = PROCEDURES) -> list[Kill]:
    """Return what became of every kill."""
    with tempfile.TemporaryDirectory() as folder:

        def lead(worker: int) -> list[Kill]:
            own = Path(folder) / str(worker)
            own.mkdir()
            bench = Bench(own, procedures)
            try:
                chance = random.Random(f"{seed}-{worker}")  # noqa: S311  moments, no secrets
                return [bench.kill(number, chance) for number in range(worker, kills, workers)]
            finally:
                bench.close()

        with ThreadPoolExecutor(workers) as pool:
            return [kill for found in pool.map(lead, range(workers)) for kill in found]


def table(found: Sequence[Kill]) -> str:
    """Return the result as it stands in the docs."""
    on = sorted(kill.off_after for kill in found if kill.energised)
    lines = [
        f"{len(found)} kills, {len(on)} of them while something was energised.",
        f"Left energised: {sum(kill.then == 'left energised' for kill in found)}. Off later than {PROMISED:g} s after the kill: "
        f"{sum(delay > PROMISED for delay in on)}"
        + (f" (median {on[len(on) // 2]:.2f} s, longest {on[-1]:.2f} s)." if on else "."),
        f"Steps told and not in the journal: {sum(kill.missing for kill in found)}.",
        "",
        "| what became of the run | kills |",
        "| --- | ---: |",
    ]
    lines += [f"| {then} | {count} |" for then, count in Counter(kill.then for kill in found).most_common()]
    wrong = Counter(name for kill in found for name in kill.wrong)
    lines += [
        "",
        "Figures that differ from the undisturbed run's: "
        + (", ".join(f"{n} ({c})" for n, c in wrong.items()) or "none")
        + ".",
    ]
    return "\n".join(lines)


def good(found: Sequence[Kill]) -> bool:
    """Tell whether every promise was kept."""
    accepted = ("before the run began", "after the run's end", "resumed and completed")
    return all(k.off_after <= PROMISED and not k.missing and not k.wrong and k.then.startswith(accepted) for k in found)


def main() -> None:
    """Run the study as the command line says."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--kills", type=int, default=200)
    parser.add_argument("--seed", type=int, default=1)
    parser.add_argument("--workers", type=int, default=2)
    given = parser.parse_args()
    os.environ.setdefault("OPENBLAS_NUM_THREADS", "1")
    found = study(given.kills, given.seed, given.workers)
    print(table(found))
    for kill in found:
        if not good([kill]):
            print(f"\nat {kill.at:.3f} s: {kill}")
    sys.exit(0 if good(found) else 1)


if __name__ == "__main__":
    main()
