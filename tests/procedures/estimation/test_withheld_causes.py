"""Causes that were only tried are not told as found beside "no figure is given"."""

import numpy as np
import pytest

from procedures.core.misfit_text import sentence
from procedures.estimation.fitting.misfit import Answer, Cause, Finding, none_explains
from procedures.estimation.winding.current_step.response import fit_step_response
from tests.studies.worlds.shaft_records import fit_coast_down

TOP, FINE = 300.0, 1e-4


def coast(brake=lambda _: 0.0):
    """Return finely spaced times (s) and speeds (rad/s) of a coast-down with a further deceleration."""
    speed, speeds = TOP, []
    while speed > 3.0:
        speeds.append(speed)
        speed -= FINE * (10e-3 / 6e-5 + 20e-6 / 6e-5 * speed + brake(speed))
    return np.arange(len(speeds)) * FINE, np.array(speeds)


def shorted(speed):
    """Deceleration (rad/s²) by a winding whose leads are shorted."""
    return 0.1 / 6e-5 * (speed / 60.0) / (1.0 + (speed / 60.0) ** 2)


def of_pulses(times, speeds):
    """Return the speed from one pulse a turn, held from pulse to pulse, at 1000 instants."""
    turns = np.floor(np.cumsum(speeds) * FINE / (2.0 * np.pi))
    pulses = times[1:][np.diff(turns) > 0]
    at = np.linspace(pulses[1], times[-1], 1000)
    last = np.searchsorted(pulses, at, side="right") - 1
    return at, 2.0 * np.pi / (pulses[last] - pulses[last - 1])


@pytest.mark.slow
def test_one_pulse_a_turn_is_too_coarse():
    (finding,) = fit_coast_down(*of_pulses(*coast())).misfit.findings
    assert (finding.cause, finding.answer) == (Cause.TOO_COARSE, Answer.WITHHELD)
    assert finding.figures["readings"] > 5
    assert "pulses per turn" in str(sentence(finding))


@pytest.mark.slow
@pytest.mark.parametrize("resolution", [0.0, 1.5])
def test_shorted_leads_leave_one_reason_and_what_was_tried(resolution):
    times, speeds = (x[::10] for x in coast(shorted))
    speeds = speeds + np.random.default_rng(7).normal(0.0, 0.3, speeds.size)
    if resolution:
        speeds = np.round(speeds / resolution) * resolution
    (finding,) = fit_coast_down(times, speeds, speed_resolution=resolution).misfit.findings
    assert (finding.cause, finding.answer) == (Cause.UNEXPLAINED, Answer.WITHHELD)
    assert "stribeck" in finding.figures["tried"]
    said = str(sentence(finding))
    assert "nor does any known cause that was tried (" in said
    assert "the model includes it" not in said


@pytest.mark.slow
def test_a_step_of_no_winding_tells_no_causes():
    t = (np.arange(2500) - 250) * 4e-6
    rng = np.random.default_rng(5)
    # Two bends that no term makes.
    i = np.where(t >= 0.0, 10.0 * -np.expm1(-np.maximum(t, 0.0) / 7e-4), 0.0)
    i = i * (1.0 - 0.35 * (t > 1.2e-3) + 0.5 * (t > 2.1e-3) - 0.45 * (t > 4e-3))
    v = np.where(t >= 0.0, 2.0, 0.0) + rng.normal(0.0, 0.01, t.size)
    findings = fit_step_response(t, v, i + rng.normal(0.0, 0.03, t.size)).misfit.findings
    assert {(f.cause, f.answer) for f in findings} == {(Cause.UNEXPLAINED, Answer.WITHHELD)}
    assert all("tried" in f.figures for f in findings)


def test_nothing_tried_needs_no_list():
    unknown = Finding(Cause.UNEXPLAINED, Answer.WITHHELD, score=5.0)
    assert none_explains(unknown, [], "ramp") == unknown
    twice = [Finding(Cause.COGGING, Answer.MODELLED), Finding(Cause.COGGING, Answer.MODELLED)]
    assert none_explains(unknown, twice, "ramp").figures == {"record": "ramp-tried", "tried": "cogging"}
