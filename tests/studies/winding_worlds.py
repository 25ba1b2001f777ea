"""Sweeps and four-wire readings of worlds that no estimator lists: what iron, winding, clamps, meters and hands do besides.

`python -m tests.studies.winding_worlds [--records N] [--seed S] [--workers N] [--rows NAME …]`

Magnitudes are log-uniform from negligible to gross. "Total" adds a meter's gain limit of 0.2 %, drawn for each record.
"""

import numpy as np

from procedures.estimation.winding.resistance import slope
from procedures.estimation.winding.sweep.rotor_sweep import axis_inductances, fit_rotor_sweep
from procedures.estimation.winding.sweep.timed_sweep import fit_timed_sweep
from tests.studies.sweep_misfit import Estimates, Random, log, of_fit, tell

WIRED = (
    "wires: nothing", "wires: winding heats at once", "wires: winding heats along", "wires: winding was warm",
    "wires: clamp heats", "wires: contact like a diode", "wires: two ranges", "wires: voltage soaks", "wires: bursts",
)  # fmt: skip
HAND = (
    "hand: nothing", "hand: iron saturates", "hand: iron saturates, steady", "hand: turning induces", "hand: slots",
    "hand: meter lags", "hand: meter warms up", "hand: stiff detent",
)  # fmt: skip
ANGLED = (
    "angles: nothing", "angles: iron saturates", "angles: detent moves the rotor", "angles: meter warms up",
    "angles: meter steps", "angles: play", "angles: slots",
)  # fmt: skip
IN_TURN = (
    "wires in turn: nothing", "wires in turn: winding was warm", "wires in turn: clamp heats",
    "wires in turn: contact like a diode", "wires in turn: two ranges",
)  # fmt: skip
#: At the end, so that the records of the rows before stay what they are.
RANGES = ("wires: range ends at a level", "wires: ranges with zeros", "wires in turn: range ends at a level")
ROWS = (*WIRED, *IN_TURN, *HAND, *ANGLED, *RANGES)


def wired(name: str, random: Random) -> Estimates:
    """Read four levels and the first again in both polarities; the current flows for a reading and rests until the next one."""
    levels = np.array([1.0, 0.75, 0.5, 0.25, 1.0])
    current, count = np.concatenate((levels, -levels)), 10
    if name.startswith("wires in turn"):
        # Each level both ways before the next: the amounts only fall, as a drift does.
        current = np.column_stack((levels[:-1], -levels[:-1])).ravel()
        count = current.size
    flows, rests = 0.4, log(random, 0.1, 20.0)
    size, noise, ohms = log(random, 1e-5, 0.02), log(random, 1e-5, 1e-3), np.ones(count)
    beside = np.full(count, random.uniform(-2e-3, 2e-3))
    if "heats" in name and "winding" in name:
        constant = log(random, 0.01, 0.2) if name.endswith("at once") else log(random, 0.2, 60.0)
        ohms = 1.0 + size * _warmth(current**2, constant, flows, rests)
    match name.partition(": ")[2]:
        case "winding was warm":
            ohms = 1.0 + size * (np.exp(-np.arange(count) * (flows + rests) / log(random, 5.0, 2000.0)) - 1.0)
        case "clamp heats":
            # A clamp's own heat lies on one of its two metals, whichever way the current flows.
            beside = beside + size * _warmth(current**2, log(random, 0.1, 20.0), flows, rests)
        case "contact like a diode":
            beside = beside + size * -np.expm1(-np.maximum(current, 0.0) / log(random, 0.05, 2.0))
        case "two ranges" | "range ends at a level" | "ranges with zeros":
            border = random.choice([0.3, 0.6, 0.8])
            if name.endswith("at a level"):
                # Which range reads that level is a matter of the last digit: of each polarity or of each reading.
                border = random.choice([0.25, 0.5, 0.75]) + random.choice(
                    [-1e-6, 1e-6], count if random.random() < 0.5 else 2
                )
                border = border if border.size == count else np.where(current > 0.0, *border)
            current_read = current * (1.0 + size * random.choice([-1.0, 1.0]) * (np.abs(current) < border))
            voltage = current + beside + noise * random.standard_normal(count)
            if name.endswith("with zeros"):
                # A voltmeter's zero keeps its sign, an ammeter that shows amounts gives its own the current's.
                lower, zero = np.abs(current) < border, border * size * random.uniform(-1.0, 1.0)
                current_read = current_read + zero * lower * (np.sign(current) if random.random() < 0.5 else 1.0)
            return of_fit(slope(voltage, current_read), {"resistance": 1.0})
        case "voltage soaks":
            # What the last reading left in a capacitor's dielectric.
            beside = beside + size * np.concatenate(([0.0], current[:-1]))
        case "bursts":
            beside = beside + np.where(random.random(count) < 0.3, size * random.standard_normal(count), 0.0)
    voltage = ohms * current + beside + noise * random.standard_normal(count)
    return of_fit(slope(voltage, current), {"resistance": 1.0})


def _warmth(power: np.ndarray, constant: float, flows: float, rests: float) -> np.ndarray:
    """Return how warm something of one time constant is at the end of each reading, share of what full current would come to."""
    warm, course = 0.0, []
    for each in power:
        warm = each + (warm - each) * np.exp(-flows / constant)
        course.append(warm)
        warm *= np.exp(-rests / constant)
    return np.array(course)


