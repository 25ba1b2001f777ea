"""Simulated records with a known truth, and how an estimator does on them against its bound."""

from collections.abc import Callable
from dataclasses import dataclass
from functools import cache, lru_cache
from typing import Any

import numpy as np

from procedures.estimation.emf.back_emf import fit_back_emf
from procedures.estimation.emf.integrated_flux import flux_by_integration
from procedures.estimation.emf.period import peak_amplitude
from procedures.estimation.fitting.fit import Fit, coverage_interval
from procedures.estimation.mechanics.inertia import fit_ramps, two_point
from procedures.estimation.mechanics.turning import SpeedRamp
from procedures.estimation.winding.current_step.response import fit_step_response, time_constant_63
from procedures.estimation.winding.sweep.rotor_sweep import (
    axis_inductances,
    extremes,
    fit_rotor_sweep,
    saliency_significant,
)
from procedures.estimation.winding.sweep.timed_sweep import fit_timed_sweep

Random = np.random.Generator
#: Estimate and uncertainty (NaN for a method that has none), degrees of freedom.
Told = tuple[float, float, float]
NO_UNCERTAINTY = (float("nan"), float("inf"))


@dataclass(frozen=True)
class Case:
    """An estimator on one kind of record: its trial, the true value, and the variance that no unbiased one undercuts.

    Cases of one `trial` read what they tell from the same results of it.
    """

    name: str
    trial: Callable[[Random], Any]
    truth: float
    bound: float
    read: Callable[[Any], Told] = lambda result: result


@dataclass(frozen=True)
class Score:
    """Efficiency = bound / mean squared error, bias in standard deviations of the estimate, coverage of 95 % intervals."""

    name: str
    trials: int
    efficiency: float
    bias: float
    coverage: float


@lru_cache(maxsize=1)
def _results(trial: Callable[[Random], Any], trials: int, seed: int) -> list[Any]:
    random = np.random.default_rng(seed)
    return [trial(random) for _ in range(trials)]


def score(case: Case, trials: int, seed: int = 1) -> Score:
    told = [case.read(result) for result in _results(case.trial, trials, seed)]
    estimates = np.array([value for value, _, _ in told])
    covered = [low <= case.truth <= high for low, high in (coverage_interval(*each) for each in told)]
    coverage = float(np.mean(covered)) if np.isfinite(told[0][1]) else float("nan")
    error = estimates - case.truth
    return Score(
        case.name, trials, case.bound / float(np.mean(error**2)), float(np.mean(error) / np.std(estimates)), coverage
    )


def told(fit: Fit, name: str) -> Told:
    return fit.value(name), fit.uncertainty(name), fit.degrees_of_freedom


def quantised(values: np.ndarray, step: float, random: Random) -> np.ndarray:
    """A converter with one step rms of noise before it."""
    return np.round((values + random.normal(0, step, values.shape)) / step) * step


# --- step response: 6 time constants after the step, on both channels 80 % of the converter's range ---

R, L, V = 0.1, 1e-4, 1.0
TAU = L / R


def step_record(random: Random, bits: int, *, rise: float = 0.0, points: int = 2000, before: float = 0.25):
    """A step at a random instant between two samples, with probe offsets; `rise` is the supply's time constant in τ."""
    interval = 6 * TAU / points
    count = int(before * points)
    time = (np.arange(points + count) - count) * interval
    since = np.maximum(time + random.uniform(0, interval), 0.0)
    if rise:
        rate = 1 / (rise * TAU)
        v = V * -np.expm1(-rate * since)
        i = V / R * -np.expm1(-since / TAU) - V / L * (np.exp(-rate * since) - np.exp(-since / TAU)) / (1 / TAU - rate)
    else:
        v = np.where(time >= 0, V, 0.0)
        i = V / R * -np.expm1(-since / TAU)
    v_step, i_step = V / (0.8 * 2**bits), V / R / (0.8 * 2**bits)
    return time, quantised(v + 0.02, v_step, random), quantised(i + 0.3, i_step, random), v_step, i_step


def step_case(bits: int, rise: float = 0.0) -> Case:
    def trial(random: Random):
        time, v, i, v_step, i_step = step_record(random, bits, rise=rise)
        return told(fit_step_response(time, v, i, voltage_resolution=v_step, current_resolution=i_step), "inductance")

    noise = np.sqrt(13 / 12) / (0.8 * 2**bits)
    shape = f"supply rising with {rise:g} τ" if rise else "sharp step"
    return Case(f"L, step fit, {bits} bit, {shape}", trial, L, (3.5 * noise * L) ** 2 / (2000 / 6))


