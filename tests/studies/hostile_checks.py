"""Checks of the end of a line, and the six-step drive, on benches as a last user may have left them.

`python -m tests.studies.hostile_checks --states N --seed S [--first I] [--workers K] [--within S] [--procedures NAME …]`

What `hostile_states` leaves out: procedures of the fixture, of the insulation tester and of the six-step drive. Each state draws
instruments with errors of their own, ambient temperature, the shaft's angle and what was left of each instrument; the motor is the
shipped one with Hall sensors and a six-step drive. Every procedure is carried out as found and again with the keys pressed that the
refusals named, and beside it on the same bench that nobody left anything on. A figure is held against the motor's truth, or, where the
motor has no such figure, against that bench's: both intervals, as independent ones. Counted as in `hostile_states`; the result depends
on seed and number of states only.
"""

import argparse
import math
import time
from dataclasses import replace
from functools import partial

import numpy as np

from bench.motor.motor_file import MotorFile, load_motor
from bench.plugins.catalogues import installed
from bench.run.plan import Planned, make_plan
from bench.virtual.true_values import true_values
from procedures.core.nameplate import Nameplate
from procedures.core.parameters import PARAMETERS
from procedures.core.result import Parameter, ProcedureResult
from sim_instruments.bench import BenchSetting, VirtualBench
from sim_instruments.catalogue import SIX_STEP, STANDARD, SimulatedUnit, find
from sim_instruments.instruments.errors import Errors
from tests.studies.forked import context
from tests.studies.hostile_states import FOUND, PRESSED, Became, count_refusals, lines
from tests.studies.worlds.measured_motor import carry_out
from tests.studies.worlds.pressed_keys import press_all, settings_of

MOTOR = "92bl-30-25l"
#: Not there: a switch matrix, which hands stand in for.
_UNITS = (*STANDARD.values(), *SIX_STEP.values(), "gwinstek-gpt9800")
#: Nothing is measured by it.
_BY_HAND = "by-hand"
_LOADED = "equivalent-resistance"
CLEAN = "nothing left"


def checks(file: MotorFile, procedures: tuple[str, ...] = ()) -> list[list[Planned]]:
    """Return a plan for each procedure of the study, or for those of them that are named."""
    known, drive = installed().procedures, file.six_step
    assert drive is not None
    # Loads (N·m) and the winding's data, which a run takes from the procedures before it.
    inductance = drive.self_inductance - drive.mutual_inductance
    loaded = ("loads=[0.3,0.5,0.7]", f"winding_resistance={drive.resistance}", f"winding_inductance={inductance}")
    names = [name for name in known if (not known[name].in_all() and name != _BY_HAND) or name == _LOADED]
    return [
        make_plan([name], loaded if name == _LOADED else (), known)
        for name in names
        if not procedures or name in procedures
    ]


def from_state(seed: int, procedures: tuple[str, ...], index: int) -> Became:
    """Draw state `index` and return what became of the procedures; depends on nothing else."""
    became, file = Became(states=1), load_motor(MOTOR)
    plate = replace(file.nameplate, insulation_test_voltage=500.0)
    truth = true_values(PARAMETERS, file.virtual_motor(), file.six_step)
    plans = checks(file, procedures)
    wanted: dict[tuple[str, str], Parameter] = {}
    with _bench(seed, index, None) as clean:
        _carry_all(clean, plate, index, plans, truth, wanted, CLEAN, became)
    with _bench(seed, index, index) as bench:
        refused = _carry_all(bench, plate, index, plans, truth, wanted, FOUND, became)
        if refused:
            press_all(bench, plate)
            for reason in _carry_all(bench, plate, index, plans, truth, wanted, PRESSED, became):
                became.words[f"state {index}: still refused once its key was pressed: {reason}"] += 1
    return became


