"""Current steps with one disturbance or two, integrated in fine steps; nothing of the estimator is used."""

from collections.abc import Callable
from dataclasses import dataclass, field

import numpy as np

from tests.studies.worlds.bent_probes import drawn_probe

Random = np.random.Generator
BASELINE = 0.2


@dataclass
class Batch:
    """Circuits of R = 1 Ω and L = τ, a column each: what acts on them, None or 0 where nothing does.

    Times are in τ, currents and voltages in units of the step's; `tau` (s) places them on the mains' time scale.
    """

    count: int
    random: Random
    tau: np.ndarray = field(init=False)
    window: np.ndarray = field(init=False)
    rise: np.ndarray = field(init=False)
    source: np.ndarray = field(init=False)
    skew: np.ndarray = field(init=False)
    pole: np.ndarray = field(init=False)
    knee: np.ndarray = field(init=False)
    magnets: np.ndarray = field(init=False)
    coupling: np.ndarray = field(init=False)
    closed: np.ndarray = field(init=False)
    corner: np.ndarray = field(init=False)
    voltage_corner: np.ndarray = field(init=False)
    hum: np.ndarray = field(init=False)
    voltage_hum: np.ndarray = field(init=False)
    slope: np.ndarray = field(init=False)
    limit: np.ndarray = field(init=False)
    cut: np.ndarray = field(init=False)
    voltage_cut: np.ndarray = field(init=False)
    #: Where an amplifier ends ahead of the noise.
    top: np.ndarray = field(init=False)
    odd: np.ndarray = field(init=False)
    resonance: np.ndarray = field(init=False)
    voltage_resonance: np.ndarray = field(init=False)
    damping: np.ndarray = field(init=False)
    divider: np.ndarray = field(init=False)
    divider_time: np.ndarray = field(init=False)
    begin: np.ndarray = field(init=False)
    #: 1 where the current's probe bends, 2 where it is magnetised as well.
    bend: np.ndarray = field(init=False)
    #: Noise of the voltage besides that of the converter, as of a small step on a large range.
    voltage_noise: np.ndarray = field(init=False)
    law: str = "atan"
    #: Whether the converters' last codes come with the record.
    known: bool = False
    #: Samples of a record, and steps of the integration for each.
    points: int = 2500
    fine: int = 10

    def __post_init__(self) -> None:
        r, n = self.random, self.count
        self.tau = self.spread(3e-4, 1e-2)
        self.window = r.uniform(5.0, 9.0, n)
        self.rise = np.where(r.uniform(size=n) < 0.5, 0.0, self.spread(0.01, 0.1))
        self.source = r.uniform(0.0, 0.2, n)
        zero = (
            "skew",
            "pole",
            "magnets",
            "coupling",
            "corner",
            "voltage_corner",
            "hum",
            "voltage_hum",
            "slope",
            "odd",
            "begin",
            "divider",
            "bend",
            "voltage_noise",
        )
        for name in (*zero, "resonance", "voltage_resonance"):
            setattr(self, name, np.zeros(n))
        self.damping, self.divider_time = np.full(n, 0.2), np.ones(n)
        for name in ("knee", "closed", "limit", "cut", "voltage_cut", "top"):
            setattr(self, name, np.full(n, np.inf))

    def spread(self, low: float, high: float) -> np.ndarray:
        """Magnitudes, as likely in each decade."""
        return np.exp(self.random.uniform(np.log(low), np.log(high), self.count))


@dataclass(frozen=True)
class Sampled:
    """A record as a scope gives it, with its converters' steps."""

    time: np.ndarray
    voltage: np.ndarray
    current: np.ndarray
    voltage_step: float
    current_step: float
    resistance: float
    inductance: float
    voltage_ends: tuple[float, float] | None = None
    current_ends: tuple[float, float] | None = None


