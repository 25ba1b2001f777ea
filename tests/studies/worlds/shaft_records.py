"""Ramps of shafts with friction, fans, cogging, filters and bad sensors in them: own integration of the motion, own sensors."""

from dataclasses import dataclass, field

import numpy as np
from numpy.typing import ArrayLike

from procedures.estimation.fitting.fit import Fit
from procedures.estimation.mechanics.inertia import fit_coast_downs
from procedures.estimation.mechanics.turning import SpeedRamp
from sim_instruments.disturbances.first_order import recursion

Random = np.random.Generator


def fit_coast_down(time: ArrayLike, speed: ArrayLike, speed_resolution: float = 0.0) -> Fit:
    """Fit one coast-down (s, rad/s)."""
    measured = np.asarray(time, dtype=np.float64), np.asarray(speed, dtype=np.float64)
    return fit_coast_downs([SpeedRamp(*measured, 0.0, speed_resolution)])


@dataclass
class Shaft:
    """One shaft and its sensors; torques in N·m, speeds in rad/s, times in s. Disturbances are off at 0."""

    inertia: float
    coulomb: float
    viscous: float
    torque: float
    top: float
    noise: float
    torque_noise: float
    samples: int
    settling: float
    coast_share: float = 0.2
    quadratic: float = 0.0
    stribeck: float = 0.0
    stribeck_speed: float = 1.0
    stribeck_power: float = 1.0
    cogging: float = 0.0
    cogging_order: int = 24
    eccentricity: float = 0.0
    speed_filter: float = 0.0
    torque_filter: float = 0.0
    dropouts: int = 0
    thinning: float = 0.0
    steps: int = field(default=6000)

    def friction(self, speed: float) -> float:
        """Return what brakes at a speed above zero, without cogging."""
        low = np.exp(-((abs(speed) / self.stribeck_speed) ** self.stribeck_power))
        return self.coulomb + self.viscous * speed + self.quadratic * speed**2 + self.stribeck * low


def draw(random: Random) -> Shaft:
    """Return a shaft without disturbances."""
    top = _log(random, 40.0, 500.0)
    inertia = _log(random, 1e-5, 5e-3)
    coast = _log(random, 0.6, 8.0)
    ratio = _log(random, 0.05, 3.0)
    coulomb = 0.8 * top * inertia / coast / (1.0 + 0.6 * ratio)
    ramp = random.uniform(0.5, 2.0)
    return Shaft(
        inertia=inertia,
        coulomb=coulomb,
        viscous=ratio * coulomb / top,
        torque=inertia * top / ramp + coulomb * (1.0 + 0.5 * ratio),
        top=top,
        noise=top * _log(random, 1e-4, 3e-3),
        torque_noise=_log(random, 1e-3, 1e-2),
        samples=int(_log(random, 150, 900)),
        settling=float(random.choice([0.0, 0.05])),
    )


def _log(random: Random, low: float, high: float) -> float:
    return float(np.exp(random.uniform(np.log(low), np.log(high))))


@dataclass(frozen=True)
class Motion:
    """Time (s), speed (rad/s) and angle (rad) on a fine grid; the drive lets go at index `released`."""

    time: np.ndarray
    speed: np.ndarray
    angle: np.ndarray
    released: int


