"""Sweeps by a hand that stops, and meters that drift: both axes from where the inductance turns back."""

import numpy as np
import pytest

from procedures.estimation.fitting.fit import EstimationError
from procedures.estimation.fitting.misfit import Answer, Cause
from procedures.estimation.winding.resistance import slope
from procedures.estimation.winding.rotor_sweep import SweepFit, fit_rotor_sweep, saliency_significant
from procedures.estimation.winding.timed_sweep import fit_timed_sweep

MEAN, AMPLITUDE, NOISE = 1e-4, 1e-5, 5e-8


def swept(seed: int, *, turns: float = 2.0, regrips: int = 0, amplitude: float = AMPLITUDE) -> SweepFit:
    random = np.random.default_rng(seed)
    n = int(80 * turns)
    at = np.arange(n) / n
    speed = 1.0 + 0.2 * np.sin(2 * np.pi * (1.3 * at + random.uniform()))
    for place in random.uniform(0.1, 0.9, regrips):
        speed[(at > place) & (at < place + 0.06)] = 0.0
    course = np.cumsum(speed)
    course = course * 4 * np.pi * turns / course[-1] + random.uniform(0, 7)
    return fit_timed_sweep(20 * at, MEAN - amplitude * np.cos(course) + random.normal(0, NOISE, n))


def axes(fit: SweepFit) -> tuple[float, float, float]:
    u = float(np.hypot(fit.uncertainty("mean"), fit.uncertainty("amplitude")))
    return fit.value("mean") - fit.value("amplitude"), fit.value("mean") + fit.value("amplitude"), u


@pytest.mark.slow
def test_a_steady_hand_is_rarely_warned_of() -> None:
    assert sum(bool(swept(seed).misfit) for seed in range(60)) <= 4


@pytest.mark.slow
def test_regrips_are_named_and_both_axes_held() -> None:
    named = 0
    for seed in range(40):
        fit = swept(seed, regrips=2)
        named += Cause.REGRIP in {f.cause for f in fit.misfit.findings}
        if fit.misfit.withholding("mean") is None:
            d, q, u = axes(fit)
            assert abs(d - (MEAN - AMPLITUDE)) < 4 * u
            assert abs(q - (MEAN + AMPLITUDE)) < 4 * u
        assert saliency_significant(fit)[0]
    assert named >= 20


def test_half_an_electrical_turn_is_refused() -> None:
    random = np.random.default_rng(1)
    course = np.concatenate((np.linspace(0.3, 3.0, 60), np.full(40, 3.0), np.linspace(3.0, 6.0, 60)))
    with pytest.raises(EstimationError, match="turn the shaft over at least one electrical turn"):
        fit_timed_sweep(np.arange(160.0), MEAN - AMPLITUDE * np.cos(course) + random.normal(0, NOISE, 160))


@pytest.mark.parametrize(
    ("disturbance", "cause"), [("run-out", Cause.ECCENTRICITY), ("drift", Cause.SLOPE), ("none", None)]
)
def test_known_angles(disturbance: str, cause: Cause | None) -> None:
    random = np.random.default_rng(2)
    angle = np.linspace(0.0, 2 * np.pi, 73)
    values = MEAN - AMPLITUDE * np.cos(8 * angle + 1.0) + random.normal(0, NOISE, angle.size)
    if disturbance == "run-out":
        values += 2e-6 * np.cos(angle + 0.4)
    if disturbance == "drift":
        values *= 1.0 + 0.02 * np.linspace(-0.5, 0.5, angle.size)
    fit = fit_rotor_sweep(angle, values, pole_pairs=4)
    assert [f.cause for f in fit.misfit.findings] == ([cause] if cause else [])
    d, q, u = axes(fit)
    assert abs(d - (MEAN - AMPLITUDE)) < 3.5 * u
    assert abs(q - (MEAN + AMPLITUDE)) < 3.5 * u
    # When on its way a meter that drifted was right is not known: 1 % each way, of the mean and of the swing.
    assert u < (0.01 * MEAN if disturbance == "drift" else 3e-8)


@pytest.mark.parametrize("what", ["emf", "contact", "none"])
def test_four_wire_readings_that_drift_widen_the_slope(what: str) -> None:
    random = np.random.default_rng(5)
    levels = np.array([1.0, 0.75, 0.5, 0.25, 1.0])
    current, risen = np.concatenate((levels, -levels)), 1.0 - np.exp(-np.arange(10) / 6.0)
    voltage = 0.1 * current + 2e-5 + random.normal(0.0, 2e-6, 10)
    voltage = voltage + 2e-3 * risen * {"emf": np.ones(10), "contact": current, "none": np.zeros(10)}[what]
    fit = slope(voltage, current)
    low, high = fit.interval("resistance")
    assert low < 0.1 < high
    assert [f.answer for f in fit.misfit.findings] == ([] if what == "none" else [Answer.WIDENED])
