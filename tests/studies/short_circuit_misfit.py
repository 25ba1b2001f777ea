"""How often the intervals of `analyze short-circuit` hold, on tables by formula of random motors with and without disturbances.

python -m tests.studies.short_circuit_misfit [--tables 100] [--seed 1] [--rows NAME …]
"""

import argparse
import math

import numpy as np

from procedures.estimation.flux.short_circuit import fit_short_circuit
from procedures.estimation.winding.short_circuit import current

PAIRS, FLUX, ROWS = 4, 0.05, 9
NAMES = {
    "chord_inductance": "d_axis_inductance",
    "q_axis_inductance": "q_axis_inductance",
    "resistance": "stator_resistance",
}
DISTURBED = ("warming", "unequal phases", "iron loss", "speed error")


def judged(seed: int, index: int, disturbance: str, torques: bool) -> dict[str, tuple[bool, bool, float] | None]:
    """Return of each figure whether it is held, whether it lies beyond 3 U, and U/value; None where it is withheld.

    Magnitudes are log-uniform: warming takes 0.05 … 4 % of the flux linkage and three to six times as much is added to the
    resistance, the phase probed is 0.05 … 3 % off, iron takes 0.1 … 10 % of the heat at the highest speed, the speed is 0.01 … 1 % off.
    """
    random = np.random.default_rng([seed, index])

    def log(low: float, high: float) -> float:
        return math.exp(random.uniform(math.log(low), math.log(high)))

    resistance = log(0.01, 10.0)
    l_d = resistance * log(1e-4, 2e-2)
    l_q = l_d * random.uniform(1.0, 3.0)
    speed = resistance / math.sqrt(l_d * l_q) * np.geomspace(0.15, log(4.0, 20.0), ROWS)
    along, noise = np.linspace(0.0, 1.0, ROWS), log(5e-4, 5e-3)
    sizes = log(5e-4, 0.04), log(5e-4, 0.03), log(1e-3, 0.1), log(1e-4, 0.01)
    warming, phase, iron, off = (size * (disturbance == name) for size, name in zip(sizes, DISTURBED, strict=True))
    r, flux = resistance * (1.0 + random.uniform(3.0, 6.0) * warming * along), FLUX * (1.0 - warming * along)
    rows = zip(speed, r, flux, strict=True)
    amplitude = np.array([float(current(at, warm, l_d, l_q, left)) for at, warm, left in rows])
    heat = 1.5 * r * amplitude**2 * (1.0 + iron * (speed / speed[-1]) ** 2)
    readings = random.standard_normal((2, ROWS))
    torque = heat * PAIRS / speed * (1.0 + noise * readings[1])
    sign = random.choice([-1.0, 1.0])
    fit = fit_short_circuit(
        speed * (1.0 + sign * off),
        amplitude * (1.0 + sign * phase) * (1.0 + noise * readings[0]),
        torque if torques else None,
        pole_pairs=PAIRS,
        flux_linkage=FLUX,
    )
    truths = {"chord_inductance": l_d, "q_axis_inductance": l_q, "resistance": resistance}
    result: dict[str, tuple[bool, bool, float] | None] = {}
    for name, truth in truths.items():
        figure = getattr(fit, name) or (fit.resistance_by_current if name == "resistance" else None)
        if figure is None or fit.misfit.withholding(NAMES[name]) is not None:
            result[name] = None
            continue
        low, high = figure.coverage_interval
        side = high - figure.value if truth > figure.value else figure.value - low
        result[name] = (low <= truth <= high, abs(truth - figure.value) > 3.0 * side, 0.5 * (high - low) / figure.value)
    return result


def main() -> None:
    """Measure and print."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--tables", type=int, default=100)
    parser.add_argument("--seed", type=int, default=1)
    parser.add_argument("--rows", nargs="*", default=["clean", *DISTURBED])
    given = parser.parse_args()
    print(
        "| table | torques | figure | held | beyond 3 U | median U | withheld |\n| --- | --- | --- | ---: | ---: | ---: | ---: |"
    )
    for row in given.rows:
        for torques in (False, True):
            found = [judged(given.seed, index, row, torques) for index in range(given.tables)]
            for name in NAMES:
                kept = [each for one in found if (each := one[name]) is not None]
                held, beyond, width = zip(*kept, strict=True) if kept else ((0,), (0,), (0.0,))
                print(
                    f"| {row} | {'yes' if torques else 'no'} | {NAMES[name]} | {np.mean(held):.0%} | {sum(beyond)} "
                    f"| {np.median(width):.2%} | {len(found) - len(kept)} |",
                    flush=True,
                )


if __name__ == "__main__":
    main()
