"""How often two procedures of one run contradict each other on clean motors: every such warning is a false alarm.

python -m tests.studies.contradictions [--motors 220] [--seed 9301] [--procedures NAME …]
"""

import argparse
from collections import Counter

import numpy as np

from procedures.core.parameter_set import merge
from sim_instruments.bench import BenchSetting, VirtualBench
from sim_instruments.instruments.errors import Errors
from tests.studies.worlds.measured_motor import carry_out, study_plan
from tests.studies.worlds.random_motors import draw_motor

INDUCTANCES = ("stator-resistance", "dq-inductance-extremes", "dq-inductance-aligned", "dq-inductance-time-constant")


def main() -> None:
    """Measure and print."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--motors", type=int, default=220)
    parser.add_argument("--seed", type=int, default=9301)
    parser.add_argument("--procedures", nargs="*", default=INDUCTANCES)
    given = parser.parse_args()
    plan, told, motors, pairs = study_plan(given.procedures), Counter[str](), 0, 0
    for index in range(given.motors):
        random = np.random.default_rng([given.seed, index])
        motor, plate = draw_motor(random)
        ambient = float(random.uniform(18.0, 28.0))
        seed = int(random.integers(1 << 31))
        errors = Errors.drawn(random)
        angle = float(random.uniform(0.0, 6.28))
        setting = BenchSetting(ambient_temperature=ambient, initial_angle=angle)
        bench = VirtualBench(motor, seed=seed, errors=errors, setting=setting, sockets=False)
        with bench:
            found = merge(carry_out(bench, plate, int(random.integers(1 << 31)), plan).results)
        warned = [str(notice.message) for notice in found.notices]
        motors += bool(warned)
        pairs += sum(
            len(found.alternatives[name])
            for name in ("d_axis_inductance", "q_axis_inductance")
            if name in found.parameters
        )
        told.update(notice.partition(":")[0] for notice in warned)
        for notice in warned:
            print(f"motor {index}: {notice}", flush=True)
    print(f"{motors} of {given.motors} motors with a warning; inductances compared {pairs} times; {dict(told)}")


if __name__ == "__main__":
    main()