def crossing_case(bits: int) -> Case:
    def trial(random: Random):
        time, _, i, _, _ = step_record(random, bits)
        return time_constant_63(time, i) * R, *NO_UNCERTAINTY

    noise = np.sqrt(13 / 12) / (0.8 * 2**bits)
    return Case(f"L, 63 % crossing, {bits} bit", trial, L, (3.5 * noise * L) ** 2 / (2000 / 6))


# --- rotor sweep: 120 readings, line to line ---

LD, LQ, READ_NOISE, READINGS = 70e-6, 80e-6, 0.5e-6, 120


def sweep_record(random: Random, *, wobble: float = 0.0, turns: float = 8.0, saliency: float = 1.0):
    """Course of 2θ as a share of the sweep (0 … 1) and inductance readings; the hand's speed varies by `wobble`."""
    at = np.linspace(0, 1, READINGS)
    course = 2 * np.pi * turns * (at + wobble / (2 * np.pi) * np.sin(2 * np.pi * at + random.uniform(0, 6)))
    clean = LD + LQ - saliency * (LQ - LD) * np.cos(course + random.uniform(0, 6))
    return at, clean + random.normal(0, READ_NOISE, READINGS)


def sweep_case(kind: str) -> Case:
    def trial(random: Random):
        at, readings = sweep_record(
            random, wobble=0.2 if kind == "timed" else 0.0, turns=4.0 if kind == "timed" else 8.0
        )
        if kind == "extremes":
            return extremes(readings)[0] / 2, *NO_UNCERTAINTY
        if kind == "timed":
            return told(axis_inductances(fit_timed_sweep(10 * at, readings), 0.5), "d_axis_inductance")
        return told(axis_inductances(fit_rotor_sweep(2 * np.pi * at, readings, pole_pairs=4), 0.5), "d_axis_inductance")

    names = {
        "known": "Ld, sweep fit, known angle",
        "timed": "Ld, sweep fit, turned by hand",
        "extremes": "Ld, extremes",
    }
    return Case(names[kind], trial, LD, 3 * READ_NOISE**2 / (4 * READINGS))


def false_saliency(trials: int, *, timed: bool, seed: int = 2) -> float:
    """Share of motors without saliency that are said to have one."""
    random, found = np.random.default_rng(seed), 0
    for _ in range(trials):
        at, readings = sweep_record(random, saliency=0.0)
        fit = fit_timed_sweep(10 * at, readings) if timed else fit_rotor_sweep(2 * np.pi * at, readings, pole_pairs=4)
        found += saliency_significant(fit)[0]
    return found / trials


# --- back-EMF: three channels, 5.3 periods, 5 % fifth harmonic, 8 bit ---

FLUX, SPEED, SAMPLES = 0.01, 2 * np.pi * 53.0, 2000


def emf_record(random: Random, *, drift: float = 0.0, step: float | None = None):
    """Three phases; `drift` is the relative change of speed over the record of 0.1 s."""
    time = np.arange(SAMPLES) * 0.1 / SAMPLES
    place = (time - 0.05) / 0.1
    speed = SPEED * (1 + drift * place)
    angle = SPEED * 0.1 * (place + drift * place**2 / 2) + random.uniform(0, 6)
    angles = angle - 2 * np.pi / 3 * np.arange(3)[:, None]
    clean = FLUX * speed * (np.cos(angles) + 0.05 * np.cos(5 * angles))
    return time, quantised(clean, step or FLUX * SPEED / 100, random)


def emf_case(kind: str) -> Case:
    step = FLUX * SPEED / 100

    def trial(random: Random):
        time, v = emf_record(random, drift=0.05 if kind == "drift" else 0.0)
        if kind == "peak":
            return float(np.mean([peak_amplitude(row) for row in v])) / SPEED, *NO_UNCERTAINTY
        if kind == "drift":
            flux = flux_by_integration(time, v)
            return *flux.mean(), flux.degrees_of_freedom
        fit = fit_back_emf(time, v, resolution=step)
        return fit.flux_linkage.value, fit.flux_linkage.uncertainty, fit.degrees_of_freedom

    names = {"fit": "λ, harmonic fit", "drift": "λ, integrated, speed drifting 5 %", "peak": "λ, peak reading"}
    variance, amplitude = 13 / 12 * step**2, FLUX * SPEED
    relative = 2 * variance / (3 * SAMPLES * amplitude**2)
    relative += 24 * variance / (3 * amplitude**2 * SAMPLES**3 * (SPEED * 0.1 / SAMPLES) ** 2)
    return Case(names[kind], trial, FLUX, relative * FLUX**2)


