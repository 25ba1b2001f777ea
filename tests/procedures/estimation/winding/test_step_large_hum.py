"""Current steps beside which the mains hum is larger than the step."""

import numpy as np
import pytest

from procedures.estimation.fitting.fit import WithheldError
from procedures.estimation.fitting.misfit import Answer, Cause
from procedures.estimation.winding.current_step.response import StepFit, fit_step_response

RESISTANCE, TAU = 0.4, 3e-3


def stepped(hum: float, frequency: float, phase: float, *, cut: float = np.inf, known: bool = False) -> StepFit:
    """Fit a step of 5 A, recorded for 40 ms in 8 bits, with hum of so many steps, of a range that ends at `cut` (A), `known` or not."""
    random, time = np.random.default_rng(3), np.arange(2500) * 16e-6
    since = np.maximum(time - 6e-3, 0.0)
    voltage = np.where(since > 0.0, 2.0, 0.0)
    current = 2.0 / RESISTANCE * (-np.expm1(-since / TAU) + hum * np.sin(2.0 * np.pi * frequency * time + phase))
    current = np.clip(current, -cut, cut)
    code, volts = 3.0 * (1.0 + hum) * 5.0 / 256.0, 5.0 / 256.0
    read = np.round(current / code + random.normal(0.0, 0.6, time.size)) * code
    driven = np.round(voltage / volts + random.normal(0.0, 0.6, time.size)) * volts
    return fit_step_response(
        time,
        driven,
        np.clip(read, -cut, cut),
        voltage_resolution=volts,
        current_resolution=code,
        current_ends=(-cut, cut) if known else None,
    )


@pytest.mark.parametrize(
    ("hum", "frequency", "phase"), [(1.2, 50.0, 0.3), (2.0, 59.94, 2.0), (4.0, 50.05, 4.5), (2.5, 50.0, 5.6)]
)
def test_hum_larger_than_the_step_is_named_and_modelled(hum: float, frequency: float, phase: float) -> None:
    fit = stepped(hum, frequency, phase)
    (finding,) = fit.misfit.findings
    assert (finding.cause, finding.answer) == (Cause.HUM, Answer.MODELLED)
    assert finding.figures["frequency"] == round(frequency, -1)
    assert finding.figures["amplitude"] == pytest.approx(hum * 2.0 / RESISTANCE, rel=0.02)
    assert abs(fit.value("resistance") - RESISTANCE) < 2.5 * fit.uncertainty("resistance")
    inductance = RESISTANCE * TAU
    assert abs(fit.value("inductance") - inductance) < 2.5 * fit.uncertainty("inductance") + fit.timing * inductance
    assert fit.uncertainty("resistance") < 0.03 * RESISTANCE


@pytest.mark.parametrize("known", [True, False])
def test_hum_that_leaves_the_range_withholds_the_step(known: bool) -> None:
    with pytest.raises(WithheldError) as raised:
        stepped(3.0, 50.0, 0.3, cut=12.0, known=known)
    assert {finding.cause for finding in raised.value.misfit.findings} == {Cause.HUM}
