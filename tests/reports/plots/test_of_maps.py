"""Plots of short circuit, open circuit and load points, from findings as the procedures leave them."""

from types import SimpleNamespace
from typing import Any, cast

import numpy as np
import pytest

from drivers.interfaces.text import english
from reports.document.record import ProcedureRecord
from reports.plots.draw import svg
from reports.plots.of_maps import load_points, open_circuit, short_circuit
from reports.plots.of_procedures import plots

SPEED = np.array([10.0, 40.0, 160.0])
FINE = np.linspace(10.0, 160.0, 20)


def record(name: str, findings: dict[str, Any]) -> ProcedureRecord:
    return cast("ProcedureRecord", SimpleNamespace(name=name, result=SimpleNamespace(findings=findings)))


def sweep(temperature: float) -> dict[str, Any]:
    return {
        "winding_temperature": temperature,
        "speed": SPEED.tolist(),
        "current": [2.0, 8.0, 20.0],
        "torque": [0.2, 0.7, 0.5],
        "current_residual": [0.001, -0.002, 0.001],
        "torque_residual": [0.0, 0.001, -0.001],
        "fit": {"speed": FINE.tolist(), "current": (0.1 * FINE).tolist(), "torque": (0.01 * FINE).tolist()},
        "copper_loss": [1.0, 20.0, 120.0],
        "drag_loss": [0.3, 1.5, 8.0],
    }


def point(speed: float, torque: float, **more: Any) -> dict[str, Any]:
    return {
        "speed_rpm": speed, "torque": torque, "efficiency": 0.9, "loss": 10.0, "current": 10.0 * torque,
        "copper": 6.0, "without_current": 3.0, "rest": 1.0, **more,
    }  # fmt: skip


def test_a_short_circuit_shows_both_temperatures_their_fits_and_residuals():
    main, loss = list(plots(record("short-circuit", {"sweeps": [sweep(25.0), sweep(60.0)]})))
    (current, torque), (left, _) = main.rows
    assert [str(curve.name) for curve in current.curves] == ["readings", "fit, 25 °C", "_", "fit, 60 °C"]
    np.testing.assert_allclose(torque.curves[0].x, SPEED * 30.0 / np.pi)
    # What the currents leave is relative in the findings, amperes in the plot.
    np.testing.assert_allclose(left.curves[0].y, [0.002, -0.016, 0.02])
    assert "copper, leads and link" in svg(loss, lambda words: [words.render(english)])


def test_an_open_circuit_shows_emf_flux_drag_and_tare():
    terms = {"constant": 0.03, "linear": 1e-4}
    findings = {
        "passes": [
            {"winding_temperature": t, "speed": SPEED.tolist(), "amplitude": (0.4 * SPEED).tolist(),
             "electrical_speed": (4.0 * SPEED).tolist()} for t in (25.0, 70.0)
        ],
        "drag": {"speed": SPEED.tolist(), "torque": [0.03, 0.034, 0.046], "residual": [0.0, 0.0, 0.0],
                 "terms": terms, "tare": {"constant": 0.01}},
    }  # fmt: skip
    (found,) = plots(record("open-circuit", findings))
    (emf, torque), (flux, _) = found.rows
    assert [str(curve.name) for curve in emf.curves] == ["25 °C", "70 °C"]
    np.testing.assert_allclose(flux.curves[0].y, 0.1)
    np.testing.assert_allclose(torque.curves[1].y[[0, -1]], [0.031, 0.046])
    np.testing.assert_allclose(torque.curves[2].y, 0.01)


def test_load_points_have_a_curve_a_speed_and_the_parts_at_the_highest_that_has_some():
    points = [point(1000.0, 1.0), point(1000.0, 2.0), point(2000.0, 1.0), point(2000.0, 2.0), point(3000.0, 0.5)]
    grid, parts = plots(record("load-points", {"points": points}))
    efficiency, _ = grid.rows[0]
    assert [str(curve.name) for curve in efficiency.curves] == ["_", "1000 rpm", "2000 rpm", "3000 rpm"]
    assert "2000 rpm" in str(parts.caption)


@pytest.mark.parametrize(
    ("make", "findings"),
    [
        (short_circuit, {}),
        (open_circuit, {"passes": []}),
        (load_points, {"points": [point(1000.0, 1.0)]}),
    ],
)
def test_findings_without_what_a_plot_needs_give_none(make, findings):
    assert list(make(record("x", findings), findings)) == []


def test_the_parts_are_left_out_where_the_resistance_was_not_known():
    points = [point(1000.0, 1.0, copper=None), point(1000.0, 2.0, copper=None)]
    assert len(list(plots(record("load-points", {"points": points})))) == 1
