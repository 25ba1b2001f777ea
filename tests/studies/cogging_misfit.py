"""How often the interval of a slow turn's cogging torque holds the truth when the world is not as the model says.

`python -m tests.studies.cogging_misfit [--records N] [--seed S] [--workers N] [--rows NAME …]`

Magnitudes are log-uniform from negligible to gross. "Total" adds a transducer's gain limit of 0.2 %, drawn for each record. Rows
named "periods" are twelve periods of a known order, the others two turns.
"""

from collections.abc import Callable

import numpy as np

from procedures.estimation.mechanics.cogging import Cogging, fit_cogging
from tests.studies.sweep_misfit import Estimate, Estimates, Random, log, tell

_ALONE = (
    "clean", "zero drifts", "hum", "clipped", "spikes", "frozen", "uneven speed", "filter, stated", "coarse",
    "friction jumps (not in the list)", "coloured noise (not in the list)", "a knock (not in the list)",
    "uneven speed and hum", "zero drifts and spikes",
)  # fmt: skip
ROWS = (*_ALONE, *(f"periods: {name}" for name in _ALONE), "periods: another order")
SPEED = 2.0 * np.pi * 0.1


def record(row: str, random: Random) -> Estimates:
    """Draw a motor, a turn and what disturbs it, and return what the estimator says of it."""
    known, name = row.startswith("periods: "), row.removeprefix("periods: ")
    order = int(random.choice((24, 36, 84, 120) if known else (12, 24, 36, 42, 72)))
    orders = np.array([order, 2 * order])
    size = log(random, 3e-4, 3e-2)
    sizes, phases = size * np.array([1.0, random.uniform(0.0, 0.4)]), random.uniform(0.0, 6.3, 2)
    fine = np.linspace(0.0, 2.0 * np.pi, 40_001)
    truth = float(np.ptp(sizes @ np.sin(np.outer(orders, fine) + phases[:, None])))
    n, turns = (120, 12.0 / order) if known else (500, 2.0)
    time = (np.arange(n) + random.uniform(0.0, 0.8, n)) / n * (2.0 * np.pi * turns / SPEED)
    angle = SPEED * time * (1.0 + random.uniform(-0.004, 0.004))
    if "uneven" in name:
        along = time / time[-1]
        wave = np.sin(2.0 * np.pi * random.uniform(0.3, 1.7) * along + random.uniform(0.0, 6.3))
        angle = angle[-1] * np.cumsum(1.0 + log(random, 1e-3, 0.1) * wave) / n
    lag = log(random, 1e-3, 0.03) if "filter" in name else 0.0
    passed = 1.0 / (1.0 + 1j * orders * SPEED * lag)
    # Run-out comes once and twice a turn.
    torque = random.uniform(1.0, 10.0) * size + sum(
        size * random.uniform(0.0, 2.0) * np.sin(k * angle + random.uniform(0.0, 6.3)) for k in (1, 2)
    )
    torque = torque + np.imag((sizes * np.exp(1j * phases) * passed) @ np.exp(1j * np.outer(orders, angle)))
    noise = size * log(random, 0.01, 0.5)
    torque, step, at_end = _disturbed(name, random, time / time[-1], time, torque, size, noise)
    read = torque + noise * random.standard_normal(n) if step == 0.0 else np.round(torque / step) * step
    read = at_end(read)
    even = SPEED * time
    found = fit_cogging(
        even,
        read,
        time=time,
        order=_given(order) if "another" in name else order if known else None,
        resolution=step or 1e-3 * size,
        torque_filter=lag,
    )
    return found.misfit, {"cogging_torque": interval(found, truth)}


def _given(order: int) -> int:
    """Return an order that is none of the motor's, and has none of its among its multiples."""
    return {24: 20, 36: 30, 84: 72, 120: 108}[order]


def _disturbed(
    name: str, random: Random, along: np.ndarray, time: np.ndarray, torque: np.ndarray, size: float, noise: float
) -> tuple[np.ndarray, float, Callable[[np.ndarray], np.ndarray]]:
    """Return the torque with what disturbs it, a converter's step where it matters, and what an instrument makes of the readings."""
    n = along.size
    if "zero" in name:
        torque = torque + size * log(random, 0.01, 10.0) * (1.0 - np.exp(-along / random.uniform(0.1, 1.0)))
    if "hum" in name:
        mains = float(random.choice((50.0, 60.0)))
        torque = torque + size * log(random, 0.01, 3.0) * np.sin(2.0 * np.pi * mains * time + random.uniform(0.0, 6.3))
    if name.startswith("friction jumps"):
        places = np.cumsum(random.exponential(0.08, 60))
        jumps = size * log(random, 0.01, 2.0) * random.standard_normal(61)
        torque = torque + jumps[np.searchsorted(places, along)]
    if name.startswith("coloured"):
        walk = np.cumsum(random.standard_normal(n))
        walk -= np.convolve(walk, np.ones(25) / 25.0, mode="same")
        torque = torque + size * log(random, 0.01, 1.0) * walk / np.std(walk)
    if name.startswith("a knock"):
        torque = torque + size * log(random, 0.1, 20.0) * np.exp(-(((along - random.uniform(0.1, 0.9)) / 0.02) ** 2))
    if name == "coarse":
        return torque, size * log(random, 0.01, 1.0), lambda read: read
    if name == "clipped":
        span = float(np.ptp(torque))
        top = float(np.max(torque)) - span * log(random, 0.003, 0.4)
        return torque, 0.0, lambda read: np.minimum(read, top)
    if "spikes" in name:
        struck = random.random(n) < log(random, 0.002, 0.05)
        worth = np.where(random.random(n) < 0.5, 0.0, torque + size * log(random, 1.0, 100.0))
        return torque, 0.0, lambda read: np.where(struck, worth, read)
    if name == "frozen":
        begin, long = int(random.integers(0, n - 40)), int(log(random, 2, 40))
        held = np.arange(n)
        held[begin : begin + long] = begin
        return torque, 0.0, lambda read: read[held]
    return torque, 0.0, lambda read: read


def interval(found: Cogging, truth: float) -> Estimate:
    """Return the interval as the procedure makes it, without what the instrument adds."""
    if not found.peak_to_peak:
        return Estimate(0.5 * found.hidden, 0.0, found.hidden, truth)
    middle = found.peak_to_peak + 0.5 * found.above
    limit = float(np.hypot(0.5 * found.above, found.hidden))
    half = 2.0 * float(np.hypot(found.uncertainty, limit / np.sqrt(3.0)))
    return Estimate(middle, middle - half, middle + half, truth)


if __name__ == "__main__":
    tell(__doc__, ROWS, record)
