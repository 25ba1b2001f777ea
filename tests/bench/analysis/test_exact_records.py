"""Records and tables without noise: their figures have no more digits than their numbers, and no odd degrees of freedom."""

import numpy as np
import pytest

from bench.analysis.back_emf import analyze_back_emf
from bench.analysis.rotor_sweep import analyze_rotor_sweep
from bench.analysis.short_circuit import analyze_short_circuit
from bench.captures.written_digits import last_digit

FLUX, FREQUENCY = 0.05, 100.0


def emf(path, form, noise=0.0):
    time = np.arange(5000) / 5e4
    angle = 2.0 * np.pi * FREQUENCY * time - 2.0 * np.pi / 3.0 * np.arange(3)[:, None]
    volts = FLUX * 2.0 * np.pi * FREQUENCY * np.sin(angle)
    volts = volts + noise * np.random.default_rng(1).standard_normal(volts.shape)
    table = np.column_stack((time, volts.T))
    np.savetxt(path, table, delimiter=",", fmt=form, header="time (s),U (V),V (V),W (V)", comments="")
    return analyze_back_emf(path, connection="phase", coupling={"": "dc"})


@pytest.mark.parametrize("form", ["%.17g", "%.9g", "%.6f"])
def test_an_exact_record_is_known_to_its_last_digit(tmp_path, form):
    found = emf(tmp_path / "emf.csv", form)["parameters"]["flux_linkage"]
    low, high = found["coverage_interval"]
    assert low <= FLUX <= high
    assert found["degrees_of_freedom"] is None or found["degrees_of_freedom"] < 1e9
    assert 1e-10 * FLUX < found["standard_uncertainty"] < 1e-7 * FLUX


def test_more_digits_than_instruments_read_are_not_believed(tmp_path):
    found = emf(tmp_path / "emf.csv", "%.17g")["parameters"]["flux_linkage"]
    assert "last digit of the record's numbers" in {row["source"] for row in found["budget"]}


@pytest.mark.parametrize("form", ["%.1f", "%.2f"])
def test_what_was_not_rounded_does_not_have_the_readings_digit(tmp_path, form):
    path, frequency = tmp_path / "emf.csv", 97.31
    time = np.arange(2500) / 1e4
    angle = 2.0 * np.pi * frequency * time - 2.0 * np.pi / 3.0 * np.arange(3)[:, None]
    table = np.column_stack((time, FLUX / 4.0 * 2.0 * np.pi * frequency * np.sin(angle).T))
    np.savetxt(
        path, table, delimiter=",", fmt=["%.4f", form, form, form], header="time (s),U (V),V (V),W (V)", comments=""
    )
    found = analyze_back_emf(path, connection="phase", coupling={"": "dc"})["parameters"]
    # Half a digit of 0.1 V in 7.6 V is 0.7 %.
    for name, true, most in (("electrical_frequency", frequency, 1e-4), ("flux_linkage", FLUX / 4.0, 3e-3)):
        low, high = found[name]["coverage_interval"]
        assert low <= true <= high
        assert high - low < most * true


def test_few_readings_of_one_decimal_are_known_to_it(tmp_path):
    angle = np.arange(0.0, 360.0, 5.0)
    for phase in np.linspace(0.0, 3.0, 7):
        table = np.column_stack((angle, 1.5115 - 0.2775 * np.cos(2.0 * np.radians(angle) + phase)))
        path = tmp_path / "sweep.csv"
        np.savetxt(path, table, delimiter=",", fmt="%.1f", header="angle (deg),inductance (mH)", comments="")
        found = analyze_rotor_sweep(path, electrical=True)["parameters"]
        for name, true in (("d_axis_inductance", 0.617e-3), ("q_axis_inductance", 0.8945e-3)):
            low, high = found[name]["coverage_interval"]
            assert low <= true <= high


def test_noise_averages_the_last_digit_out(tmp_path):
    found = emf(tmp_path / "emf.csv", "%.6f", noise=2e-6)["parameters"]["flux_linkage"]
    assert not any("last digit" in row["source"] for row in found["budget"])


def test_a_sweep_s_inductances_are_known_to_the_last_digit(tmp_path):
    angle = np.arange(0.0, 360.0, 5.0)
    table = np.column_stack((angle, 1.0 + 0.2 * np.cos(2.0 * np.radians(angle))))
    path = tmp_path / "sweep.csv"
    np.savetxt(path, table, delimiter=",", header="angle (deg),inductance (mH)", comments="")
    found = analyze_rotor_sweep(path)["parameters"]["d_axis_inductance"]
    assert 1e-13 < found["standard_uncertainty"] < 1e-11


def test_a_short_circuit_s_degrees_of_freedom_are_sensible(tmp_path):
    speed = np.array([20.0, 50.0, 100.0, 200.0, 400.0, 800.0])
    current = FLUX * speed / np.hypot(0.5, speed * 1e-3)
    path = tmp_path / "short.csv"
    np.savetxt(path, np.column_stack((speed, current)), delimiter=",", header="speed (rad/s),current_A", comments="")
    found = analyze_short_circuit(path, pole_pairs=1, flux_linkage=FLUX)["parameters"]
    for figure in found.values():
        assert figure["degrees_of_freedom"] is None or figure["degrees_of_freedom"] < 1e9


def test_the_last_digit_of_a_column():
    assert last_digit(np.array([1.25, 13.5])) == pytest.approx(0.01)
    assert last_digit(np.array([4.0, 40.0])) == pytest.approx(1.0)
    assert last_digit(np.array([np.pi])) == pytest.approx(1e-8)
    assert last_digit(np.zeros(3)) == 0.0
