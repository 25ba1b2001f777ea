"""Records with causes that no estimator has in its list, by integrations and converters of their own."""

from collections.abc import Callable
from dataclasses import replace

import numpy as np

from tests.studies.worlds.emf_records import draw as drawn_setup
from tests.studies.worlds.emf_records import record as emf_record
from tests.studies.worlds.shaft_records import Motion, Shaft

Random = np.random.Generator
FloatArray = np.ndarray
FINE, SAMPLES, BASELINE = 10, 2500, 0.2


def log(random: Random, low: float, high: float) -> float:
    """Draw a magnitude from negligible to gross."""
    return float(np.exp(random.uniform(np.log(low), np.log(high))))


def steps(name: str, random: Random, count: int) -> tuple[FloatArray, FloatArray, FloatArray]:
    """Return time, voltage and current (SAMPLES, count) of R = 1 Ω and L = 1 H, free of noise, and what acts within the circuit in them."""
    window = random.uniform(5.0, 9.0, count) / (1.0 - BASELINE)
    rise = np.where(random.random(count) < 0.5, 1e-9, np.exp(random.uniform(np.log(0.01), np.log(0.1), count)))
    source, h = random.uniform(0.0, 0.2, count), window / (SAMPLES * FINE)
    warming = np.exp(random.uniform(np.log(1e-4), np.log(0.05), count)) if name == "winding warms" else np.zeros(count)
    folds = name == "supply folds back"
    limit = random.uniform(0.3, 1.2, count) if folds else np.full(count, np.inf)
    left, reaction = random.uniform(0.1, 0.9, count), np.exp(random.uniform(np.log(0.01), np.log(1.0), count))
    current, supply = np.zeros(count), np.ones(count)
    volts, amperes = np.empty((SAMPLES, count)), np.empty((SAMPLES, count))
    for k in range(SAMPLES * FINE):
        since = (k - BASELINE * SAMPLES * FINE) * h
        if k % FINE == 0:
            emf = np.where(since > 0.0, -np.expm1(-np.maximum(since, 0.0) / rise), 0.0) * (1.0 + source) * supply
            volts[k // FINE], amperes[k // FINE] = emf - source * current, current
        middle = since + 0.5 * h
        emf = np.where(middle > 0.0, -np.expm1(-np.maximum(middle, 0.0) / rise), 0.0) * (1.0 + source) * supply
        loop = source + 1.0 + warming * np.maximum(middle, 0.0) / window
        half = current + 0.5 * h * (emf - loop * current)
        current = current + h * (emf - loop * half)
        if folds:
            supply = supply + h / reaction * (np.where(current > limit, left, 1.0) - supply)
    time = (np.arange(SAMPLES)[:, None] - BASELINE * SAMPLES) * (FINE * h)
    return time, volts, amperes


def step_channel(name: str, random: Random, time: FloatArray, v: FloatArray, i: FloatArray, mains: float) -> tuple:
    """Return time, voltage and current (n,) as probes and time base make them; `mains` (rad) is the line's frequency in the time's unit."""
    span = time[-1] - time[0]
    match name:
        case "60 Hz hum with its third":
            size, share = log(random, 1e-4, 0.03), random.uniform(0.1, 0.6)
            at = 1.2 * mains * time + random.uniform(0.0, 6.3)
            i = i + size * (np.sin(at) + share * np.sin(3.0 * at + random.uniform(0.0, 6.3)))
        case "aliased ripple":
            turn = 2.0 * np.pi * log(random, 0.3, 400.0) * time / span + random.uniform(0.0, 6.3)
            v = v + (time > 0.0) * log(random, 1e-3, 0.2) * np.sin(turn)
            i = i + (time > 0.0) * log(random, 1e-5, 0.01) * np.cos(turn)
        case "clock drifts":
            places, even = _bent(random, time.size), np.linspace(0.0, 1.0, time.size)
            v, i = np.interp(places, even, v), np.interp(places, even, i)
        case "magnetised probe":
            # A core's remanence follows what flowed, late.
            i = i + log(random, 1e-4, 0.03) * random.choice([-1.0, 1.0]) * i**2 / (log(random, 0.1, 1.0) + np.abs(i))
        case "probe's offset drifts":
            i = i + log(random, 1e-4, 0.03) * -np.expm1(-np.maximum(time, 0.0) / log(random, 0.3, 20.0))
        case "samples lost":
            # A stream's buffer overran: the time column is made from the sampling rate.
            begin, count = int(random.uniform(0.21, 0.7) * time.size), int(log(random, 1.0, 200.0))
            v, i, time = (
                np.delete(v, slice(begin, begin + count)),
                np.delete(i, slice(begin, begin + count)),
                time[:-count],
            )
        case "dropouts at the start":
            gone = slice(0, int(random.uniform(0.005, 0.15) * time.size))
            v, i = v.copy(), i.copy()
            v[gone], i[gone] = 0.0, 0.0
    return time, v, i


def _bent(random: Random, count: int) -> FloatArray:
    """Return places (n,) between 0 and 1 at which a clock that drifts takes its samples."""
    even, bend = np.linspace(0.0, 1.0, count), random.choice([-1.0, 1.0]) * log(random, 1e-4, 0.03)
    return even + bend * even * (1.0 - even)


def converter(name: str, random: Random, code: float) -> Callable[[FloatArray], FloatArray]:
    """Return what a converter with steps of `code` reads, as its name says with faults of its own."""
    every, bend = int(random.choice([2, 4, 8, 16])), log(random, 0.1, 4.0)
    period, phase = random.uniform(30.0, 200.0), random.uniform(0.0, 6.3)

    def read(values: FloatArray) -> FloatArray:
        at = values / code
        if name == "bent converter":
            at = at + bend * np.sin(2.0 * np.pi * at / period + phase)
        codes = np.round(at)
        if name == "missing codes":
            codes = np.where(codes % every == every - 1, codes + 1, codes)
        return codes * code

    return read


def exported(name: str, random: Random, rows: FloatArray) -> FloatArray:
    """Return channels (C, n) as the program that writes the file makes them of what the converter read."""
    if name == "rows repeated":
        every = int(random.choice([2, 3, 4, 8]))
        late = int(random.integers(every))
        places = np.arange(rows.shape[-1])
        rows = rows[..., np.maximum((places + late) // every * every - late, 0)]
    if name == "smoothed":
        # As a spreadsheet does: the mean of so many readings, in full.
        length = int(log(random, 2.0, 0.04 * rows.shape[-1]))
        rows = np.apply_along_axis(np.convolve, -1, rows, np.full(length, 1.0 / length), "valid")
    if name == "filtered":
        left, out = np.exp(-1.0 / log(random, 0.5, 0.01 * rows.shape[-1])), rows.copy()
        for k in range(1, rows.shape[-1]):
            out[..., k] = left * out[..., k - 1] + (1.0 - left) * rows[..., k]
        rows = out
    if name == "one channel's rows repeated":
        which, every = int(random.integers(len(rows))), int(random.choice([2, 4]))
        rows = rows.copy()
        rows[which] = rows[which, np.arange(rows.shape[-1]) // every * every]
    return rows


def emf(name: str, random: Random, gain_limit: float) -> tuple[FloatArray, FloatArray, float, float]:
    """Return time (n,), three voltages (3, n), flux linkage and a converter's step."""
    setup = drawn_setup(random, gain_limit=gain_limit)
    time, v = emf_record(random, replace(setup, steps=1e9, noise=0.0))
    size, along = setup.flux * 2.0 * np.pi * setup.frequency, np.linspace(0.0, 1.0, time.size)
    match name:
        case "60 Hz hum with its third":
            at = 2.0 * np.pi * 60.0 * time
            v = v + size * log(random, 1e-3, 0.1) * (np.sin(at) + random.uniform(0.1, 0.6) * np.sin(3.0 * at + 1.0))
        case "aliased ripple":
            at = 2.0 * np.pi * log(random, 0.3, 400.0) * along + random.uniform(0.0, 6.3, (3, 1))
            v = v + size * log(random, 1e-3, 0.1) * np.sin(at)
        case "clock drifts":
            places = _bent(random, time.size)
            v = np.array([np.interp(places, along, each) for each in v])
        case "gain warms up":
            v = v * (1.0 + log(random, 1e-4, 0.05) * random.choice([-1.0, 1.0]) * (np.exp(-3.0 * along) - 0.32))
        case "speed wobbles":
            turns = setup.periods / random.integers(2, 12)
            wobble = log(random, 1e-4, 0.05) * np.sin(2.0 * np.pi * turns * along + random.uniform(0.0, 6.3))
            warped = np.cumsum(1.0 + wobble)
            places = (warped - warped[0]) / (warped[-1] - warped[0])
            v = (1.0 + wobble) * np.array([np.interp(places, along, each) for each in v])
        case (
            "polarities unequal"
            | "converter's segments"
            | "second and third order"
            | "dead zone"
            | "slews"
            | "remembers"
        ):
            which = slice(None) if random.random() < 0.5 else slice(int(random.integers(3)), None)
            v[which] = [_bent_channel(name, random, row / size, setup.step / size) * size for row in v[which]]
        case "gaps between magnets" | "odd harmonics":
            # Nothing is wrong with the channels: a rotor's own waveform.
            orders = np.arange(3, 26, 2)
            share, turn = random.uniform(0.0, 0.3, 12) / orders**1.5, random.choice([0.0, np.pi], 12)
            at = (
                2.0 * np.pi * setup.frequency * time
                + random.uniform(0.0, 6.3)
                - 2.0 * np.pi / 3.0 * np.arange(3)[:, None]
            )
            if name == "odd harmonics":
                more = sum(s * np.sin(k * at + t) for k, s, t in zip(orders, share, turn, strict=True))
                v = size * (np.sin(at) + more)
            else:
                gap, edge = log(random, 0.02, 0.5), log(random, 0.05, 0.4)
                wave = lambda x: np.sin(x) * (1.0 - np.exp(-((np.abs(np.sin(x)) / edge) ** 2)) * gap)  # noqa: E731
                whole = np.linspace(0.0, 2.0 * np.pi, 4000, endpoint=False)
                v = size * wave(at) / (2.0 * np.mean(wave(whole) * np.sin(whole)))
        case "dropouts at the start":
            v[:, : int(random.uniform(0.005, 0.3) * time.size)] = 0.0
    read = converter(name, random, setup.step)
    codes = read(v + setup.noise * setup.step * random.standard_normal(v.shape))
    rows = exported(name, random, codes)
    step = setup.step if name not in ("smoothed", "filtered") else 1e-6 * setup.step
    return time[: rows.shape[-1]], rows, setup.flux, step


def _bent_channel(name: str, random: Random, wave: FloatArray, step: float) -> FloatArray:
    """Return what a channel that is not straight makes of a wave (n,) of amplitude 1 about; `step` is its converter's."""
    if name == "polarities unequal":
        return np.where(wave > 0.0, wave * (1.0 + log(random, 1e-3, 0.2) * random.choice([-1.0, 1.0])), wave)
    if name == "converter's segments":
        borders = np.linspace(-1.3, 1.3, int(random.choice([8, 16, 32])))
        off = log(random, 0.1, 6.0) * step * random.standard_normal(borders.size)
        return wave + off[np.searchsorted(borders, wave).clip(0, borders.size - 1)]
    if name == "second and third order":
        second, third = log(random, 1e-3, 0.1) * random.standard_normal(2)
        return wave + second * wave**2 + third * wave**3
    if name == "dead zone":
        width = log(random, 1e-3, 0.1)
        return np.sign(wave) * np.maximum(np.abs(wave) - width, 0.0)
    if name == "slews":
        # An amplifier that cannot follow the steepest part.
        limit = (1.0 - log(random, 1e-3, 0.3)) * float(np.max(np.abs(np.diff(wave))))
        out = wave.copy()
        for k in range(1, wave.size):
            out[k] = out[k - 1] + np.clip(wave[k] - out[k - 1], -limit, limit)
        return out
    # A core or a dielectric remembers: the reading lags by a width that does not go with speed.
    width, out = log(random, 1e-3, 0.1), wave.copy()
    for k in range(1, wave.size):
        out[k] = np.clip(out[k - 1], wave[k] - width, wave[k] + width)
    return out


def turned(name: str, random: Random, shaft: Shaft, motion: Motion) -> Motion:
    """Return a shaft's motion as a sensor with faults of its own gives it."""
    speed, time = motion.speed, motion.time
    match name:
        case "a tooth is missing":
            teeth = int(random.integers(12, 61))
            inside = np.mod(motion.angle, 2.0 * np.pi) < 4.0 * np.pi / teeth
            speed = np.where(inside, 0.5 * speed, speed)
        case "one tooth is off":
            speed = speed * (1.0 + log(random, 1e-3, 0.2) * (np.mod(motion.angle, 2.0 * np.pi) < 0.2))
        case "coupling with backlash":
            since = time - time[min(motion.released, time.size - 1)]
            bounce = np.abs(np.mod(since / log(random, 0.02, 0.2), 2.0) - 1.0) - 0.5
            speed = speed + np.where(
                since > 0.0,
                shaft.top * log(random, 1e-3, 0.03) * bounce * np.exp(-np.maximum(since, 0) / log(random, 0.05, 0.5)),
                0.0,
            )
        case "clock drifts":
            bend = random.choice([-1.0, 1.0]) * log(random, 1e-4, 0.03)
            time = time + bend * time * (1.0 - time / time[-1])
            even = np.linspace(0.0, time[-1], time.size)
            return replace(
                motion, time=even, speed=np.interp(even, time, speed), angle=np.interp(even, time, motion.angle),
                released=int(np.searchsorted(even, time[min(motion.released, time.size - 1)])),
            )  # fmt: skip
        case "display refreshes":
            every = log(random, 0.002, 0.1)
            speed = np.interp(np.floor(time / every) * every, time, speed)
        case "tachometer's zero":
            speed = speed + random.choice([-1.0, 1.0]) * log(random, 1e-4, 0.02) * shaft.top
    return replace(motion, speed=speed)
