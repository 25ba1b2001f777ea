"""Slow turns of drives and rotors that the cogging's estimator does not list: gears, belts, couplings, eccentric and weak magnets.

`python -m tests.studies.cogging_worlds [--records N] [--seed S] [--workers N] [--rows NAME …]`

Magnitudes are log-uniform from negligible to gross. "Total" adds a transducer's gain limit of 0.2 %, drawn for each record. Rows
named "periods" are twelve periods of a known order, the others two turns. The truth is the cogging of the rotor as a whole: where its
amplitude differs along the turn, that of the mean amplitude of the part that was turned, and of the turn at "rotor eccentric".
"""

import numpy as np

from procedures.estimation.mechanics.cogging import fit_cogging
from tests.studies.cogging_misfit import SPEED, interval
from tests.studies.sweep_misfit import Estimates, Random, log, tell

_ALONE = (
    "nothing", "rotor eccentric", "gear modulates", "gear's mesh", "belt", "cardan joint", "compliant coupling",
    "coupling slips", "sticks and slips", "one magnet weak", "zero steps",
)  # fmt: skip
ROWS = (*_ALONE, *(f"periods: {name}" for name in _ALONE))


def record(row: str, random: Random) -> Estimates:
    """Draw a motor, a drive and what either does besides, and return what the estimator says of the readings."""
    known, what = row.startswith("periods: "), row.removeprefix("periods: ")
    order = int(random.choice((24, 36, 60, 84, 120) if known else (12, 24, 30, 42, 72)))
    count, turns = (120, 12.0 / order) if known else (500, 2.0)
    size, dirt = log(random, 3e-4, 3e-2), log(random, 1e-3, 0.9)
    parts, turned = np.array([1.0, random.uniform(0.0, 0.4)]), random.uniform(0.0, 6.3, 2)
    fine = np.linspace(0.0, 2.0 * np.pi, 20_001)

    def cogging(at: np.ndarray) -> np.ndarray:
        return np.asarray(size * parts @ np.sin(np.outer((order, 2 * order), at) + turned[:, None]))

    truth = float(np.ptp(cogging(fine)))
    time = (np.arange(count) + 0.4) / count * (2.0 * np.pi * turns / SPEED)
    told = SPEED * time
    angle = told * (1.0 + random.uniform(-0.004, 0.004)) + random.uniform(0.0, 6.3)
    drag, phase = size * random.uniform(1.0, 10.0), random.uniform(0.0, 6.3, 4)
    runs_out = sum(size * random.uniform(0.0, 2.0) * np.sin(k * angle + phase[k]) for k in (1, 2))
    teeth = int(random.choice([7, 11, 13, 17, 23, 31]))
    if what == "compliant coupling":
        # The cogging winds the coupling up, and the rotor is elsewhere than the angle says.
        for _ in range(40):
            angle = 0.5 * (angle + told + 0.5 * dirt / order * cogging(angle) / size)
    if what == "coupling slips":
        places = random.uniform(0.0, told[-1], int(random.integers(1, 4)))
        angle = angle - sum(0.3 * dirt / order * 6.3 * (told > place) for place in places)
    if what == "sticks and slips":
        pitch = 0.3 * dirt / order * 6.3
        angle = np.floor(angle / pitch) * pitch + 0.2 * pitch * random.random(count)
    torque = cogging(angle)
    match what:
        case "rotor eccentric":
            torque = torque * (1.0 + 0.5 * dirt * np.sin(angle + phase[0]))
            truth = float(np.ptp(cogging(fine) * (1.0 + 0.5 * dirt * np.sin(fine + phase[0]))))
        case "gear modulates":
            torque = torque * (1.0 + 0.5 * dirt * np.sin(angle / random.choice([2.0, 3.7]) + phase[0]))
        case "gear's mesh":
            torque = torque + size * dirt * np.sin(teeth * angle + phase[0])
        case "belt":
            torque = torque + size * dirt * np.sin(angle * random.uniform(0.15, 5.0) + phase[0])
        case "cardan joint":
            torque = torque * (1.0 + 0.1 * dirt * np.cos(2.0 * angle + phase[0]))
        case "one magnet weak":
            # Its pole cogs less: a gap in each turn.
            gap = np.exp(-((np.mod(angle + phase[0], 2.0 * np.pi) - 3.0) ** 2) / 0.1)
            torque = torque * (1.0 - dirt * gap)
        case "zero steps":
            torque = torque + size * dirt * (told > random.uniform(0.1, 0.9) * told[-1])
    read = torque + drag + runs_out + size * log(random, 0.01, 0.5) * random.standard_normal(count)
    found = fit_cogging(told, read, time=time, order=order if known else None, resolution=1e-3 * size)
    return found.misfit, {"cogging_torque": interval(found, truth)}


if __name__ == "__main__":
    tell(__doc__, ROWS, record)
