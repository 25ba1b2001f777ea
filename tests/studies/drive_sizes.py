"""Errors of a drive at stated sizes over random motors: does what is said of a map or a short circuit still hold it?

`python -m tests.studies.drive_sizes --error NAME=SIZE … [--procedure flux-map] [--pairs P] [--motors N] [--seed S]`

An error is a field of the drive in its unit (`dead_time=3e-6`, `current_gain=0.05`) or `angle_deg=3.9` (electrical); several come
together. The drive's own errors within its data sheet are on top. `--pairs` takes the first motors of the seed that have so many
pole pairs. Without an error the drive is as its data sheet says.

Printed for each motor: its pole pairs, how many figures hold the truth, the worst in half-widths, the largest error of a flux linkage in
shares of the largest one, what was said; then the row as `coverage --disturbed` has it.
"""

import argparse
import math
from collections.abc import Callable, Iterator
from itertools import count, islice

import numpy as np

from tests.studies.disturbances.causes import Cause
from tests.studies.disturbances.dirt import Dirt
from tests.studies.disturbances.disturbed import Row, add, measure_disturbed, table
from tests.studies.worlds.random_motors import draw_motor

_ANGLE = "angle_deg"


def errors_of(given: list[str]) -> dict[str, float]:
    """Return the drive's fields of what was given as NAME=SIZE."""
    pairs = [each.partition("=")[::2] for each in given]
    return {
        ("angle_error" if name == _ANGLE else name): math.radians(float(size)) if name == _ANGLE else float(size)
        for name, size in pairs
    }


def soiled(errors: dict[str, float]) -> Callable[[Dirt], None]:
    """Return what puts these errors on a bench's drive."""
    return lambda dirt: dirt.inverter(**errors)


def of_pairs(seed: int, pairs: int | None) -> Iterator[int]:
    """Yield the motors of a seed, with `pairs` those that have so many pole pairs."""
    for index in count():
        if pairs is None or draw_motor(np.random.default_rng([seed, index]))[0].pole_pairs == pairs:
            yield index


def line(index: int, pairs: int, row: Row) -> str:
    """Return what became of one motor."""
    told = [one for _, one in row.told]
    if not told:
        return f"motor {index}, {pairs} pairs: no figure ({row.reasons})"
    points = [one.error * one.width for one in told if one.name in ("psi_d", "psi_q")]
    worst = max(told, key=lambda one: one.error)
    return (
        f"motor {index}, {pairs} pairs: {sum(one.held for one in told)} of {len(told)} held, worst {worst.error:.2f} U ({worst.name}), "
        f"ψ off by {max(points, default=math.nan):.2%}, {', '.join(sorted(row.said)) or 'nothing said'}"
    )


def main() -> None:
    """Measure and print."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--error", nargs="*", default=[], metavar="NAME=SIZE")
    parser.add_argument("--procedure", default="flux-map")
    parser.add_argument("--pairs", type=int, default=None)
    parser.add_argument("--motors", type=int, default=12)
    parser.add_argument("--seed", type=int, default=1)
    given = parser.parse_args()
    name = " ".join(given.error) or "none"
    cause = Cause(name, (given.procedure,), soiled(errors_of(given.error)), drive=True)
    total = Row()
    for index in islice(of_pairs(given.seed, given.pairs), given.motors):
        row = measure_disturbed(given.seed, index, cause)
        print(line(index, draw_motor(np.random.default_rng([given.seed, index]))[0].pole_pairs, row), flush=True)
        add(total, row)
    print("\n".join(table({cause.row: total})))


if __name__ == "__main__":
    main()
