"""The resistance that a bridge reads beside a sweep's inductance: contacts that move, and what is no winding."""

from pathlib import Path

import numpy as np
import pytest

from bench.analysis import analyze_rotor_sweep
from procedures.core.misfit_text import sentence
from procedures.estimation.fitting.misfit import Answer, Cause
from procedures.estimation.winding.sweep.resistances import against_direct_current, allowed_for_jump
from procedures.estimation.winding.sweep.rotor_sweep import SweepFit, fit_rotor_sweep

MEAN, AMPLITUDE, NOISE, READINGS = 1e-4, 1e-5, 5e-8, 60
ANGLE = np.linspace(0.0, 2.0 * np.pi, READINGS)


def swept(seed: int, gain: np.ndarray | float = 1.0) -> SweepFit:
    noise = np.random.default_rng(seed).normal(0.0, NOISE, READINGS)
    return fit_rotor_sweep(ANGLE, gain * (MEAN - AMPLITUDE * np.cos(6.0 * ANGLE)) + noise, pole_pairs=3)


def resistances(seed: int) -> np.ndarray:
    """Resistances (Ω) that warm, and in which iron loses more on one axis."""
    random = np.random.default_rng([seed, 1])
    course = 1.0 + 0.02 * np.cos(6.0 * ANGLE) + 0.004 * np.linspace(0.0, 1.0, READINGS)
    return 0.2 * course * (1.0 + 2e-4 * random.standard_normal(READINGS))


def test_a_resistance_that_only_warms_and_swings_says_nothing() -> None:
    assert not any(allowed_for_jump(swept(seed), resistances(seed)).misfit for seed in range(100))


def test_the_rotor_s_voltage_is_no_contact() -> None:
    """A large motor's: 0.2 % of a resistance that scatters by 0.1 %, once an electrical turn."""
    random, fit = np.random.default_rng(1), swept(0)
    for phase in np.linspace(0.0, 2.0 * np.pi, 100):
        voltage = 0.002 * np.cos(3.0 * ANGLE + phase)
        read = 0.016 * (1.0 + voltage + 0.001 * random.standard_normal(READINGS))
        assert not allowed_for_jump(fit, read).misfit


def test_a_contact_that_moves_is_told_and_costs_little() -> None:
    for seed in range(20):
        fit, read = swept(seed), resistances(seed)
        place = 12 + seed
        read[place:] += 0.004
        found = allowed_for_jump(fit, read)
        (finding,) = found.misfit.findings
        assert (finding.cause, finding.answer) == (Cause.CONTACT, Answer.WIDENED)
        assert finding.figures["number"] == place + 1
        assert finding.figures["change"] == pytest.approx(0.02, rel=0.15)
        assert fit.uncertainty("mean") < found.uncertainty("mean") < 5.0 * fit.uncertainty("mean")
        assert "a clamp or a lead moved" in sentence(finding).render()


def test_a_range_that_changes_is_held() -> None:
    for seed in range(20):
        gain = 1.0 + 0.004 * (np.arange(READINGS) >= 20)
        found = allowed_for_jump(swept(seed, gain), gain * resistances(seed))
        assert Cause.CONTACT in {f.cause for f in found.misfit.findings}
        for right in (1.0, 1.004):
            assert abs(found.value("mean") - right * MEAN) < 2.0 * found.uncertainty("mean")


@pytest.mark.parametrize(
    ("read", "limit", "told"), [(0.2, 0.0, False), (0.165, 0.0, False), (0.1, 0.0, True), (0.1, 0.08, False)]
)
def test_less_than_by_direct_current_is_no_winding(read: float, limit: float, told: bool) -> None:
    misfit = against_direct_current(np.full(40, read), limit, 0.2, 1000.0)
    assert bool(misfit.withholding("d_axis_inductance")) is told
    if told:
        assert "something else is connected" in sentence(misfit.findings[0]).render()


def test_a_file_s_resistances_are_looked_at(tmp_path: Path) -> None:
    fit, read = swept(3), resistances(3)
    inductance = MEAN - AMPLITUDE * np.cos(fit.course)
    file = tmp_path / "sweep.csv"
    for jump, causes in ((0.0, set()), (0.01, {"contact"})):
        column = read + jump * (np.arange(READINGS) >= 30)
        table = np.column_stack((np.degrees(ANGLE), 1e6 * (inductance + fit.residuals), column))
        np.savetxt(file, table, delimiter=",", header="angle (deg),L (uH),R (Ohm)", comments="", encoding="utf-8")
        found = analyze_rotor_sweep(file, pole_pairs=3)
        assert {row["cause"] for row in found["misfit"]} == causes
