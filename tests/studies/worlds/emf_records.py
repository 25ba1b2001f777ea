"""Records of a driven motor's three voltages as a scope with faults would take them; nothing here knows the estimator's model."""

from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

FloatArray = NDArray[np.float64]


@dataclass(frozen=True)
class Changing:
    """A flux linkage that is not the same along a record: its mean over a turn, and over the record's time, is the setup's.

    An eccentric rotor, or magnets that are not alike, change it with the shaft's angle: `orders` are order of the turn, share and angle;
    channel k sees them `apart` (rad) times k later, as far as its coils are from each other around the stator. Magnets that warm up or
    cool down change it by `drift` (a share) from begin to end, with a time constant of `settling` records.
    """

    pole_pairs: int = 1
    orders: tuple[tuple[int, float, float], ...] = ()
    apart: float = 0.0
    drift: float = 0.0
    settling: float = 1.0

    def share(self, time: FloatArray, angle: FloatArray, channel: int) -> FloatArray:
        """Return by what share (n,) the flux linkage differs from its mean at times and electrical angles."""
        turn = angle / self.pole_pairs - self.apart * channel
        with_turn = sum(size * np.cos(order * turn + shift) for order, size, shift in self.orders)
        warmed = -np.expm1(-time / time[-1] / self.settling)
        return with_turn + self.drift * (warmed - np.mean(warmed)) / (warmed[-1] - warmed[0])


@dataclass(frozen=True)
class Setup:
    """A motor (flux linkage V·s/rad, harmonics of its EMF, each share and angle), how it turns, and the scope that looks at it.

    `steps` is the EMF's amplitude in converter steps, `noise` in steps; `gains` are the channels' own; `ends` the clipping levels as
    shares of the amplitude (−, +) of the converter, `rails` those of each probe's amplifier (C, 2), ahead of its noise, and `soft` (C,)
    where an amplifier bends; `flat` and `rounded` (rad) are a trapezoid's tops and corners, 0 for a sine; `frozen` readings of one channel
    from one on (channel, first, count as shares), `spikes` so many, up to 20 amplitudes; `lost` stretches (first, count) as shares of the
    record, whose samples are missing while the time goes on; `corner` (Hz) of a
    high-pass; `hum` share of the amplitude at `mains` (Hz), a channel each; `changing` is what the flux linkage does along the record.
    """

    flux: float = 0.01
    frequency: float = 80.0
    periods: float = 8.0
    points: int = 2500
    harmonics: tuple[tuple[int, float, float], ...] = ((5, 0.03, 0.4), (7, 0.01, 1.0))
    steps: float = 90.0
    noise: float = 0.4
    gains: tuple[float, ...] = (1.0, 1.0, 1.0)
    drift: float = 0.0
    ends: tuple[float, float] = (np.inf, np.inf)
    corner: float = 0.0
    hum: tuple[float, ...] = (0.0, 0.0, 0.0)
    mains: float = 50.0
    pole: float = np.inf
    rails: tuple[tuple[float, float], ...] = ((np.inf, np.inf),) * 3
    soft: tuple[float, ...] = (np.inf,) * 3
    flat: float = 0.0
    rounded: float = 0.1
    frozen: tuple[int, float, float] | None = None
    spikes: int = 0
    lost: tuple[tuple[float, float], ...] = ()
    changing: Changing | None = None

    @property
    def step(self) -> float:
        """One step of the converter (V)."""
        return self.flux * 2.0 * np.pi * self.frequency / self.steps


def record(random: np.random.Generator, setup: Setup) -> tuple[FloatArray, FloatArray]:
    """Return time (n,) and voltages (C, n) of one record."""
    n = setup.points
    time = np.arange(n) * setup.periods / setup.frequency / n
    place = time / time[-1] - 0.5
    speed = 2.0 * np.pi * setup.frequency * (1.0 + setup.drift * place)
    # The angle is the speed's own sum, trapezoid by trapezoid.
    angle = random.uniform(0, 2 * np.pi) + np.concatenate(
        ([0.0], np.cumsum(0.5 * (speed[1:] + speed[:-1])) * (time[1] - time[0]))
    )
    count = len(setup.gains)
    amplitude = setup.flux * 2.0 * np.pi * setup.frequency
    phase = random.uniform(0, 2 * np.pi, count)
    rows = []
    for k in range(count):
        at = angle - 2.0 * np.pi / 3.0 * k
        seen = _seen(setup, at, speed)
        if setup.changing is not None:
            share = setup.changing.share(time, angle, k)
            seen = (1.0 + share) * seen + np.gradient(share, time) * _linked(setup, at)
        rows.append(seen)
    v = np.array(rows) * np.array(setup.gains)[:, None]
    hum = amplitude * np.array(setup.hum)[:, None]
    v = v + hum * np.sin(2.0 * np.pi * setup.mains * time + phase[:, None])
    v = v + random.uniform(-1, 1, (count, 1)) * 2.0 * setup.step
    for k, ((down, up), bend) in enumerate(zip(setup.rails, setup.soft, strict=False)):
        v[k] = np.clip(v[k], -down * amplitude, up * amplitude)
        v[k] = v[k] if np.isinf(bend) else bend * amplitude * np.tanh(v[k] / (bend * amplitude))
    v = v + random.normal(0.0, 1.0, v.shape) * setup.noise * setup.step
    low, high = (level * amplitude * np.mean(setup.gains) for level in setup.ends)
    v = np.clip(v, -low, high)
    return _transferred(random, setup, time, np.round(v / setup.step) * setup.step)


