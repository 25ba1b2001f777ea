"""Benches that begin as a last user may have left them: is every figure right, or refused with the key to press?

`python -m tests.studies.hostile_states --states N --seed S [--workers K] [--procedures NAME …]`

Every state draws a motor, instruments with errors of their own and what was left of each, and goes through the procedures
as found, and again with the keys pressed that the refusals named. Counted for each procedure and beginning:

- held, off, far off: figures whose 95 % interval holds the truth, does not by up to its half-width, or by more;
- key named: refused for what was left, with what to do at the instrument or in the station file; other reason: refused
  otherwise; error: no refusal at all.

Then how often an output was left on, and which settings were not given back. The result depends on seed and number of states only.
"""

import argparse
import time
from collections import Counter
from collections.abc import Iterator, Mapping
from dataclasses import dataclass, field
from functools import partial

import numpy as np

from bench.virtual.true_values import true_values
from procedures.core.nameplate import Nameplate
from procedures.core.parameters import PARAMETERS
from procedures.core.result import ProcedureResult
from sim_instruments.bench import BenchSetting, VirtualBench
from sim_instruments.instruments.errors import Errors
from tests.studies.forked import context
from tests.studies.worlds.measured_motor import Done, carry_out, figure, study_plan
from tests.studies.worlds.pressed_keys import BY_FILE, BY_NAME, press_all, settings_of
from tests.studies.worlds.random_motors import draw_motor

FOUND, PRESSED = "as found", "keys pressed"
OUTCOMES = ("held", "off", "far off", "key named", "other reason", "error")


@dataclass
class Became:
    """What became of procedures: counts by (procedure, beginning, outcome), and in words what is against them."""

    states: int = 0
    counts: Counter[tuple[str, str, str]] = field(default_factory=Counter)
    left_on: int = 0
    not_given_back: Counter[str] = field(default_factory=Counter)
    words: Counter[str] = field(default_factory=Counter)

    def add(self, other: "Became") -> None:
        """Put another's counts to these."""
        self.states += other.states
        self.counts += other.counts
        self.left_on += other.left_on
        self.not_given_back += other.not_given_back
        self.words += other.words


def from_state(seed: int, procedures: tuple[str, ...], index: int) -> Became:
    """Draw state `index` and return what became of the procedures; depends on nothing else."""
    became = Became(states=1)
    random = np.random.default_rng([seed, index])
    motor, plate = draw_motor(random)
    setting = BenchSetting(
        ambient_temperature=float(random.uniform(18.0, 28.0)), initial_angle=float(random.uniform(0.0, 2.0 * np.pi))
    )
    errors = Errors.drawn(random)
    bench = VirtualBench(
        motor, seed=int(random.integers(1 << 31)), errors=errors, setting=setting, sockets=False, hostile=index
    )
    truth, operator = true_values(PARAMETERS, motor), int(random.integers(1 << 31))
    with bench:
        refused = _carry_out(bench, plate, operator, procedures, truth, FOUND, index, became)
        if refused:
            press_all(bench, plate)
            for reason in _carry_out(bench, plate, operator, procedures, truth, PRESSED, index, became):
                became.words[f"state {index}: still refused once its key was pressed: {reason}"] += 1
    return became


def _carry_out(
    bench: VirtualBench,
    plate: Nameplate,
    operator: int,
    procedures: tuple[str, ...],
    truth: Mapping[str, float],
    beginning: str,
    index: int,
    became: Became,
) -> set[str]:
    """Carry the procedures out, count what becomes of them, and return the refusals that name a key."""
    before = settings_of(bench)
    done = carry_out(bench, plate, operator, study_plan(procedures))
    after = settings_of(bench)
    became.left_on += bool(bench.world.truth()["energised"])
    became.not_given_back.update(query for query, value in before.items() if after[query] != value)
    for result in done.results:
        _judge(result, truth, beginning, index, became)
    return count_refusals(done, beginning, index, became)


def count_refusals(done: Done, beginning: str, index: int, became: Became) -> set[str]:
    """Count what was refused and what failed, and return the refusals that name a key."""
    named = {reason for _, reason in done.refused if BY_NAME.match(reason) or BY_FILE.match(reason)}
    for procedure, reason in done.refused:
        outcome = "key named" if reason in named else "other reason"
        became.counts[procedure, beginning, outcome] += 1
        if outcome == "other reason":
            became.words[f"{beginning}: {procedure} refused: {reason}"] += 1
    for procedure, reason in done.failed:
        became.counts[procedure, beginning, "error"] += 1
        became.words[f"{beginning}, state {index}: {procedure} failed: {reason}"] += 1
    return named


def _judge(result: ProcedureResult, truth: Mapping[str, float], beginning: str, index: int, became: Became) -> None:
    for parameter in result.parameters:
        if parameter.name not in truth:
            continue
        one = figure(parameter, truth)
        half = 0.5 * (one.high - one.low) + 1e-9 * abs(one.truth)
        off = abs(0.5 * (one.high + one.low) - one.truth) / half
        outcome = "held" if off <= 1.0 else "off" if off <= 2.0 else "far off"
        became.counts[result.procedure, beginning, outcome] += 1
        if outcome == "far off":
            became.words[f"{beginning}, state {index}: {result.procedure} {one.name} is off by {off:.1f} U"] += 1


def study(seed: int, states: int, workers: int, procedures: tuple[str, ...] = ()) -> Became:
    """Return what became of the procedures from so many states."""
    total = Became()
    with context().Pool(workers, maxtasksperchild=100) as pool:
        for one in pool.imap(partial(from_state, seed, procedures), range(states)):
            total.add(one)
    return total


def lines(became: Became, beginnings: tuple[str, ...] = (FOUND, PRESSED)) -> Iterator[str]:
    """Give the table as Markdown, then what is against it."""
    yield f"| procedure | beginning | {' | '.join(OUTCOMES)} |"
    yield f"| --- | --- |{' ---: |' * len(OUTCOMES)}"
    procedures = dict.fromkeys(procedure for procedure, _, _ in became.counts)
    for procedure in sorted(procedures):
        for beginning in beginnings:
            counts = " | ".join(str(became.counts[procedure, beginning, outcome]) for outcome in OUTCOMES)
            yield f"| {procedure} | {beginning} | {counts} |"
    yield ""
    yield f"{became.states} states. Outputs left on: {became.left_on}. Settings not given back: {became.not_given_back.total()}."
    yield ""
    for words, number in sorted((became.not_given_back + became.words).items(), key=lambda item: (-item[1], item[0])):
        yield f"- {number} × {words}"


def main() -> None:
    """Run the study and print its table."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--states", type=int, default=200)
    parser.add_argument("--seed", type=int, default=1)
    parser.add_argument("--workers", type=int, default=1, help="processes of this machine")
    parser.add_argument("--procedures", nargs="+", default=(), metavar="NAME", help="these only")
    given = parser.parse_args()
    started = time.monotonic()
    became = study(given.seed, given.states, given.workers, tuple(given.procedures))
    print("\n".join(lines(became)))
    print(f"\n{time.monotonic() - started:.0f} s")


if __name__ == "__main__":
    main()
