"""Gains of the current loop, each firmware's own use of them simulated: the loop must close with the bandwidth that was stated."""

import math
import re
from collections.abc import Callable

import numpy as np
import pytest

from bench.plugins.catalogues import installed
from procedures.core.result import Notice
from reports.exports.current_loop import crossover
from reports.exports.loop_reach import closed_bandwidth
from reports.exports.subject import Subject
from reports.exports.target import Sheet, sheet_for
from tests.reports.exports.conftest import TRUTH
from tests.reports.exports.readers import moteus, python_assignments, vesc

BANDWIDTH = 400.0
W = 2.0 * math.pi * BANDWIDTH


def written(name: str, subject: Subject, **more: bool) -> str:
    target = installed().exports[name]
    return target.write(sheet_for(target, subject, bandwidth=BANDWIDTH, **more))


def amplitude(kp: float, ki: float, resistance: float, inductance: float) -> float:
    """Return how much of a sine of the bandwidth a PI loop lets through: v = kp·e + ∫ki·e dt on i' = (v − R·i)/L, by small steps."""
    step, current, integral, seen = 1.0 / BANDWIDTH / 4000.0, 0.0, 0.0, []
    for k in range(4000 * 12):
        wanted = math.sin(W * k * step)
        error = wanted - current
        integral += ki * error * step
        current += step * (kp * error + integral - resistance * current) / inductance
        seen.append(current)
    return float(np.max(np.abs(seen[-4000:])))


def test_a_loop_has_the_bandwidth_that_was_stated(make_subject: Callable[..., Subject]) -> None:
    subject = make_subject()
    r, ld, lq = (
        subject.parameters[f"{n}"].value for n in ("stator_resistance", "d_axis_inductance", "q_axis_inductance")
    )
    read = vesc(written("vesc", subject))
    assert amplitude(read["foc_current_kp"], read["foc_current_ki"], r, 0.5 * (ld + lq)) == pytest.approx(
        math.sqrt(0.5), rel=0.01
    )
    text = written("simplefoc", subject)
    gains = {n: float(v) for n, v in re.findall(r"motor\.PID_current_(\w\.\w) = ([^;]+);", text)}
    assert set(gains) == {"q.P", "q.I", "d.P", "d.I"}
    for axis, inductance in (("q", lq), ("d", ld)):
        assert amplitude(gains[f"{axis}.P"], gains[f"{axis}.I"], r, inductance) == pytest.approx(
            math.sqrt(0.5), rel=0.01
        )
    # ODrive and moteus form the gains themselves, from a bandwidth in rad/s and in Hz.
    odrive = python_assignments(written("odrive", subject))["motor.config.current_control_bandwidth"]
    inductance = python_assignments(written("odrive", subject))["motor.config.phase_inductance"]
    assert amplitude(odrive * inductance, odrive * r, r, 0.5 * (ld + lq)) == pytest.approx(math.sqrt(0.5), rel=0.01)
    assert moteus(written("moteus", subject))["servo.pid_dq_hz"] == pytest.approx(BANDWIDTH)


@pytest.mark.parametrize("rate", [16.0 * BANDWIDTH, 40.0 * BANDWIDTH, 126.0 * BANDWIDTH])
def test_the_delay_of_a_sampled_loop_is_reckoned_with(make_subject: Callable[..., Subject], rate: float) -> None:
    target = installed().exports["vesc"]
    sheet = sheet_for(target, make_subject(), bandwidth=BANDWIDTH, loop_rate=rate)
    gains = vesc(target.write(sheet))
    inductance = 0.5 * sum(make_subject().parameters[f"{axis}_axis_inductance"].value for axis in "dq")
    frequencies = np.linspace(0.01, 3.0, 60000) * BANDWIDTH
    s = 2j * math.pi * frequencies
    resistance = make_subject().parameters["stator_resistance"].value
    opened = (
        (gains["foc_current_kp"] + gains["foc_current_ki"] / s)
        / (resistance + inductance * s)
        * np.exp(-1.5 * s / rate)
    )
    closed = np.abs(opened / (1.0 + opened))
    assert frequencies[np.flatnonzero(closed < math.sqrt(0.5))[0]] == pytest.approx(BANDWIDTH, rel=2e-3)
    assert closed.max() < 1.1
    assert f"at {rate:.6g} Hz the loop's bandwidth is 400 Hz" in sheet.line("foc_current_kp").comment