def _transferred(
    random: np.random.Generator, setup: Setup, time: FloatArray, v: FloatArray
) -> tuple[FloatArray, FloatArray]:
    """Return the record as it arrives from the instrument."""
    if setup.frozen is not None:
        channel, first, share = setup.frozen
        begin = 1 + int(first * (time.size - 1))
        v[channel, begin : begin + int(share * time.size)] = v[channel, begin - 1]
    for _ in range(setup.spikes):
        size = large(random, 0.05, 20.0) * random.choice([-1, 1]) * setup.step * setup.steps
        v[random.integers(len(v)), random.integers(time.size)] += size
    whole = np.ones(time.size, dtype=bool)
    for first, share in setup.lost:
        whole[int(first * time.size) : int((first + share) * time.size)] = False
    return time[: np.count_nonzero(whole)], v[:, whole]


def _seen(setup: Setup, angle: FloatArray, speed: FloatArray) -> FloatArray:
    """One phase's EMF, flux linkage times speed, behind a high-pass and a low-pass, each wave as its own frequency has it."""
    if setup.flat:
        return setup.flux * speed * _trapezoid(setup, angle)
    total = np.zeros_like(angle)
    for order, share, turned in ((1, 1.0, 0.0), *setup.harmonics):
        f = order * setup.frequency
        passed = 1.0 / (1.0 - 1j * setup.corner / f) / (1.0 + 1j * f / setup.pole)
        total += share * abs(passed) * np.sin(order * angle + turned + np.angle(passed))
    return setup.flux * speed * total


def _linked(setup: Setup, angle: FloatArray) -> FloatArray:
    """One phase's flux linkage, whose change is its EMF."""
    waves = ((1, 1.0, 0.0), *setup.harmonics)
    return -setup.flux * sum(share / order * np.cos(order * angle + turned) for order, share, turned in waves)


def _trapezoid(setup: Setup, angle: FloatArray) -> FloatArray:
    """Return a trapezoid over the angle whose corners a Gaussian rounds, of fundamental 1."""
    points = np.linspace(-np.pi, np.pi, 3600, endpoint=False)
    sharp = np.clip((np.pi / 2.0 - np.abs(np.abs(points) - np.pi / 2.0)) / (0.5 * (np.pi - setup.flat)), 0.0, 1.0)
    window = np.fft.ifftshift(np.exp(-0.5 * (2.355 * points / setup.rounded) ** 2))
    wave = np.fft.ifft(np.fft.fft(sharp * np.sign(points)) * np.fft.fft(window)).real
    return np.interp(angle, points, wave / (2.0 * np.mean(wave * np.sin(points))), period=2.0 * np.pi)


def draw(random: np.random.Generator, *, gain_limit: float = 0.0) -> Setup:
    """Return a setup as it may come: a motor, its speed, and a good scope whose gains lie anywhere within their limits."""
    harmonics = tuple(
        (order, float(random.uniform(0, most)), float(random.uniform(0, 2 * np.pi)))
        for order, most in ((3, 0.03), (5, 0.05), (7, 0.02), (11, 0.003))
    )
    frequency = float(np.exp(random.uniform(np.log(20), np.log(500))))
    return Setup(
        flux=float(np.exp(random.uniform(np.log(1e-3), np.log(0.3)))),
        frequency=frequency,
        periods=float(np.exp(random.uniform(np.log(2.5), np.log(40.0)))),
        points=int(random.choice([1000, 2500, 10_000])),
        harmonics=harmonics,
        steps=float(random.uniform(25, 120)),
        noise=float(np.exp(random.uniform(np.log(0.1), np.log(2.0)))),
        gains=tuple(1.0 + random.uniform(-gain_limit, gain_limit, 3)),
        drift=float(random.choice([0.0, random.uniform(-0.05, 0.05)])),
    )


