"""Voltages that are no step of a plain supply are named as what they are."""

import numpy as np
import pytest

from procedures.core.misfit_text import sentence
from procedures.estimation.fitting.fit import WithheldError
from procedures.estimation.fitting.misfit import Answer, Cause
from procedures.estimation.winding.current_step.pulse import ended_from
from procedures.estimation.winding.current_step.response import fit_step_response

R, L, DT = 0.2, 150e-6, 4e-6


def driven(voltage, count, fine=10):
    """Return time, voltage (V) and current (A) of a winding at `voltage(t, i)`, stepped finely; no current flows backwards."""
    times = (np.arange(count) - count // 10) * DT
    i, volts, amperes = 0.0, [], []
    for start in times:
        volts.append(voltage(start, i))
        amperes.append(i)
        for k in range(fine):
            i = max(0.0, i + DT / fine * (voltage(start + k * DT / fine, i) - R * i) / L)
    rng = np.random.default_rng(2)
    return times, np.array(volts) + rng.normal(0.0, 0.01, count), np.array(amperes) + rng.normal(0.0, 0.03, count)


@pytest.mark.parametrize("duty", [0.1, 0.2, 0.6, 0.9])
def test_a_drive_that_switches_is_named(duty):
    record = driven(lambda t, _: 10.0 * (t >= 0.0 and t * 20e3 % 1.0 < duty), 2000)
    with pytest.raises(WithheldError) as caught:
        fit_step_response(*record)
    (finding,) = caught.value.misfit.findings
    assert (finding.cause, finding.answer) == (Cause.SWITCHING, Answer.WITHHELD)
    assert finding.figures["frequency"] == pytest.approx(20e3, rel=0.05)
    assert finding.figures["high"] == pytest.approx(10.0, abs=0.1)
    assert "plain DC supply" in str(sentence(finding))


@pytest.mark.parametrize("count", [1200, 1400, 2500])
def test_a_pulse_with_a_freewheeling_diode_is_read_up_to_its_end(count):
    record = driven(lambda t, i: 2.0 if 0.0 <= t < 3.5e-3 else -0.7 * (i > 0.0 and t > 0.0), count)
    fit = fit_step_response(*record)
    (finding,) = fit.misfit.findings
    assert (finding.cause, finding.answer) == (Cause.PULSE_ENDS, Answer.MODELLED)
    assert finding.figures["after"] == pytest.approx(3.5e-3, abs=5 * DT)
    assert abs(fit.value("resistance") - R) < 3.0 * fit.uncertainty("resistance")
    assert abs(fit.value("inductance") - L) < 3.0 * fit.uncertainty("inductance") + fit.timing * L
    assert "left out" in str(sentence(finding))


def test_a_lasting_voltage_and_one_that_dies_away_are_no_pulses():
    t = (np.arange(2000) - 200) * DT
    noise = np.random.default_rng(3).normal(0.0, 0.02, t.size)
    assert ended_from(np.where(t >= 0.0, 2.0, 0.0) + noise) is None
    assert ended_from(np.where(t >= 0.0, 2.0 * np.exp(-t / 5e-4), 0.0) + noise) is None
    assert ended_from(noise) is None


@pytest.mark.parametrize("noise", [0.004, 0.05, 0.6])
def test_a_coarse_or_noisy_plain_step_does_not_switch(noise):
    t = (np.arange(2000) - 200) * DT
    rng = np.random.default_rng(4)
    v = np.round((np.where(t >= 0.0, 2.0, 0.0) + rng.normal(0.0, noise, t.size)) / 0.02) * 0.02
    i = np.where(t >= 0.0, 10.0 * -np.expm1(-np.maximum(t, 0.0) * R / L), 0.0) + rng.normal(0.0, 0.05, t.size)
    fit = fit_step_response(t, v, i, voltage_resolution=0.02)
    assert Cause.SWITCHING not in {f.cause for f in fit.misfit.findings}
    assert abs(fit.value("resistance") - R) < 3.5 * fit.uncertainty("resistance")


@pytest.mark.parametrize("rest", [0.6e-3, 2e-3])
def test_a_record_that_ends_in_the_next_pulse_is_read_up_to_the_end_of_the_first(rest):
    first = 4e-3
    record = driven(lambda t, i: 2.0 if 0.0 <= t < first or t >= first + rest else -0.5 * (t >= 0.0 and i > 0.0), 2000)
    fit = fit_step_response(*record)
    (finding,) = fit.misfit.findings
    assert (finding.cause, finding.answer) == (Cause.PULSE_ENDS, Answer.MODELLED)
    assert finding.figures["at"] == pytest.approx(first, abs=3.0 * DT)
    assert abs(fit.value("resistance") - R) < 2.5 * fit.uncertainty("resistance")
    assert abs(fit.value("inductance") - L) < 2.5 * fit.uncertainty("inductance") + fit.timing * L