@pytest.mark.parametrize(("resistance", "off"), [(0.05, 0.0), (0.4, 0.0), (0.4, 0.1), (0.4, -0.08)])
def test_the_bandwidth_of_gains_that_are_off(resistance: float, off: float) -> None:
    inductance = 1e-4
    kp, ki = W * inductance, W * resistance * (1.0 + off)
    frequency = closed_bandwidth(kp, ki, resistance, inductance)
    s = 1j * frequency
    opened = (kp + ki / s) / (resistance + inductance * s)
    assert abs(opened / (1.0 + opened)) == pytest.approx(math.sqrt(0.5), rel=1e-9)
    if not off:
        assert frequency == pytest.approx(W, rel=1e-9)


def told(sheet: Sheet) -> list[Notice]:
    return [notice for notice in sheet.subject.warnings if notice.identifier == "loop-bandwidth"]


def test_a_resistance_too_little_known_for_the_loop_is_said(make_subject: Callable[..., Subject]) -> None:
    target = installed().exports["vesc"]
    # The winding's own pole lies far below the bandwidth: an error of R hardly moves the loop.
    slow = make_subject(relative=0.04)
    assert not told(sheet_for(target, slow, bandwidth=3000.0))
    fast = make_subject({**TRUTH, "stator_resistance": 0.5}, relative=0.04)
    (notice,) = told(sheet_for(target, fast, bandwidth=BANDWIDTH))
    assert "stator-resistance-dc" in str(notice.message)
    assert "±7.8 %" in str(notice.message)
    known = make_subject({**TRUTH, "stator_resistance": 0.5}, relative=0.01)
    assert not told(sheet_for(target, known, bandwidth=BANDWIDTH))
    # No gains, no warning.
    assert not told(sheet_for(target, fast))


def test_a_bandwidth_that_the_delay_does_not_carry_is_refused() -> None:
    with pytest.raises(ValueError, match="not within 0"):
        crossover(BANDWIDTH, 14.0 * BANDWIDTH)


def test_gains_hold_their_uncertainty_and_formula(make_subject: Callable[..., Subject]) -> None:
    subject = make_subject()
    sheet = sheet_for(installed().exports["vesc"], subject, bandwidth=BANDWIDTH)
    line, resistance = sheet.line("foc_current_ki"), subject.parameters["stator_resistance"]
    assert line.figure.standard_uncertainty == pytest.approx(W * resistance.standard_uncertainty, rel=1e-6)
    assert line.comment.startswith("V/(A*s), u = ")
    assert line.comment.endswith("2 pi 400 Hz times R at 25 degC")


def test_what_vesc_would_have_detected_is_nine_tenths(make_subject: Callable[..., Subject]) -> None:
    subject = make_subject()
    true, stored = vesc(written("vesc", subject)), vesc(written("vesc", subject, as_detected=True))
    for name in ("foc_motor_l", "foc_motor_ld_lq_diff"):
        assert stored[name] == pytest.approx(0.9 * true[name], rel=1e-8)
    assert {n for n in true if stored[n] != true[n]} == {"foc_motor_l", "foc_motor_ld_lq_diff"}
    # What the HFI makes of it, 0.9·(1/2Lq + 1/2Ld), is then the motor's own.
    ld, lq = (subject.parameters[f"{axis}_axis_inductance"].value for axis in "dq")
    low, high = (stored["foc_motor_l"] + sign * 0.5 * stored["foc_motor_ld_lq_diff"] for sign in (-1, 1))
    assert 0.9 * (0.5 / high + 0.5 / low) == pytest.approx(0.5 / ld + 0.5 / lq, rel=1e-6)


def test_without_a_bandwidth_there_are_no_gains(make_subject: Callable[..., Subject]) -> None:
    target = installed().exports["vesc"]
    assert "foc_current_kp" not in vesc(target.write(sheet_for(target, make_subject())))
