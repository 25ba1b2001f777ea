"""Windings beside closed circuits, read by a bridge at several frequencies: `python -m tests.studies.closed_circuits --records N`."""

import argparse
from dataclasses import replace

import numpy as np

from procedures.estimation.winding.second_circuit import SeriesReading, second_circuit
from tests.procedures.estimation.winding.test_second_circuit import FREQUENCIES, IRON, WINDINGS, readings, spoiled

#: Test frequencies (Hz), longest time constant (s) that is asked for, and what is held against the truth.
ASKED = (("L", FREQUENCIES, IRON), ("R", (80.0, 40.0, 20.0), 0.03))
#: Shortest and longest time constant (s) of a row's circuits, and how many; a field that diffuses has one for every odd order.
ROWS = {
    "winding alone": (0.0, 0.0, 0),
    "losses in the wire": (0.0, 0.0, 0),
    "one circuit": (1e-5, 5e-3, 1),
    "two circuits": (1e-5, 5e-3, 2),
    "two circuits, a slow one": (1e-5, 2e-2, 2),
    "diffusion": (1e-4, 5e-3, 10),
}


def drawn(
    random: np.random.Generator, row: str, winding: tuple[float, float], frequencies: tuple[float, ...]
) -> list[SeriesReading]:
    """Return what a bridge within its limits of error reads of such a winding."""
    shortest, longest, count = ROWS[row]
    coupling = random.uniform(0.02, 0.4)
    if row == "diffusion":
        first = np.exp(random.uniform(np.log(shortest), np.log(longest)))
        circuits = [(0.81 * coupling / n**2, first / n**2) for n in range(1, 2 * count, 2)]
    else:
        circuits = [
            (coupling / count, float(np.exp(random.uniform(np.log(shortest), np.log(longest))))) for _ in range(count)
        ]
    read = readings(*winding, list(random.uniform(-1.0, 1.0, 2 * len(frequencies))), frequencies=frequencies)
    read = spoiled(read, winding, circuits, 0.0, 1.0)
    if row == "losses in the wire":
        rise = random.uniform(0.005, 0.05)
        read = [replace(r, resistance=r.resistance + rise * winding[1] * (r.frequency / 1000.0) ** 2) for r in read]
    return read


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--records", type=int, default=200)
    parser.add_argument("--seed", type=int, default=1)
    given = parser.parse_args()
    print(
        f"{'of':<3}{'row':<28}{'seen, %':>9}{'held, %':>9}{'half-width, %':>15}{'worst, half-widths':>20}{'beyond 3':>10}"
    )
    for which, frequencies, slowest in ASKED:
        for row in ROWS:
            random = np.random.default_rng(given.seed)
            widths, beyond = [], []
            for k in range(given.records):
                winding = WINDINGS[k % len(WINDINGS)]
                found = second_circuit(drawn(random, row, winding, frequencies), slowest)
                held = None if found is None else found.inductance if which == "L" else found.resistance
                if held is None:
                    continue
                true = winding[0] if which == "L" else winding[1]
                half = (held.high - held.low) / 2.0
                widths.append(half / true)
                beyond.append(max(held.low - true, true - held.high) / half)
            seen = 100.0 * len(widths) / given.records
            if not widths:
                print(f"{which:<3}{row:<28}{seen:>9.1f}{'-':>9}{'-':>15}{'-':>20}{'-':>10}", flush=True)
                continue
            kept, far = 100.0 * np.mean(np.array(beyond) <= 0.02), sum(b > 2.0 for b in beyond)
            width, worst = 100.0 * np.median(widths), 1.0 + max(beyond)
            print(f"{which:<3}{row:<28}{seen:>9.1f}{kept:>9.1f}{width:>15.2f}{worst:>20.2f}{far:>10}", flush=True)


if __name__ == "__main__":
    main()