def turned(name: str, random: Random) -> Estimates:
    """Turn by hand through two electrical turns, 40 readings a period of the inductance."""
    what, fine, count = name.removeprefix("hand: "), 20, 160
    at = np.arange(count * fine) / (count * fine)
    speed = 1.0 + sum(
        random.uniform(0.0, 0.12) * np.sin(2.0 * np.pi * (random.uniform(0.3, 3.0) * at + random.uniform()))
        for _ in range(3)
    )
    speed = np.ones_like(at) if what.endswith("steady") else speed
    angle = np.cumsum(speed)
    angle = angle * 4.0 * np.pi / angle[-1] + random.uniform(0.0, 7.0)
    if what == "stiff detent":
        # The magnets pull the shaft on to their next place: the hand's spring gives way.
        order, pull = int(random.choice([6, 12])), log(random, 0.01, 0.9)
        angle = angle + pull / order * np.sin(order * angle)
        speed = np.gradient(angle)
        speed = speed / np.mean(speed)
    amplitude, noise = log(random, 0.005, 0.4), log(random, 2e-4, 5e-3)
    values = 1.0 - amplitude * np.cos(2.0 * angle)
    low, high = 1.0 - amplitude, 1.0 + amplitude
    size = log(random, 1e-3, 0.3)
    if what.startswith("iron saturates"):
        # A salient machine's permeance is even about both axes: the fourth order has its crest, or its trough, on both.
        fourth = size * amplitude * random.choice([-1.0, 1.0])
        values = values + fourth * np.cos(4.0 * angle)
        low, high = low + fourth, high + fourth
        if size > 0.25:
            # Beyond a quarter of the second order the extremes lie beside the axes, and the procedure asks for extremes.
            low, high = float(np.min(values)), float(np.max(values))
    if what == "turning induces":
        values = values + 0.1 * size / 0.3 * speed * np.sin(angle + random.uniform(0.0, 6.3))
    if what == "slots":
        # The procedure asks for the smallest and the largest, and these are what they are.
        values = values + 0.02 * size / 0.3 * np.cos(int(random.choice([6, 12, 18])) * angle + random.uniform(0.0, 6.3))
        low, high = float(np.min(values)), float(np.max(values))
    if what == "meter lags":
        # A meter's own filter: each reading is the mean of what came before, the latest most.
        length = log(random, 0.02, 1.0) * fine
        weight = np.exp(-np.arange(int(8 * length) + 1) / length)
        values = np.convolve(
            np.concatenate((np.full(weight.size - 1, values[0]), values)), weight / weight.sum(), "valid"
        )
    if what == "meter warms up":
        values = values * (1.0 - 0.1 * size * np.exp(-at / log(random, 0.05, 1.0)))
    read = values[fine // 2 :: fine] + random.normal(0.0, noise, count)
    fit = axis_inductances(fit_timed_sweep(0.5 * np.arange(count), read, expected_periods=4.0))
    return of_fit(fit, {"d_axis_inductance": low, "q_axis_inductance": high})


def angled(name: str, random: Random) -> Estimates:
    """Read at known angles over a mechanical turn, the first angle again at the end."""
    what, pairs = name.removeprefix("angles: "), int(random.integers(2, 8))
    angle = np.linspace(0.0, 2.0 * np.pi, int(random.integers(40, 90)))
    amplitude, noise, size = log(random, 0.03, 0.3), log(random, 3e-4, 5e-3), log(random, 1e-3, 0.3)
    stands, along = angle, np.linspace(0.0, 1.0, angle.size)
    if what.startswith("detent"):
        order = pairs * int(random.choice([2, 4, 6, 12]))
        stands = angle + 0.5 * size / pairs * np.sin(order * angle + random.uniform(0.0, 6.3))
    if what == "play":
        stands = angle - 0.2 * size / pairs * (np.sin(3.0 * angle + random.uniform(0.0, 6.3)) > 0.0)
    electrical = 2.0 * pairs * stands + 1.0
    values, low, high = 1.0 - amplitude * np.cos(electrical), 1.0 - amplitude, 1.0 + amplitude
    if what == "iron saturates":
        values = values + size * amplitude * random.choice([-1.0, 1.0]) * np.cos(2.0 * electrical)
        # The mean and the second order are what a dq model takes of it; the axes' own values lie beside by the fourth.
    if what == "slots":
        order, at = int(random.choice([12, 18, 24])), random.uniform(0.0, 6.3)
        values = values + 0.1 * size * np.cos(order * stands + at)
        if order == 2 * pairs:
            # As many slots as poles: their wave is the saliency's own.
            wave = float(abs(0.1 * size * np.exp(1j * (at - 1.0)) - amplitude))
            low, high = 1.0 - wave, 1.0 + wave
    if what == "meter warms up":
        values = values * (1.0 + 0.1 * size * random.choice([-1.0, 1.0]) * np.exp(-along / log(random, 0.05, 1.0)))
    if what == "meter steps":
        values = values * (1.0 + 0.1 * size * (along > random.uniform(0.1, 0.9)))
    fit = axis_inductances(fit_rotor_sweep(angle, values + random.normal(0.0, noise, angle.size), pole_pairs=pairs))
    return of_fit(fit, {"d_axis_inductance": low, "q_axis_inductance": high})


def recorded(name: str, random: Random) -> Estimates:
    """Draw one record of a row, and return what is estimated from it."""
    return (wired if name.startswith("wires") else turned if name in HAND else angled)(name, random)


if __name__ == "__main__":
    tell(__doc__, ROWS, recorded)