# --- inertia: one driven ramp, one coast-down ---

INERTIA, COULOMB, VISCOUS, TORQUE, SPEED_NOISE = 1e-4, 0.02, 5e-5, 0.1, 0.5
MECHANICS = np.array([INERTIA, COULOMB, VISCOUS])


def ramp_speed(parameters: np.ndarray, time: np.ndarray, torque: float, start: float) -> np.ndarray:
    inertia, coulomb, viscous = parameters
    final = (torque - coulomb) / viscous
    return final + (start - final) * np.exp(-viscous / inertia * time)


_UP, _DOWN = np.linspace(0, 0.3, 300), np.linspace(0, 0.8, 500)
_TOP = float(ramp_speed(MECHANICS, _UP, TORQUE, 5.0)[-1])


def ramps(random: Random) -> list[SpeedRamp]:
    up, down = ramp_speed(MECHANICS, _UP, TORQUE, 5.0), ramp_speed(MECHANICS, _DOWN, 0.0, _TOP)
    noisy = [w + random.normal(0, SPEED_NOISE, w.size) for w in (up, down)]
    return [SpeedRamp(_UP, noisy[0], TORQUE), SpeedRamp(_DOWN, noisy[1])]


def _fan_speed(parameters: np.ndarray, time: np.ndarray, torque: float, start: float) -> np.ndarray:
    """Return the speed with quadratic friction as the fourth parameter, by fourth-order steps from sample to sample."""
    inertia, coulomb, viscous, quadratic = parameters
    speeds, h = np.empty(time.size), float(time[1] - time[0])
    w = start

    def rate(w: float) -> float:
        return float((torque - coulomb - viscous * w - quadratic * w * w) / inertia)

    for k in range(time.size):
        speeds[k] = w
        k1 = rate(w)
        k2 = rate(w + h / 2 * k1)
        k3 = rate(w + h / 2 * k2)
        w += h / 6 * (k1 + 2 * k2 + 2 * k3 + rate(w + h * k3))
    return speeds


@cache
def _mechanics_bounds() -> np.ndarray:
    """Return the inverse's diagonal of the numerical Fisher matrix of J, Tc, B, quadratic friction and both initial speeds."""

    def both(p: np.ndarray) -> np.ndarray:
        return np.concatenate((_fan_speed(p[:4], _UP, TORQUE, p[4]), _fan_speed(p[:4], _DOWN, 0.0, p[5])))

    at = np.append(MECHANICS, (0.0, 5.0, _TOP))
    steps = np.diag(1e-5 * np.append(MECHANICS, (VISCOUS / _TOP, 5.0, _TOP)))
    slopes = np.column_stack([(both(at + h) - both(at - h)) / (2 * h.sum()) for h in steps])
    return np.diag(np.linalg.inv(slopes.T @ slopes)) * SPEED_NOISE**2


def _fitted_ramps(random: Random) -> Fit:
    return fit_ramps(ramps(random))


def inertia_case(name: str) -> Case:
    index = ("inertia", "coulomb_friction", "viscous_friction").index(name)
    bound = _mechanics_bounds()[index]
    return Case(f"{name}, ramp fit", _fitted_ramps, MECHANICS[index], bound, lambda fit: told(fit, name))


def two_point_case() -> Case:
    def trial(random: Random):
        up, down = ramps(random)
        a, b, c, d = 30, 270, 50, 450
        points = (_UP[a], up.speed[a], _UP[b], up.speed[b], TORQUE, _DOWN[c], down.speed[c], _DOWN[d], down.speed[d])
        return two_point(*(float(x) for x in points)).inertia, *NO_UNCERTAINTY

    return Case("inertia, two points", trial, INERTIA, inertia_case("inertia").bound)


def reported() -> list[Case]:
    """The estimators that results are reported by."""
    return [
        *(step_case(bits, rise) for bits in (8, 12) for rise in (0.0, 0.05)),
        sweep_case("known"),
        sweep_case("timed"),
        emf_case("fit"),
        emf_case("drift"),
        *(inertia_case(name) for name in ("inertia", "coulomb_friction", "viscous_friction")),
    ]


def simple() -> list[Case]:
    """The note's own ways, for comparison."""
    return [crossing_case(8), crossing_case(12), sweep_case("extremes"), emf_case("peak"), two_point_case()]