def move(shafts: list[Shaft]) -> list[Motion]:
    """Integrate shafts from standstill to the top speed and down again, all at once, by Runge and Kutta's fourth-order steps."""

    def of(name: str) -> np.ndarray:
        return np.array([getattr(each, name) for each in shafts], dtype=float)

    j, tc, b, c, torque, top = map(of, ("inertia", "coulomb", "viscous", "quadratic", "torque", "top"))
    s, ws, power, a, order = map(of, ("stribeck", "stribeck_speed", "stribeck_power", "cogging", "cogging_order"))
    thinning, share, steps = of("thinning"), of("coast_share"), max(each.steps for each in shafts)
    up = 1.6 * j * top / (torque - tc - 0.6 * b * top)
    down = 1.3 * (1.0 - share) * top * j / (tc + 0.2 * b * top)
    h = (np.maximum(up, 0.0) + down) / steps
    span = h * steps
    w, angle, driving = np.zeros(len(shafts)), np.zeros(len(shafts)), np.ones(len(shafts), dtype=bool)
    speeds, angles = np.empty((steps, len(shafts))), np.empty((steps, len(shafts)))
    released, stopped = np.full(len(shafts), steps), np.full(len(shafts), steps)

    def rate(w: np.ndarray, angle: np.ndarray, t: np.ndarray) -> np.ndarray:
        held = tc * (1.0 - thinning * t / span) + c * w**2
        if sticking:
            held = held + s * np.exp(-((np.abs(w) / ws) ** power))
        braking = np.sign(w + 1e-9) * held + b * w
        if cogged:
            braking = braking + a * np.sin(order * angle)
        return (driven - braking) / j

    # What acts on none of the shafts is left out: a motion is some ten thousand evaluations.
    sticking, cogged = np.any(s), np.any(a)
    driven = torque
    for k in range(steps):
        speeds[k], angles[k] = w, angle
        t = k * h
        k1 = rate(w, angle, t)
        k2 = rate(w + h / 2 * k1, angle + h / 2 * w, t + h / 2)
        k3 = rate(w + h / 2 * k2, angle + h / 2 * w + h * h / 4 * k1, t + h / 2)
        k4 = rate(w + h * k3, angle + h * w + h * h / 2 * k2, t + h)
        angle = angle + h * w + h * h / 6 * (k1 + k2 + k3)
        w = w + h / 6 * (k1 + 2 * k2 + 2 * k3 + k4)
        done = driving & (w >= top)
        if done.any():
            released[done] = k + 1
            driving = driving & ~done
            driven = driving * torque
        ended = ~driving & (w <= share * top) & (stopped == steps)
        if ended.any():
            stopped[ended] = k + 1
            if stopped.max() < steps:
                break
    return [
        Motion(np.arange(stopped[k]) * h[k], speeds[: stopped[k], k], angles[: stopped[k], k], int(released[k]))
        for k in range(len(shafts))
    ]


def _behind(values: np.ndarray, step: float, tau: float) -> np.ndarray:
    """Return what a first-order low-pass makes of values that begin at rest."""
    if tau <= 0.0:
        return values
    k = 2.0 * tau / step
    return recursion((values + np.concatenate([[0.0], values[:-1]])) / (1 + k), (k - 1) / (1 + k))


def record(shaft: Shaft, motion: Motion, random: Random, *, stated: bool = False) -> list[SpeedRamp]:
    """Return the driven ramp and the coast as the sensors read them; `stated` tells the estimator the filters."""
    step = float(motion.time[1])
    seen = motion.speed * (1.0 + shaft.eccentricity * np.cos(motion.angle + 1.0))
    seen = _behind(seen, step, shaft.speed_filter)
    torque = np.where(np.arange(motion.time.size) < motion.released, shaft.torque, 0.0)
    torque = _behind(torque, step, shaft.torque_filter)
    ramps = []
    switch = motion.time[min(motion.released, motion.time.size - 1)]
    for number, (begin, end) in enumerate(((0.0, switch), (switch, motion.time[-1]))):
        since = begin + max(shaft.settling, 3 * step)
        time = np.linspace(since, end - 3 * step, shaft.samples)
        speed = np.interp(time, motion.time, seen) + random.normal(0.0, shaft.noise, time.size)
        if shaft.dropouts:
            bad = random.choice(time.size, min(shaft.dropouts, time.size // 20), replace=False)
            speed[bad] = np.where(random.random(bad.size) < 0.7, 0.0, random.uniform(0.0, 3.0 * shaft.top, bad.size))
        driven: float | np.ndarray = 0.0
        if number == 0:
            driven = np.interp(time, motion.time, torque)
            driven = driven + random.normal(0.0, shaft.torque_noise * shaft.torque, time.size)
        told = (shaft.speed_filter, shaft.torque_filter) if stated else (0.0, 0.0)
        ramps.append(SpeedRamp(time - time[0], speed, driven, 0.0, *told))
    return ramps
