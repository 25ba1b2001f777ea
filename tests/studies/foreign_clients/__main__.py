"""Serve a bench, have the clients that a Python has installed use its instruments, and print a table client × call × outcome.

`python -m tests.studies.foreign_clients [--python PYTHON] [--all]`: the clients run in PYTHON, which needs nothing of ours.
"""

import argparse
import json
import os
import subprocess
import sys
from collections import Counter
from pathlib import Path
from typing import Any

from sim_instruments.server.served_bench import ServedBench
from sim_instruments.six_step.machine import virtual_motor
from tests.sim_instruments.motors import BENCH_MOTOR, SIX_STEP

HERE = Path(__file__).parent
_SPEEDUP = 50.0
#: Clients of what only a bench with a fixture and a six-step drive has.
_WHOLE = ("with_canopen", "with_scpi")
#: Turns a second, of four pole pairs.
_TURNS = 10.0


def _prepare(bench: ServedBench) -> dict[str, float]:
    """Wire the bench, turn the shaft, and return what is really there by name (SI units)."""
    world = bench.bench.world
    world.connect({"A": "lcr_high", "B": "lcr_low"})
    world.attach_voltmeter("A", "B")
    world.attach_voltage_probe(1, "A", "B")
    world.attach_voltage_probe(2, "B", "C")
    speed = 2.0 * 3.141592653589793 * _TURNS
    world.turn_shaft(speed)
    amplitude = 3.0**0.5 * BENCH_MOTOR.back_emf_constant_mechanical * speed
    return {"resistance": 1.0, "frequency": 40.0, "amplitude": amplitude}


def _rows(client: Path, python: str) -> list[dict[str, str]]:
    """Have a client's script run against a bench of its own; say why where it comes to an end early."""
    whole = client.stem in _WHOLE
    made: dict[str, Any] = {"motor": virtual_motor(SIX_STEP), "six_step": SIX_STEP, "fixture": True} if whole else {}
    with ServedBench(**{"motor": BENCH_MOTOR, **made}, speedup=_SPEEDUP, seed=1) as bench:
        truth = {} if whole else _prepare(bench)
        task = {"addresses": bench.addresses(), "control": bench.control, "truth": truth}
        environment = {**os.environ, "PYTHONPATH": str(HERE)}
        command = [python, str(client), json.dumps(task)]
        done = subprocess.run(command, capture_output=True, text=True, timeout=200, env=environment, check=False)
    if done.returncode:
        print(f"{client.stem}: {(done.stderr.strip().splitlines() or ['no word'])[-1]}")
    return [json.loads(line) for line in done.stdout.splitlines() if line.startswith("{")]


def main() -> None:
    """Run every client and print what came of its calls."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--python", default=sys.executable, help="the Python that has the clients")
    parser.add_argument("--all", action="store_true", help="print the calls that work, too")
    given = parser.parse_args()
    rows = [row for client in sorted(HERE.glob("with_*.py")) for row in _rows(client, given.python)]
    for row in rows:
        if given.all or row["outcome"] != "works":
            print(f"| {row['client']} | {row['call']} | {row['outcome']} | {row['told']} |".replace("\n", " "))
    outcomes = ("works", "refused", "raised", "wrong")
    print(f"| client | {' | '.join(outcomes)} |\n|---|{'---|' * len(outcomes)}")
    for name in dict.fromkeys(row["client"] for row in rows):
        counts = Counter(row["outcome"] for row in rows if row["client"] == name)
        print(f"| {name} | {' | '.join(str(counts[outcome]) for outcome in outcomes)} |")


if __name__ == "__main__":
    main()