def _currents(batch: Batch) -> Callable[[np.ndarray, np.ndarray], tuple[np.ndarray, np.ndarray]]:
    """Return what gives currents of the winding and of the closed circuit from their flux linkages, both of inductance 1."""
    k, knee, bends = batch.coupling, batch.knee, np.isfinite(batch.knee)
    if np.any(bends):
        if batch.law == "atan":
            # Magnets fill part of the iron: by `magnets` of the knee, negative where the current is against them.
            filled = batch.magnets
            steep, reached = 1.0 + filled**2, np.arctan(filled)
            return lambda flux, second: (
                np.where(bends, knee * (np.tan(np.minimum(flux / knee / steep + reached, 1.5)) - filled), flux),
                second,
            )
        return lambda flux, second: (np.where(bends, knee * np.arctanh(np.minimum(flux / knee, 0.999)), flux), second)
    stray = 1 - k**2
    return lambda flux, second: ((flux - k * second) / stray, (second - k * flux) / stray)


def _source(batch: Batch, at: np.ndarray) -> np.ndarray:
    """Open-circuit voltage of the supply at times since the step."""
    raised = -np.expm1(-np.maximum(at, 0.0) / np.maximum(batch.rise, 1e-12))
    return np.where(at > 0.0, np.where(batch.rise > 0.0, raised, 1.0), 0.0) * (1.0 + batch.source)


def _coupled(signals: np.ndarray, share: np.ndarray) -> np.ndarray:
    """Signals (n, count) through high passes whose corners are `share` of the reciprocal of their interval."""
    passed, left = np.zeros_like(signals), np.exp(-share)
    for k, change in enumerate(np.diff(signals, axis=0), 1):
        passed[k] = left * passed[k - 1] + change
    return passed


def _resonant(signals: np.ndarray, turning: np.ndarray, damping: np.ndarray) -> np.ndarray:
    """Signals (n, count) behind resonances of `turning` (rad) an interval: exact for what runs straight from one to the next."""
    fall = turning * (damping - 1j * np.sqrt(1.0 - damping**2))
    kept, natural = np.exp(-fall), turning**2 / (1j * turning * np.sqrt(1.0 - damping**2) * fall)
    end = 1.0 + (kept - 1.0) / fall
    driven = end * signals[1:] + (1.0 - kept - end) * signals[:-1]
    state, passed = np.zeros(turning.size, dtype=complex), np.zeros_like(signals)
    for k, each in enumerate(driven, 1):
        state = kept * state + each
        passed[k] = np.real(natural * state)
    return passed


