"""The flux map at standstill on random instruments: errors and intervals of its points, and its points against the map at rotation.

`python -m tests.studies.standstill_map [--benches 20] [--seed 1] [--locations 20]`

The truth is the measured map of the 5.6 kW PM-SyRM; the rotor is locked. The magnets' flux linkage, which standstill does not see, is
stated with an error of up to 3 % (rectangular, as the procedure takes it).
"""

import argparse
from dataclasses import replace

import numpy as np

from sim_instruments.instruments.errors import Errors
from sim_instruments.physics.motor.flux_map import FluxMap
from tests.runs.flux_bench import BALDOR, errors_of, flux_bench, map_of, motor_on
from tests.sim_instruments.flux_maps import BALDOR_FILE


def main() -> None:
    """Print a line a bench, and what they come to."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--benches", type=int, default=20)
    parser.add_argument("--seed", type=int, default=1)
    parser.add_argument("--locations", type=int, default=20)
    given = parser.parse_args()
    truth = FluxMap.from_points(*np.loadtxt(BALDOR_FILE, delimiter=",", skiprows=1).T[:4])
    held, differing, worst = [], [], []
    for bench in range(given.benches):
        random = np.random.default_rng([given.seed, bench])
        stated = truth.flux_linkage * (1.0 + random.uniform(-0.03, 0.03))
        plate = replace(BALDOR, expected={"flux_linkage": stated})
        errors, seed = Errors.drawn(random), int(random.integers(1 << 31))
        found = {}
        for name, more in (("flux-map-standstill", ("lock=true",)), ("flux-map", ())):
            with flux_bench(motor_on(truth), plate, seed=seed, errors=errors) as virtual:
                result = map_of(virtual, plate, f"locations={given.locations}", *more, name=name)
            off, u = errors_of(result, truth)
            table = result.findings["tables"]["flux_map.csv"]
            found[name] = np.column_stack((table["id_A"], table["iq_A"])), off, u, result.findings["full_scale"]
        (at, off, u, scale), (there, other, u_other, _) = found.values()
        sure = u > 0.0
        held.append(float(np.mean(np.abs(off[sure]) <= 1.96 * u[sure])))
        worst.append(float(np.max(np.abs(off))) / scale)
        apart = np.hypot(*(at[:, None, :] - there[None, :, :]).transpose(2, 0, 1))
        pairs = [(k, int(np.argmin(row))) for k, row in enumerate(apart) if np.min(row) < 0.02 * np.max(np.abs(at))]
        # Each against the truth at its own current: the two places are not quite one.
        ratio = np.array(
            [np.abs(off[k] - other[m]) / np.hypot(u[k], u_other[m]) for k, m in pairs if np.all(u[k] > 0.0)]
        )
        differing.append(float(np.mean(ratio <= 1.96)))
        print(
            f"bench {bench}: {len(at)} currents, worst {worst[-1]:.2%}, {held[-1]:.0%} held; "
            f"{differing[-1]:.0%} of {ratio.size} within both uncertainties of the map at rotation",
            flush=True,
        )
    print(
        f"standstill: worst point median {np.median(worst):.2%}, 95 % {np.quantile(worst, 0.95):.2%}; held {np.mean(held):.1%}; "
        f"with rotation {np.mean(differing):.1%}"
    )


if __name__ == "__main__":
    main()