def large(random: np.random.Generator, low: float, high: float) -> float:
    """Return a size drawn evenly by its logarithm."""
    return float(np.exp(random.uniform(np.log(low), np.log(high))))


def changed(random: np.random.Generator, setup: Setup, cause: str) -> Setup:
    """Return the setup with a flux linkage that changes along the record: of an eccentric rotor, of magnets that warm up, or both.

    The record holds a whole turn at least, but of "part of a turn" 0.15 to 0.95 of one.
    """
    periods = large(random, 2.5, 10.0) if cause == "part of a turn" else setup.periods
    turns = random.uniform(0.15, 0.95) if cause == "part of a turn" else random.uniform(1.0, periods / 2.0)
    pole_pairs = max(2, int(np.ceil(periods / turns) if turns < 1.0 else periods / turns))
    size = large(random, 1e-4, 0.1)
    # An oval rotor, or magnets that are not alike, beside the eccentric one.
    orders = tuple(
        (order, float(share), float(random.uniform(0.0, 2.0 * np.pi)))
        for order, share in ((1, size), (2, size * random.uniform(0.0, 0.5)))
    )
    apart = float(random.choice([0.0, 2.0 * np.pi / 3.0, 2.0 * np.pi / 3.0 / pole_pairs]))
    drift = large(random, 1e-4, 0.1) * random.choice([-1, 1])
    changing = Changing(
        pole_pairs,
        orders if "turn" in cause else (),
        apart,
        drift if "drift" in cause else 0.0,
        large(random, 0.2, 10.0),
    )
    return replace(setup, periods=periods, changing=changing)


def spoil(random: np.random.Generator, setup: Setup, cause: str) -> Setup:
    """Return the setup with one cause of a size from negligible to gross."""
    match cause:
        case "clipped both sides":
            level = 1.0 - large(random, 1e-3, 0.3)
            return replace(setup, ends=(level, level))
        case "clipped one side":
            return replace(setup, ends=(np.inf, 1.0 - large(random, 1e-3, 0.3)))
        case "one channel's gain":
            size = large(random, 1e-3, 0.3) * random.choice([-1, 1])
            return replace(setup, gains=(setup.gains[0], setup.gains[1], setup.gains[2] * (1 + size)))
        case "all gains":
            sizes = large(random, 1e-3, 0.05) * random.uniform(-1, 1, 3)
            return replace(setup, gains=tuple(np.array(setup.gains) * (1 + sizes)))
        case "probe factor":
            factor = random.choice([0.1, 10.0, 3**-0.5, 2.0, 0.37])
            gains = list(setup.gains)
            gains[random.integers(3)] *= factor
            return replace(setup, gains=tuple(gains))
        case "AC coupled":
            return replace(setup, corner=float(random.uniform(1.0, 10.0)))
        case "hum":
            sizes = large(random, 1e-3, 0.1) * random.uniform(0, 1, 3)
            return replace(
                setup, hum=tuple(sizes), mains=float(random.choice([50.0, 60.0]) * random.uniform(0.998, 1.002))
            )
        case "noise below 0.1 LSB":
            return replace(setup, noise=float(random.uniform(0, 0.1)))
        case "cut before the noise":
            level = 1.0 - large(random, 1e-3, 0.3)
            return replace(setup, rails=((level, level),) * 3)
        case "cut before the noise, one side":
            return replace(setup, rails=((np.inf, 1.0 - large(random, 1e-3, 0.3)),) * 3)
        case "one probe cut":
            level = 1.0 - large(random, 1e-3, 0.3)
            return replace(setup, rails=((np.inf, np.inf), (level, level), (np.inf, np.inf)))
        case "one probe soft":
            return replace(setup, soft=(np.inf, np.inf, 1.0 / large(random, 0.03, 1.0)))
        case "trapezoid":
            return replace(
                setup, flat=float(np.radians(random.uniform(60, 130))), rounded=float(np.radians(large(random, 8, 25)))
            )
        case "frozen":
            share = large(random, 1e-3, 0.6)
            return replace(setup, frozen=(int(random.integers(3)), float(random.uniform(0, 1 - share)), share))
        case "spikes":
            return replace(setup, spikes=int(random.integers(1, 8)))
        case "samples lost":
            one = large(random, 1e-3, 0.9) / setup.periods
            starts = random.uniform(0, 1 - one, random.integers(1, 3))
            return replace(setup, lost=tuple((float(first), one) for first in starts))
        case "once per turn" | "part of a turn" | "slow drift" | "once per turn, slow drift":
            return changed(random, setup, cause)
    raise ValueError(cause)