def integrated(batch: Batch) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Return time (τ), voltage at the winding and current as the probe gives it (count, samples), free of noise."""
    n, per, fine = batch.count, batch.fine, batch.points * batch.fine
    step = batch.window / (1 - BASELINE) / fine
    start = (BASELINE * fine + batch.random.integers(0, per, n)).astype(int)
    flux, second, low, high = (np.zeros(n) for _ in range(4))
    voltages, probed = np.zeros((fine + 1, n)), np.zeros((fine // per + 1, n))
    late = np.round(batch.skew / step).astype(int)
    history = np.zeros((fine + 1, n))
    closed = np.where(np.isfinite(batch.closed), batch.closed, 0.0)
    columns, held = np.arange(n), np.zeros(n, dtype=bool)
    since = (np.arange(fine + 1)[:, None] - start) * step
    at_step, at_middle = _source(batch, since), _source(batch, since + 0.5 * step)
    filtered = batch.pole > 0.0
    pole = np.where(filtered, -np.expm1(-step / np.maximum(batch.pole, 1e-12)), 1.0)
    corner = -np.expm1(-step * batch.corner)
    # What acts on no circuit of the batch is left out: a record is some ten thousand steps.
    limited, probe = np.any(np.isfinite(batch.limit)), np.any(filtered) or np.any(batch.corner > 0.0)
    bent = np.any(batch.coupling) or np.any(closed) or np.any(np.isfinite(batch.knee))
    currents_of, half, falling, half_falling = _currents(batch), 0.5 * step, step * closed, 0.5 * step * closed
    for k in range(fine + 1):
        now, other = currents_of(flux, second) if bent else (flux, second)
        history[k] = now
        v = voltages[k] = at_step[k] - batch.source * now
        if limited:
            held |= now + step >= batch.limit
            v = voltages[k] = np.where(held, np.minimum(v, now), v)
        if probe:
            seen = history[np.clip(k - late, 0, k), columns]
            low = np.where(filtered, low + (seen - low) * pole, seen)
            if k % per == 0:
                probed[k // per] = low - high
            high = high + (low - high) * corner
        # The midpoint's rule, from within a step on which the supply does not switch.
        v = at_middle[k] - batch.source * now
        half_flux = flux + half * ((np.where(held, np.minimum(v, now), v) if limited else v) - now)
        one, two = half_flux, second
        if bent:
            one, two = currents_of(half_flux, second - half_falling * other)
            second = second - falling * two
        v = at_middle[k] - batch.source * one
        flux = flux + step * ((np.where(held, np.minimum(v, one), v) if limited else v) - one)
    if np.any(batch.resonance):
        history = _resonant(history, step * batch.resonance, batch.damping)
    if np.any(batch.voltage_resonance):
        voltages = _resonant(voltages, step * batch.voltage_resonance, batch.damping)
    if np.any(batch.divider):
        voltages = voltages + batch.divider * _coupled(voltages, step / batch.divider_time)
    if np.any(batch.voltage_corner > 0.0):
        voltages = _coupled(voltages, step * batch.voltage_corner)
    samples = np.arange(fine // per + 1) * per
    time = samples[None] * step[:, None] - (start * step)[:, None]
    currents = probed if probe else history[np.maximum(samples[:, None] - late, 0), columns]
    for k in np.flatnonzero(batch.bend):
        currents[:, k] = drawn_probe(batch.random, magnetised=batch.bend[k] > 1.0).read(currents[:, k])
    return time, voltages[samples].T, currents.T


def sampled(batch: Batch, *, bits: int | None = None, noise: tuple[float, float] = (0.15, 2.0)) -> list[Sampled]:
    """Return the records: hum, slope, offset, noise and the converter put on; `noise` is in codes, 80 % of the range is used."""
    random = batch.random
    time, voltage, current = integrated(batch)
    result = []
    for k in range(batch.count):
        seconds = time[k] * batch.tau[k]
        turned = 2 * np.pi * random.choice([50.0, 60.0]) * seconds
        angle = turned + random.uniform(0, 6.3)
        i = current[k] + batch.hum[k] * np.sin(angle) + batch.slope[k] * time[k] / (time[k, -1] - time[k, 0])
        # What a lead picks up of the edge, ringing.
        i = i + batch.odd[k] * np.exp(-np.maximum(time[k], 0) / 0.7) * np.sin(9.0 * np.maximum(time[k], 0))
        i = np.minimum(i, batch.top[k])
        v = voltage[k]
        if batch.voltage_hum[k]:
            # Drawn only here, so that records without it stay what they were.
            v = v + batch.voltage_hum[k] * np.sin(turned + random.uniform(0, 6.3))
        if batch.voltage_noise[k]:
            v = v + random.normal(0, batch.voltage_noise[k], v.size)
        b = bits or int(random.choice([8, 12]))
        code = 1.0 / (0.8 * 2**b)
        share = float(np.exp(random.uniform(*np.log(noise))))
        channels, ends = [], []
        for signal, cut in ((v, batch.voltage_cut[k]), (i, batch.cut[k])):
            offset = random.uniform(-0.05, 0.05)
            read = np.round((signal + offset + random.normal(0, share * code, signal.size)) / code) * code
            last = np.round((cut + offset) / code) * code if np.isfinite(cut) else np.inf
            channels.append(np.minimum(read, last))
            ends.append((-np.inf, last) if batch.known else None)
        keep = slice(int(np.searchsorted(time[k], batch.begin[k])) if batch.begin[k] else 0, None)
        result.append(
            Sampled(seconds[keep], channels[0][keep], channels[1][keep], code, code, 1.0, float(batch.tau[k]), *ends)
        )
    return result


def row(name: str, count: int, *seed: int) -> Batch:
    """Return a batch by the name of its disturbance, from negligible to gross."""
    batch = Batch(count, np.random.default_rng([*seed, *name.encode()]))
    signs = batch.random.choice([-1.0, 1.0], count)
    for part in name.split(" + "):
        match part.split(",")[0]:
            case "clean":
                pass
            case "skew":
                batch.skew = batch.spread(1e-4, 5e-2)
            case "pole":
                batch.pole = batch.spread(1e-4, 0.15)
            case "saturation":
                batch.knee = batch.spread(1.2, 40.0)
                batch.law = "tanh" if "tanh" in part else "atan"
                if "magnets" in part:
                    batch.magnets = signs * batch.spread(0.1, 1.0)
            case "eddy":
                batch.coupling, batch.closed = batch.spread(0.03, 0.5), batch.spread(2.0, 30.0)
            case "hum":
                batch.hum = batch.spread(1e-4, 0.03)
            case "large hum":
                batch.hum = batch.spread(0.3, 4.0)
            case "voltage hum":
                batch.voltage_hum = batch.spread(1e-4, 0.03)
            case "slope":
                batch.slope = signs * batch.spread(1e-4, 0.03)
            case "high-pass":
                batch.corner = batch.spread(1e-4, 0.3)
            case "voltage high-pass":
                batch.voltage_corner = batch.spread(1e-4, 3.0)
            case "divider":
                # What a wrong compensation passes more or less above a frequency than below.
                batch.divider, batch.divider_time = signs * batch.spread(3e-3, 0.2), batch.spread(0.03, 3.0)
            case "bend":
                # Each record has a probe of its own, as near to its limit as it is drawn.
                batch.bend = np.full(count, 2.0 if "magnetised" in part else 1.0)
            case "noisy voltage":
                batch.voltage_noise = batch.spread(0.01, 0.15)
            case "clipped":
                batch.cut, batch.known = batch.random.uniform(0.5, 1.0, count), "known" in part
            case "flat top":
                batch.top = batch.random.uniform(0.5, 1.0, count)
            case "voltage clipped":
                batch.voltage_cut, batch.known = batch.random.uniform(0.8, 1.0, count), "known" in part
            case "current limit":
                batch.limit = batch.random.uniform(0.6, 1.0, count)
            case "late":
                batch.begin = batch.spread(1e-3, 2.0)
            case "ringing":
                batch.odd = batch.spread(1e-4, 0.03)
            case "probe rings" | "voltage's probe rings" as which:
                # In the winding's time constants: from a slow probe's to a few samples a period.
                which = "resonance" if which == "probe rings" else "voltage_resonance"
                setattr(batch, which, batch.spread(8.0, 300.0))
                batch.damping = batch.spread(0.03, 0.7)
            case other:
                raise ValueError(f"no row '{other}'")
    return batch


ROWS = (
    "clean",
    "skew",
    "pole",
    "saturation, atan",
    "saturation, tanh",
    "saturation, magnets",
    "eddy",
    "hum",
    "large hum",
    "voltage hum",
    "hum + voltage hum",
    "slope",
    "high-pass",
    "voltage high-pass",
    "divider",
    "bend",
    "bend, magnetised",
    "noisy voltage",
    "clipped, codes known",
    "clipped",
    "flat top",
    "voltage clipped, codes known",
    "voltage clipped",
    "current limit",
    "late",
    "skew + hum",
    "saturation + high-pass",
    "pole + slope",
    "divider + hum",
    "bend + hum",
    "ringing",
    "probe rings",
    "voltage's probe rings",
    "ringing + hum",
)
