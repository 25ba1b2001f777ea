"""`motorbench analyze flux-map`: tables of others, right and wrong ones."""

from collections.abc import Callable
from pathlib import Path

import numpy as np
import pytest

from bench.cli.analyze.maps import flux_map
from bench.i18n.errors import InputError
from tests.bench.cli.map_tables import GRID, MOTOR, analyzed, rows_of, written
from tests.studies.worlds.flux_truths import Array


def test_a_right_table_gives_its_figures(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    path = written(tmp_path / "map.csv", rows_of())
    made = analyzed(capsys, 0, flux_map(path, pole_pairs=2.0, voltage=80.0, resistance=0.6, json=True))
    assert not made["misfit"]
    assert made["parameters"]["flux_linkage"]["value"] == pytest.approx(0.06, rel=0.01)
    assert made["parameters"]["d_axis_inductance"]["value"] == pytest.approx(18e-3, rel=0.02)
    assert made["details"]["symmetric"]
    assert made["details"]["mtpa"][-1]["angle_degrees"]["value"] == pytest.approx(55.0, abs=5.0)
    torques = [row["torque"]["value"] for row in made["details"]["largest_torque"]]
    assert torques == sorted(torques, reverse=True)


def test_a_negative_uncertainty_is_refused(tmp_path: Path) -> None:
    spread = np.full((len(GRID), 2), 1e-5)
    spread[7, 1] = -1e-5
    path = written(
        tmp_path / "map.csv", np.hstack((rows_of(), spread)), "id_A,iq_A,psi_d_Vs,psi_q_Vs,u_psi_d_Vs,u_psi_q_Vs"
    )
    with pytest.raises(InputError, match=r"map\.csv: u_psi_q has -1e-05 V·s, but an uncertainty is 0 or more"):
        flux_map(path, pole_pairs=2.0)


def test_a_largest_torque_outside_of_the_table_is_said_and_not_given(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    # A square grid's points within a circle: between two of them its arc is not in the table.
    rows = rows_of()
    disc = rows[np.hypot(rows[:, 0], rows[:, 1]) <= 16.001]
    made = analyzed(capsys, 0, flux_map(written(tmp_path / "disc.csv", disc), pole_pairs=2.0, json=True))
    (edge,) = (warning["text"] for warning in made["warnings"] if warning["id"] == "mtpa-at-edge")
    assert "at 16 A the torque still increases" in edge
    given = made["details"]["mtpa"]
    assert [row["current"] for row in given[:3]] == [4.0, 8.0, 12.0]
    assert not any(row["at_edge"] for row in given)
    for row in given:
        beta = np.linspace(0.5 * np.pi, np.pi, 9001)
        current = row["current"] * np.exp(1j * beta)
        torque = 3.0 * np.imag(np.conj(MOTOR.flux(current)) * current)
        low, high = row["torque"]["coverage_interval"]
        assert low - 1e-3 * high <= torque.max() <= high + 1e-3 * high


@pytest.mark.parametrize(
    ("cause", "change"),
    [
        ("axes-swapped", lambda i, psi: (i[:, ::-1], psi)),
        ("sign-reversed", lambda i, psi: (i * [1.0, -1.0], psi)),
        ("sign-reversed", lambda i, psi: (i, psi * [1.0, -1.0])),
        ("currents-outward", lambda i, psi: (-i, psi)),
        ("turned-180", lambda i, psi: (-i, -psi)),
        ("other-d-axis", lambda i, psi: (i[:, ::-1] * [1.0, -1.0], psi[:, ::-1] * [1.0, -1.0])),
    ],
)
def test_a_wrong_table_is_found_and_no_figure_given(
    cause: str,
    change: Callable[[Array, Array], tuple[Array, Array]],
    tmp_path: Path,
    capsys: pytest.CaptureFixture[str],
) -> None:
    path = written(tmp_path / "map.csv", rows_of(change))
    made = analyzed(capsys, 1, flux_map(path, json=True))
    assert [row["cause"] for row in made["misfit"]] == [cause]
    assert made["withheld"]["flux_linkage"]["cause"] == cause
    assert not made["parameters"]


def test_holes_a_turn_and_a_wrong_resistance_are_said(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    holed = np.delete(rows_of(), 40, axis=0)
    made = analyzed(capsys, 0, flux_map(written(tmp_path / "holed.csv", holed), json=True))
    assert "map-holes" in {row["cause"] for row in made["misfit"]}

    def wrong(i: Array, psi: Array) -> tuple[Array, Array]:
        psi = psi + 1e-3 * np.column_stack((i[:, 1], -i[:, 0]))
        turn = np.radians(2.0)
        return i, psi @ np.array([[np.cos(turn), np.sin(turn)], [-np.sin(turn), np.cos(turn)]])

    made = analyzed(capsys, 0, flux_map(written(tmp_path / "turned.csv", rows_of(wrong)), json=True))
    assert {"map-turned", "resistance-left"} <= {row["cause"] for row in made["misfit"]}
    assert made["details"]["turn_degrees"] == pytest.approx(2.0, abs=0.2)


def test_torque_that_was_computed_and_rms_for_peak(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    rows = rows_of()
    torque = 3.0 * (rows[:, 2] * rows[:, 1] - rows[:, 3] * rows[:, 0])
    heading = "id_A,iq_A,psi_d_Vs,psi_q_Vs,torque_Nm"
    path = written(tmp_path / "computed.csv", np.column_stack((rows, torque)), heading)
    made = analyzed(capsys, 0, flux_map(path, pole_pairs=2.0, json=True))
    assert [(row["cause"], row["answer"]) for row in made["misfit"]] == [("torque-computed", "said")]
    assert "it changes no interval" in made["warnings"][0]["text"]
    rounded = np.column_stack((rows, np.round(torque, 1)))
    made = analyzed(capsys, 0, flux_map(written(tmp_path / "rounded.csv", rounded, heading), pole_pairs=2.0, json=True))
    assert [row["cause"] for row in made["misfit"]] == ["torque-computed"]
    measured = np.column_stack(
        (rows, np.round(torque * (1.0 + 0.005 * np.random.default_rng(1).normal(size=torque.size)), 1))
    )
    made = analyzed(capsys, 0, flux_map(written(tmp_path / "read.csv", measured, heading), pole_pairs=2.0, json=True))
    assert not made["misfit"]
    scatter = 1.0 + 0.01 * np.random.default_rng(1).normal(size=torque.size)
    path = written(tmp_path / "rms.csv", np.column_stack((rows, 2.0 * torque * scatter)), heading)
    made = analyzed(capsys, 1, flux_map(path, pole_pairs=2.0, json=True))
    assert [row["cause"] for row in made["misfit"]] == ["rms-for-peak"]


def test_torque_of_other_pole_pairs_or_sign_is_said(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    rows = rows_of()
    torque = 3.0 * (rows[:, 2] * rows[:, 1] - rows[:, 3] * rows[:, 0])
    torque = torque * (1.0 + 0.01 * np.random.default_rng(1).normal(size=torque.size))
    for pairs, sign in ((4.0, 1.0), (2.0, -1.0)):
        path = written(
            tmp_path / "torque.csv", np.column_stack((rows, sign * torque)), "id_A,iq_A,psi_d_Vs,psi_q_Vs,torque_Nm"
        )
        made = analyzed(capsys, 0, flux_map(path, pole_pairs=pairs, json=True))
        assert [row["cause"] for row in made["misfit"]] == ["torque-differs"]
        assert {row["torque"] for row in made["details"]["mtpa"]} == {None}
        assert flux_map(path, pole_pairs=pairs, language="en") == 0
        assert "–" in capsys.readouterr().out.partition("MTPA")[2]


@pytest.mark.parametrize(("ratio", "status"), [(1.15, 0), (0.85, 0), (3.0, 1), (-1.2, 1)])
def test_a_torque_that_no_factor_explains_is_a_gain_of_the_flux_linkages_or_withholds_them(
    tmp_path: Path, capsys: pytest.CaptureFixture[str], ratio: float, status: int
) -> None:
    rows = rows_of()
    torque = 3.0 * (rows[:, 2] * rows[:, 1] - rows[:, 3] * rows[:, 0])
    scatter = 1.0 + 0.01 * np.random.default_rng(1).normal(size=torque.size)
    table = np.column_stack((rows[:, :2], rows[:, 2:] / ratio, torque * scatter))
    path = written(tmp_path / "gain.csv", table, "id_A,iq_A,psi_d_Vs,psi_q_Vs,torque_Nm")
    made = analyzed(capsys, status, flux_map(path, pole_pairs=2.0, json=True))
    assert [row["cause"] for row in made["misfit"]][-1] == "torque-differs"
    if status == 0:
        low, high = made["parameters"]["flux_linkage"]["coverage_interval"]
        true = analyzed(capsys, 0, flux_map(written(tmp_path / "true.csv", rows), json=True))["parameters"]
        assert low <= true["flux_linkage"]["value"] <= high


def test_the_intervals_of_a_turned_map_hold_the_motor(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    angle = np.radians(4.0)
    turn = np.array([[np.cos(angle), np.sin(angle)], [-np.sin(angle), np.cos(angle)]])
    straight = analyzed(capsys, 0, flux_map(written(tmp_path / "straight.csv", rows_of()), json=True))
    turned = rows_of(lambda i, psi: (i @ turn, psi @ turn))
    made = analyzed(capsys, 0, flux_map(written(tmp_path / "turned.csv", turned), json=True))
    assert "map-turned" in {row["cause"] for row in made["misfit"]}
    for name, figure in made["parameters"].items():
        low, high = figure["coverage_interval"]
        assert low <= straight["parameters"][name]["value"] <= high


def test_torque_of_values_for_equal_power_gives_no_figures(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    rows = rows_of()
    torque = 3.0 * (rows[:, 2] * rows[:, 1] - rows[:, 3] * rows[:, 0])
    path = written(
        tmp_path / "power.csv",
        np.column_stack((rows * np.sqrt(1.5), torque)),
        "id_A,iq_A,psi_d_Vs,psi_q_Vs,torque_Nm",
    )
    made = analyzed(capsys, 1, flux_map(path, pole_pairs=2.0, json=True))
    assert "equal power" in made["withheld"]["flux_linkage"]["message"]
    made = analyzed(capsys, 1, flux_map(path, pole_pairs=2.0 / 3.0, json=True))
    assert "pole pairs given are half" in made["withheld"]["flux_linkage"]["message"]


def test_a_table_that_ends_before_zero_current_holds_what_lies_there(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    # ψ_d bends most near zero current, where the table has no row.
    i_d, i_q = (x.ravel() for x in np.meshgrid(np.linspace(-50.0, -6.25, 8), np.linspace(0.0, 50.0, 9), indexing="ij"))
    psi_d = 0.1 + 1e-3 * i_d / (1.0 - i_d / 100.0)
    rows = np.column_stack((i_d, i_q, psi_d, 3e-3 * i_q))
    made = analyzed(capsys, 0, flux_map(written(tmp_path / "map.csv", rows), json=True))
    assert "beyond-table" in {warning["id"] for warning in made["warnings"]}
    for name, truth in (("flux_linkage", 0.1), ("d_axis_inductance", 1e-3), ("q_axis_inductance", 3e-3)):
        low, high = made["parameters"][name]["coverage_interval"]
        assert low <= truth <= high


def test_a_row_that_is_off_is_named(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    rows = rows_of()
    rows[51, 3] *= -1.0
    made = analyzed(capsys, 0, flux_map(written(tmp_path / "map.csv", rows), json=True))
    (row,) = (row for row in made["misfit"] if row["cause"] == "odd-reading")
    assert row["figures"]["number"] == 52


@pytest.mark.parametrize(
    ("change", "words"),
    [
        (lambda rows: rows[rows[:, 0] == 0.0].repeat(2, axis=0) + np.linspace(0.0, 1e-3, 18)[:, None] * [0, 1, 0, 0], "on one line"),
        (lambda rows: rows * 1e9, "look at the units"),
        (lambda rows: rows[(rows[:, 0] <= -8.0) & (rows[:, 1] >= 4.0)], "add rows near zero current"),
    ],
)  # fmt: skip
def test_a_table_that_no_map_follows_from_is_refused(
    change: Callable[[Array], Array], words: str, tmp_path: Path
) -> None:
    with pytest.raises(InputError, match=words):
        flux_map(written(tmp_path / "map.csv", change(rows_of())))


def test_round_set_points_are_exact_and_noise_is_seen(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    i_d, i_q = (each.ravel() for each in np.meshgrid(np.arange(-50.0, 1.0, 10.0), np.arange(-50.0, 51.0, 10.0)))
    flux = np.column_stack((0.06 + 4e-4 * i_d - 2e-6 * i_q**2, 0.036 * np.tanh(i_q / 40.0) - 4e-6 * i_d * i_q))
    held = 0
    for seed in range(8):
        read = flux + np.random.default_rng(seed).normal(0.0, 2e-5, flux.shape)
        path = written(tmp_path / "map.csv", np.column_stack((i_d, i_q, read)))
        found = analyzed(capsys, 0, flux_map(path, json=True))["parameters"]["flux_linkage"]
        # Half the rows mirror the others.
        assert 1e-5 < found["standard_uncertainty"] < 5e-5
        held += found["coverage_interval"][0] < 0.06 < found["coverage_interval"][1]
    assert held >= 7


def test_rows_at_one_current_are_averaged(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    rows = rows_of()
    once = analyzed(capsys, 0, flux_map(written(tmp_path / "once.csv", rows), json=True))
    # Reference readings at no current, each a little off in both, and a second pass over all of it.
    random = np.random.default_rng(1)
    zero = rows[np.argmin(np.hypot(rows[:, 0], rows[:, 1]))]
    again = np.vstack((rows, rows, np.tile(zero, (9, 1)))) + random.normal(size=(2 * len(rows) + 9, 4)) * [
        5e-3,
        5e-3,
        5e-5,
        5e-5,
    ]
    made = analyzed(capsys, 0, flux_map(written(tmp_path / "again.csv", again), json=True))
    assert not made["misfit"]
    assert any(f"{len(rows) + 9} rows are at currents of earlier rows" in each for each in made["assumptions"])
    for name, figure in made["parameters"].items():
        assert figure["value"] == pytest.approx(once["parameters"][name]["value"], rel=0.01)
        # The noise of two rows is in it, that of the currents by the inductance; and noise leaves no row on the d axis, where the
        # exact table is folded.
        noise = np.hypot(5e-5, 5e-3 * once["parameters"]["d_axis_inductance"]["value"]) / np.sqrt(2.0)
        exact = once["parameters"][name]["standard_uncertainty"]
        assert figure["standard_uncertainty"] < (2.0 * noise if name == "flux_linkage" else 2.5 * exact)
        assert figure["coverage_interval"][0] < once["parameters"][name]["value"] < figure["coverage_interval"][1]
    hot = rows * [1.0, 1.0, 0.85, 1.0]
    with pytest.raises(InputError, match="of one motor at one temperature"):
        flux_map(written(tmp_path / "two.csv", np.vstack((rows, hot))))


def test_a_table_of_negative_q_currents_alone(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    rows = rows_of()
    made = analyzed(capsys, 0, flux_map(written(tmp_path / "map.csv", rows[rows[:, 1] <= 0.0]), json=True))
    assert made["parameters"]["flux_linkage"]["value"] == pytest.approx(0.06, rel=0.02)


def test_a_map_turned_far_gives_no_figures(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    angle = np.radians(12.0)
    turn = np.array([[np.cos(angle), np.sin(angle)], [-np.sin(angle), np.cos(angle)]])
    path = written(tmp_path / "map.csv", rows_of(lambda i, psi: (i @ turn, psi @ turn)))
    made = analyzed(capsys, 1, flux_map(path, json=True))
    assert made["withheld"]["flux_linkage"]["cause"] == "map-turned"
