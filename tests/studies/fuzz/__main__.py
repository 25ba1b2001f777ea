"""`python -m tests.studies.fuzz --target NAME|all --seconds N`: look for inputs that break a parser.

With atheris (`uv sync --group fuzz`) new inputs are those that reach new branches; without it hypothesis changes the seeds by chance.
"""

import argparse
import re
import subprocess
import sys
import tempfile
import traceback
from dataclasses import dataclass
from importlib.util import find_spec
from pathlib import Path
from time import monotonic

from tests.studies.fuzz.catalogue import all_targets
from tests.studies.fuzz.target import Target, check, in_time

#: What one input may take (s) and the process may hold (MiB) under libFuzzer.
_SECONDS, _MEBIBYTES, _LONGEST_INPUT = 60, 1024, 8192
#: Inputs by chance between two looks at the clock.
_BATCH = 200
_EXECUTIONS = re.compile(r"stat::number_of_executed_units: (\d+)")
_BRANCHES = re.compile(r" cov: (\d+)")
_PEAK = re.compile(r"stat::peak_rss_mb: +(\d+)")


@dataclass(frozen=True)
class Outcome:
    """What came of a target: inputs tried, branches reached and memory (MiB) where they are known, the finding."""

    inputs: int
    branches: int
    peak: int
    finding: str = ""


def guided(target: Target, seconds: float, findings: Path) -> Outcome:
    """Let atheris look; the input that breaks something is kept under `findings`."""
    with tempfile.TemporaryDirectory() as corpus:
        for number, seed in enumerate(target.seeds):
            (Path(corpus) / f"seed{number}").write_bytes(seed)
        options = (
            f"-max_total_time={seconds:.0f}",
            f"-timeout={_SECONDS}",
            f"-rss_limit_mb={_MEBIBYTES}",
            f"-max_len={_LONGEST_INPUT}",
            f"-artifact_prefix={findings}/{target.name}-",
            "-print_final_stats=1",
        )
        done = subprocess.run(
            [sys.executable, "-m", "tests.studies.fuzz.guided", target.name, *options, corpus],
            capture_output=True,
            check=False,
        )
    said = (done.stdout + done.stderr).decode("utf-8", "replace")
    finding = "" if done.returncode == 0 else _last_words(said)
    return Outcome(_last(_EXECUTIONS, said), _last(_BRANCHES, said), _last(_PEAK, said), finding)


def by_chance(target: Target, seconds: float, findings: Path) -> Outcome:
    """Let hypothesis change the seeds until the time is over."""
    from hypothesis import HealthCheck, given, settings

    from tests.studies.fuzz.mutation import mutated

    end, inputs, broken = monotonic() + seconds, 0, b""

    @settings(max_examples=_BATCH, deadline=None, database=None, suppress_health_check=list(HealthCheck))
    @given(mutated(target.seeds))
    def run(data: bytes) -> None:
        nonlocal inputs, broken
        inputs, broken = inputs + 1, data
        with in_time():
            check(target, data)

    while monotonic() < end:
        try:
            run()
        except Exception as error:  # noqa: BLE001  whatever it is, it is what was looked for
            (findings / f"{target.name}-crash").write_bytes(broken)
            return Outcome(inputs, 0, 0, traceback.format_exception_only(error)[0].strip())
    return Outcome(inputs, 0, 0)


def _last(pattern: re.Pattern[str], said: str) -> int:
    found = pattern.findall(said)
    return int(found[-1]) if found else 0


def _last_words(said: str) -> str:
    """Return the exception's line, or what libFuzzer says in its place."""
    lines = said.splitlines()
    for index, line in enumerate(lines):
        if "Uncaught Python exception" in line:
            return next((words for words in lines[index + 1 :] if words.strip()), line)
    return next((line for line in lines if "ERROR" in line), lines[-1] if lines else "no output")


def main() -> int:
    """Return 1 where something was found."""
    known = all_targets()
    parser = argparse.ArgumentParser(prog="python -m tests.studies.fuzz", description=__doc__)
    parser.add_argument("--target", default="all", choices=["all", *known], metavar="NAME", help=", ".join(known))
    parser.add_argument("--seconds", type=float, default=60.0, help="for each target")
    parser.add_argument("--findings", type=Path, default=Path("fuzz-findings"), help="where inputs that break are kept")
    parser.add_argument("--engine", choices=["atheris", "hypothesis"], default=None)
    given = parser.parse_args()
    engine = given.engine or ("atheris" if find_spec("atheris") else "hypothesis")
    given.findings.mkdir(parents=True, exist_ok=True)
    look = guided if engine == "atheris" else by_chance
    print(f"{engine}, {given.seconds:g} s each\n{'target':24}{'inputs':>10}{'branches':>10}{'MiB':>6}  finding")
    broken = 0
    for target in known.values() if given.target == "all" else [known[given.target]]:
        outcome = look(target, given.seconds, given.findings)
        broken += bool(outcome.finding)
        shown = outcome.finding or "none"
        print(f"{target.name:24}{outcome.inputs:>10}{outcome.branches:>10}{outcome.peak:>6}  {shown}", flush=True)
    return 1 if broken else 0


if __name__ == "__main__":
    sys.exit(main())
