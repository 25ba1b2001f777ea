"""Tables of flux linkages by formula whose slope at zero current is known: on the table's edge, at a bend, and with noise."""

from pathlib import Path

import numpy as np
import pytest

from bench.analysis.load_tables import analyze_flux_map
from bench.analysis.zero_current import ThinnedMap
from procedures.estimation.flux.published_map import read_map

FLUX, L_D, L_Q = 0.1, 1e-3, 3e-3


def table(i_d: np.ndarray, i_q: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """An interior magnet motor whose d axis bends from zero on."""
    psi_d = FLUX + L_D * i_d / (1.0 + np.abs(i_d) / 100.0) - 1e-6 * i_q**2
    psi_q = L_Q * 60.0 * np.tanh(i_q / 60.0) - 2e-6 * i_d * i_q
    return np.column_stack((i_d, i_q)), np.column_stack((psi_d, psi_q))


def grid(low: float, high: float, rows: int, columns: int) -> tuple[np.ndarray, np.ndarray]:
    i_d, i_q = np.meshgrid(np.linspace(low, high, rows), np.linspace(-50.0, 50.0, columns))
    return table(i_d.ravel(), i_q.ravel())


def holds(interval: tuple[float, float], truth: float) -> bool:
    return interval[0] <= truth <= interval[1]


@pytest.mark.parametrize(("low", "high"), [(-50.0, 0.0), (-50.0, 50.0)])
@pytest.mark.parametrize(("rows", "columns"), [(5, 7), (9, 11), (17, 21)])
def test_the_slopes_at_zero_hold_the_truth(low: float, high: float, rows: int, columns: int) -> None:
    found = ThinnedMap(read_map(*grid(low, high, rows, columns)).map).inductances(0.0, 0.0)
    assert holds(found.dd.coverage_interval, L_D)
    assert holds(found.qq.coverage_interval, L_Q)


def test_a_finer_table_has_the_narrower_interval() -> None:
    widths = [
        ThinnedMap(read_map(*grid(-50.0, 0.0, *size)).map).inductances(0.0, 0.0).dd.standard_uncertainty
        for size in ((5, 7), (17, 21))
    ]
    assert 4.0 * widths[1] < widths[0]


def test_scattered_rows_hold_it_too() -> None:
    random = np.random.default_rng(4)
    i_d, i_q = random.uniform(-50.0, 0.0, 120), random.uniform(-50.0, 50.0, 120)
    i_d[0] = i_q[0] = 0.0
    found = ThinnedMap(read_map(*table(i_d, i_q)).map).inductances(0.0, 0.0)
    assert holds(found.dd.coverage_interval, L_D)


def test_the_command_gives_that_interval(tmp_path: Path) -> None:
    points, flux = grid(-50.0, 0.0, 9, 11)
    path = tmp_path / "map.csv"
    rows = "\n".join(",".join(f"{x:.8g}" for x in row) for row in np.hstack((points, flux)))
    path.write_text(f"id_A,iq_A,psi_d_Vs,psi_q_Vs\n{rows}\n", encoding="utf-8")
    made = analyze_flux_map(path, pole_pairs=4)["parameters"]
    for name, truth in (("flux_linkage", FLUX), ("d_axis_inductance", L_D), ("q_axis_inductance", L_Q)):
        assert holds(made[name]["coverage_interval"], truth)