def _bench(seed: int, index: int, hostile: int | None) -> VirtualBench:
    random, file = np.random.default_rng([seed, index]), load_motor(MOTOR)
    setting = BenchSetting(
        ambient_temperature=float(random.uniform(22.0, 28.0)), initial_angle=float(random.uniform(0.0, 2.0 * np.pi))
    )
    return VirtualBench(
        file.virtual_motor(),
        [SimulatedUnit(find(name)) for name in _UNITS],
        seed=int(random.integers(1 << 31)),
        errors=Errors.drawn(random),
        setting=setting,
        sockets=False,
        six_step=file.six_step,
        fixture=True,
        hostile=hostile,
    )


def _carry_all(
    bench: VirtualBench,
    plate: Nameplate,
    index: int,
    plans: list[list[Planned]],
    truth: dict[str, float],
    wanted: dict[tuple[str, str], Parameter],
    beginning: str,
    became: Became,
) -> set[str]:
    """Carry the procedures out, count what becomes of them, and return the refusals that name a key."""
    before, named = settings_of(bench), set()
    for plan in plans:
        done = carry_out(bench, plate, index, plan)
        for result in done.results:
            if beginning == CLEAN:
                wanted |= {(result.procedure, one.name): one for one in result.parameters}
            _judge(result, truth, wanted, beginning, index, became)
        named |= count_refusals(done, beginning, index, became)
    after = settings_of(bench)
    became.left_on += bool(bench.world.truth()["energised"])
    became.not_given_back.update(query for query, value in before.items() if after[query] != value)
    return named


def _judge(
    result: ProcedureResult,
    truth: dict[str, float],
    wanted: dict[tuple[str, str], Parameter],
    beginning: str,
    index: int,
    became: Became,
) -> None:
    for one in result.parameters:
        off = _off(one, truth, wanted.get((result.procedure, one.name)))
        if off is None:
            continue
        outcome = "held" if off <= 1.0 else "off" if off <= 2.0 else "far off"
        became.counts[result.procedure, beginning, outcome] += 1
        if outcome == "far off":
            became.words[f"{beginning}, state {index}: {result.procedure} {one.name} is off by {off:.1f} U"] += 1


def _off(one: Parameter, truth: dict[str, float], clean: Parameter | None) -> float | None:
    """Return by how many half-widths of its interval a figure is off; None where there is nothing to hold it against."""
    low, high = one.coverage_interval
    half, right = 0.5 * (high - low), truth.get(one.name)
    if right is None:
        if clean is None:
            return None
        right = 0.5 * sum(clean.coverage_interval)
        half = math.hypot(half, 0.5 * (clean.coverage_interval[1] - clean.coverage_interval[0]))
    # A share or an angle that is really nothing has an interval that ends there.
    return abs(0.5 * (low + high) - right) / (half + 1e-9 * max(1.0, abs(right)))


def study(
    seed: int, indices: range, workers: int, procedures: tuple[str, ...] = (), within: float = math.inf
) -> Became:
    """Return what became of the procedures from these states, or from those of them that `within` (s) was enough for."""
    total, begun = Became(), time.monotonic()
    with context().Pool(workers, maxtasksperchild=100) as pool:
        for one in pool.imap(partial(from_state, seed, procedures), indices):
            total.add(one)
            if time.monotonic() - begun > within:
                break
    return total


def main() -> None:
    """Run the study and print its table."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--states", type=int, default=200)
    parser.add_argument("--first", type=int, default=0, help="number of the first state")
    parser.add_argument("--seed", type=int, default=1)
    parser.add_argument("--workers", type=int, default=1, help="processes of this machine")
    parser.add_argument("--within", type=float, default=math.inf, help="seconds after which no further state counts")
    parser.add_argument("--procedures", nargs="+", default=(), metavar="NAME", help="these only")
    given = parser.parse_args()
    started = time.monotonic()
    indices = range(given.first, given.first + given.states)
    became = study(given.seed, indices, given.workers, tuple(given.procedures), given.within)
    print("\n".join(lines(became, (CLEAN, FOUND, PRESSED))))
    print(f"\n{time.monotonic() - started:.0f} s")


if __name__ == "__main__":
    main()
