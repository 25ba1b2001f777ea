"""`motorbench analyze flux-map` on tables with currents by amount and angle, and with inductances in place of flux linkages."""

import json
from pathlib import Path

import numpy as np
import pytest

from bench.cli.analyze.maps import flux_map
from bench.i18n.errors import InputError, UsageError
from tests.studies.worlds.flux_truths import Array, true_motors

MOTOR = true_motors(None)["reluctance, little magnet"]
MAGNETS = 0.06
LD, LQ = 18.0e-3, 6.0e-3 + 0.75 / 9.0
AXIS = np.linspace(-16.0, 16.0, 9)
GRID = (AXIS[:, None] + 1j * AXIS[None, :]).ravel()
SIZE, GAMMA = (
    each.ravel() for each in np.meshgrid([2.0, 4.0, 6.0, 9.0, 12.0, 15.0, 18.0], np.arange(-90.0, 91.0, 15.0))
)
POLAR = SIZE * (-np.sin(np.radians(GAMMA)) + 1j * np.cos(np.radians(GAMMA)))


def written(path: Path, heading: str, *columns: Array) -> Path:
    rows = [
        ",".join("" if not np.isfinite(cell) else f"{cell:.9g}" for cell in row) for row in np.column_stack(columns)
    ]
    path.write_text("\n".join([heading, *rows]) + "\n", encoding="utf-8")
    return path


def inductances(i: Array) -> tuple[Array, Array]:
    """Return the apparent inductances (H); an axis without current has none."""
    psi = MOTOR.flux(i)
    d, q = (np.where(np.abs(each) < 1e-9, np.nan, each) for each in (i.real, i.imag))
    return (psi.real - MAGNETS) / d, psi.imag / q


def figures(capsys: pytest.CaptureFixture[str]) -> dict:
    made = json.loads(capsys.readouterr().out)
    assert not made["misfit"]
    for name, truth in (("flux_linkage", MAGNETS), ("d_axis_inductance", LD), ("q_axis_inductance", LQ)):
        low, high = made["parameters"][name]["coverage_interval"]
        assert low <= truth <= high
    return made


def test_inductances_and_the_magnets_flux_linkage_are_a_map(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    l_d, l_q = inductances(GRID)
    path = written(tmp_path / "l.csv", "id_A,iq_A,Ld (mH),Lq (mH)", GRID.real, GRID.imag, 1e3 * l_d, 1e3 * l_q)
    assert flux_map(path, pole_pairs=2, flux_linkage=MAGNETS, json=True) == 0
    made = figures(capsys)
    assert "apparent" in str(made["assumptions"])
    psi = MOTOR.flux(GRID)
    path = written(tmp_path / "psi.csv", "id_A,iq_A,psi_d_Vs,psi_q_Vs", GRID.real, GRID.imag, psi.real, psi.imag)
    assert flux_map(path, pole_pairs=2, json=True) == 0
    assert figures(capsys)["details"]["mtpa"][-1]["torque"]["value"] == pytest.approx(
        made["details"]["mtpa"][-1]["torque"]["value"], rel=1e-4
    )


@pytest.mark.parametrize(("way", "angle"), [("q", GAMMA), ("q-to-d", -GAMMA), ("d", GAMMA + 90.0)])
def test_currents_by_amount_and_angle_are_those_by_axes(
    way: str, angle: Array, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    """No row is at zero current, and only one side of q is there: the magnets lie along d all the same."""
    psi = MOTOR.flux(POLAR)
    path = written(
        tmp_path / "polar.csv", "I1 [A rms],angle [deg],psi_d [Vs],psi_q [Vs]",
        SIZE / np.sqrt(2.0), angle, psi.real, psi.imag,
    )  # fmt: skip
    assert flux_map(path, pole_pairs=2, angle_from=way, json=True) == 0  # type: ignore[arg-type]
    figures(capsys)


def test_an_angle_counted_the_other_way_is_found(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    psi = MOTOR.flux(POLAR)
    path = written(tmp_path / "polar.csv", "current_A,beta_deg,psi_d_Vs,psi_q_Vs", SIZE, -GAMMA, psi.real, psi.imag)
    for way, cause in (("q", "sign-reversed"), ("d", "axes-swapped")):
        assert flux_map(path, pole_pairs=2, angle_from=way, json=True) == 1  # type: ignore[arg-type]
        assert cause in capsys.readouterr().out.replace("_", "-")


def test_uncertainties_of_inductances_are_those_of_the_map(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    l_d, l_q = inductances(POLAR)
    there = np.isfinite(l_d) & np.isfinite(l_q)
    one = np.ones(np.count_nonzero(there))
    widths = []
    for u in (1e-5, 1e-3):
        path = written(
            tmp_path / "polar.csv", "current_A,gamma_deg,ld_H,lq_H,psi_m_Vs,u_ld_H,u_lq_H,u_psi_m_Vs",
            SIZE[there], GAMMA[there], l_d[there], l_q[there], MAGNETS * one, u * one, u * one, 0.1 * u * one,
        )  # fmt: skip
        assert flux_map(path, pole_pairs=2, angle_from="q", json=True) == 0
        made = figures(capsys)
        assert "no uncertainties" not in str(made["assumptions"])
        widths.append(made["parameters"]["flux_linkage"]["standard_uncertainty"])
    assert widths[1] == pytest.approx(1e-4, rel=0.1)
    assert widths[0] < 0.1 * widths[1]


def test_columns_beside_those_that_are_needed_are_passed_over(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    psi = MOTOR.flux(GRID)
    path = written(
        tmp_path / "more.csv", "id_A,iq_A,I,beta,psi_d_Vs,psi_q_Vs,Ld,Lq,psi_m", GRID.real, GRID.imag, np.abs(GRID),
        np.angle(GRID), psi.real, psi.imag, *inductances(GRID), psi.real,
    )  # fmt: skip
    assert flux_map(path, pole_pairs=2, json=True) == 0
    figures(capsys)


def test_what_such_a_table_leaves_open_is_asked_for(tmp_path: Path) -> None:
    psi, (l_d, l_q) = MOTOR.flux(POLAR), inductances(GRID)
    polar = written(tmp_path / "polar.csv", "current_A,gamma_deg,psi_d_Vs,psi_q_Vs", SIZE, GAMMA, psi.real, psi.imag)
    table = written(tmp_path / "l.csv", "id_A,iq_A,ld_H,lq_H", GRID.real, GRID.imag, l_d, l_q)
    with pytest.raises(UsageError, match="--angle-from"):
        flux_map(polar)
    with pytest.raises(UsageError, match="--flux-linkage"):
        flux_map(table)
    with pytest.raises(UsageError, match="no angle"):
        flux_map(table, flux_linkage=MAGNETS, angle_from="q")
    with pytest.raises(UsageError, match="has flux linkages"):
        flux_map(polar, flux_linkage=MAGNETS, angle_from="q")
    with pytest.raises(InputError, match=r"states no unit for angle.*\(deg\)"):
        flux_map(written(tmp_path / "unit.csv", "current_A,gamma,psi_d_Vs,psi_q_Vs", SIZE, GAMMA, psi.real, psi.imag))
