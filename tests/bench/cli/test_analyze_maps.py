"""`motorbench analyze flux-map`, `short-circuit`, `efficiency`: tables of others, right and wrong ones."""

import json
from collections.abc import Callable
from pathlib import Path

import numpy as np
import pytest

from bench.cli.analyze.maps import efficiency, flux_map, short_circuit
from bench.i18n.errors import InputError, UsageError
from tests.studies.worlds.flux_truths import Array, true_motors

MOTOR = true_motors(None)["reluctance, little magnet"]
GRID = np.array([[d, q] for d in np.linspace(-16.0, 16.0, 9) for q in np.linspace(-16.0, 16.0, 9)])


def rows_of(change: Callable[[Array, Array], tuple[Array, Array]] = lambda i, psi: (i, psi)) -> Array:
    flux = MOTOR.flux(GRID[:, 0] + 1j * GRID[:, 1])
    return np.hstack(change(GRID, np.column_stack((flux.real, flux.imag))))


def written(path: Path, rows: Array, heading: str = "id_A,iq_A,psi_d_Vs,psi_q_Vs") -> Path:
    path.write_text(
        heading + "\n" + "\n".join(",".join(f"{x:.9g}" for x in row) for row in rows) + "\n", encoding="utf-8"
    )
    return path


def analyzed(capsys: pytest.CaptureFixture[str], status: int, made: int) -> dict:
    assert made == status
    return json.loads(capsys.readouterr().out)


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


@pytest.mark.parametrize(
    ("heading", "factors", "mark", "encoding"),
    [
        ("Id (A rms),Iq (Arms),Psi_d (mWb),Psi_q (mWb)", [0.5**0.5, 0.5**0.5, 1e3, 1e3], ",", "utf-8"),
        ("id_Arms,iq_Arms,psi_d_Vs_rms,psi_q_Vs_rms", [0.5**0.5] * 4, ",", "utf-8"),
        ("I_d [A];I_q [A];Flux linkage d [mVs];Flux linkage q [mVs]", [1.0, 1.0, 1e3, 1e3], ";", "utf-16"),
        ("Id;Iq;λd;λq\nA;A;mVs;mVs", [1.0, 1.0, 1e3, 1e3], ";", "utf-8"),
        ("Id/A Iq/A lambda_d/mVs lambda_q/mVs", [1.0, 1.0, 1e3, 1e3], " ", "cp1252"),
        ("Id (A peak),Iq_A_pk,psi_d in Vs,psi_q_Vs", [1.0] * 4, ",", "utf-8"),
    ],
)
def test_headings_units_and_marks_of_others(
    heading: str, factors: list[float], mark: str, encoding: str, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    path = tmp_path / "map.csv"
    decimal = "," if mark == ";" else "."
    lines = [mark.join(f"{x:.9g}".replace(".", decimal) for x in row) for row in rows_of() * factors]
    path.write_text("\n".join([heading, *lines]), encoding=encoding)
    made = analyzed(capsys, 0, flux_map(path, json=True))
    assert not made["misfit"]
    assert made["parameters"]["flux_linkage"]["value"] == pytest.approx(0.06, rel=0.01)
    assert made["parameters"]["d_axis_inductance"]["value"] == pytest.approx(18e-3, rel=0.02)


def test_a_workbook_is_named(tmp_path: Path) -> None:
    path = tmp_path / "map.xlsx"
    path.write_bytes(b"PK\x03\x04" + bytes(200))
    with pytest.raises(InputError, match="is a workbook; save the sheet"):
        flux_map(path)


def test_columns_are_mapped(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    path = written(tmp_path / "map.csv", rows_of() * [1.0, 1.0, 1e3, 1e3], "Strom1,Strom2,F1 [mVs],F2 [mVs]")
    mapped = ["i_d=Strom1 (A)", "i_q=Strom2 (A)", "psi_d=F1 [mVs]", "psi_q=F2 [mVs]"]
    made = analyzed(capsys, 0, flux_map(path, column=mapped, json=True))
    assert made["parameters"]["flux_linkage"]["value"] == pytest.approx(0.06, rel=0.01)
    with pytest.raises(InputError, match="no column found for"):
        flux_map(path)
    with pytest.raises(UsageError, match="no column F3"):
        flux_map(path, column=["psi_d=F3"])


@pytest.mark.parametrize(
    ("command", "heading", "column"),
    [
        ("short-circuit", "speed,current_A", "speed"),
        ("short-circuit", "n,current_A", "n"),
        ("short-circuit", "w,current_A", "w"),
        ("short-circuit", "speed_rpm,current", "current"),
        ("short-circuit", "speed (Nm),current_A", "speed (Nm)"),
        ("efficiency", "torque_Nm,speed,power_W", "speed"),
        ("efficiency", "torque,speed_rpm,power_W", "torque"),
        ("efficiency", "torque_Nm,speed_rpm,power", "power"),
        ("short-circuit", "speed (Hz),current_A", "speed (Hz)"),
        ("short-circuit", "speed (rpm),current (A peak-peak)", "current (A peak-peak)"),
        ("efficiency", "T (pdlft),n (rpm),P (W)", "T (pdlft)"),
        ("flux-map", "Id,Iq,lambda_d,lambda_q", "Id"),
        ("flux-map", "id_A,iq_A,psi_d,psi_q", "psi_d"),
    ],
)
def test_a_unit_that_is_left_open_is_refused_with_advice(
    command: str, heading: str, column: str, tmp_path: Path
) -> None:
    rows = np.geomspace(1.0, 100.0, 10)[:, None] * np.ones(heading.count(",") + 1)
    path = written(tmp_path / "table.csv", rows, heading)
    typed = {
        "short-circuit": lambda: short_circuit(path, pole_pairs=4.0),
        "efficiency": lambda: efficiency(path),
        "flux-map": lambda: flux_map(path),
    }
    with pytest.raises(InputError) as refused:
        typed[command]()
    assert f"column '{column}' states no unit" in str(refused.value)
    assert f"={column} (" in str(refused.value)


@pytest.mark.parametrize(
    ("heading", "column"),
    [
        ("rpm,current_A", ()),
        ("n [1/min],I (A)", ()),
        ("Speed in rpm;Current in A", ()),
        ("n;i\nmin-1;A", ()),
        ("speed,current", ("speed=speed (rpm)", "current=current (A)")),
    ],
)
def test_a_speed_in_rpm_is_understood_however_it_is_headed(
    heading: str, column: tuple[str, ...], tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    w = np.geomspace(20.0, 2000.0, 15)
    i = 0.3 * w / np.hypot(0.5, w * 10e-3)
    path = written(tmp_path / "table.csv", np.column_stack((w / 4.0 * 30.0 / np.pi, i)), heading)
    path.write_text(path.read_text(encoding="utf-8").replace(",", ";" if ";" in heading else ","), encoding="utf-8")
    made = analyzed(capsys, 0, short_circuit(path, pole_pairs=4.0, flux_linkage=0.3, column=column, json=True))
    assert made["parameters"]["d_axis_inductance"]["value"] == pytest.approx(10e-3, rel=0.01)


def test_two_columns_for_one_are_asked_about(tmp_path: Path) -> None:
    rows = np.geomspace(1.0, 100.0, 10)[:, None] * np.ones(3)
    path = written(tmp_path / "table.csv", rows, "speed_rpm,current_A,i_A")
    with pytest.raises(InputError, match="two columns could be the current: current_A and i_A"):
        short_circuit(path, pole_pairs=4.0)


def test_rms_said_twice_counts_once(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    w = np.geomspace(20.0, 2000.0, 15)
    i = 0.3 * w / np.hypot(0.5, w * 10e-3) / np.sqrt(2.0)
    for heading in ("speed_rad/s,current_Arms", "speed_rad/s,current_A"):
        path = written(tmp_path / "table.csv", np.column_stack((w / 4.0, i)), heading)
        made = analyzed(capsys, 0, short_circuit(path, pole_pairs=4.0, flux_linkage=0.3, rms=True, json=True))
        assert made["parameters"]["d_axis_inductance"]["value"] == pytest.approx(10e-3, rel=0.01)


def test_electrical_speeds_by_their_heading(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    w = np.geomspace(20.0, 2000.0, 15)
    i = 0.3 * w / np.hypot(0.5, w * 10e-3)
    path = written(tmp_path / "table.csv", np.column_stack((w, i)), "w_electrical (rad/s),current_A")
    made = analyzed(capsys, 0, short_circuit(path, pole_pairs=4.0, flux_linkage=0.3, json=True))
    assert made["parameters"]["d_axis_inductance"]["value"] == pytest.approx(10e-3, rel=0.01)


def test_without_a_flux_linkage_the_current_at_high_speed_is_given(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    w = np.geomspace(20.0, 2000.0, 20)
    i = 0.3 * w / np.hypot(0.5, w * 10e-3)
    path = written(tmp_path / "table.csv", np.column_stack((w, i)), "w_electrical (rad/s),current_A")
    made = analyzed(capsys, 0, short_circuit(path, pole_pairs=4.0, json=True))
    assert set(made["parameters"]) == {"short_circuit_current"}
    low, high = made["parameters"]["short_circuit_current"]["coverage_interval"]
    assert low < 30.0 < high < 1.1 * low


def test_more_rows_than_can_be_weighed_are_refused(tmp_path: Path) -> None:
    rows = np.column_stack((np.linspace(10.0, 1000.0, 501), np.full(501, 3.0), np.full(501, 400.0)))
    path = written(tmp_path / "long.csv", rows, "speed_rad/s,current_A,power_W")
    with pytest.raises(InputError, match="501 rows; up to 500 are taken, thin the table out"):
        short_circuit(path, pole_pairs=4.0)
    path = written(tmp_path / "long.csv", np.tile(rows, (10, 1)), "speed_rad/s,torque_Nm,power_W")
    with pytest.raises(InputError, match="5010 rows; up to 5000 are taken"):
        efficiency(path)


def test_a_short_circuit_whose_drop_contradicts_is_an_alarm(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    speed = np.geomspace(10.0, 600.0, 20)
    flux, l_d, l_q, r = 0.3, 10e-3, 20e-3, 0.5
    current = flux * speed * np.sqrt(r**2 + (speed * l_q) ** 2) / (r**2 + speed**2 * l_d * l_q)
    torque = 1.5 * r * current**2 * 2.0 / speed
    heading = "speed_rad/s,current_A,torque_Nm"
    path = written(tmp_path / "right.csv", np.column_stack((speed / 2.0, current, torque)), heading)
    exact = {"u_flux_linkage": 0.0, "current_gain": 0.0, "unbalance": 0.0, "speed_gain": 0.0, "saturation": 0.0}
    made = analyzed(capsys, 0, short_circuit(path, pole_pairs=2.0, flux_linkage=flux, json=True, **exact))
    assert made["parameters"]["stator_resistance"]["value"] == pytest.approx(r, rel=0.005)
    assert made["parameters"]["d_axis_inductance"]["value"] == pytest.approx(l_d, rel=0.005)
    path = written(tmp_path / "wrong.csv", np.column_stack((speed / 2.0, current, 0.8 * torque)), heading)
    made = analyzed(capsys, 1, short_circuit(path, pole_pairs=2.0, flux_linkage=flux, json=True))
    assert made["withheld"]["stator_resistance"]["cause"] == "resistances-differ"
    assert set(made["parameters"]) & {"stator_resistance", "d_axis_inductance"} == {"d_axis_inductance"}
    for column, flux_linkage in ((current / np.sqrt(2.0), flux), (current, 1e3 * flux)):
        path = written(tmp_path / "scaled.csv", np.column_stack((speed / 2.0, column, torque)), heading)
        made = analyzed(capsys, 1, short_circuit(path, pole_pairs=2.0, flux_linkage=flux_linkage, json=True))
        assert "near √2, the currents are rms" in json.dumps(made["withheld"]["d_axis_inductance"], ensure_ascii=False)


def test_efficiency_knows_what_the_rows_share(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    path = written(
        tmp_path / "load.csv", np.array([[10.0, 1500.0, 1700.0], [10.0, 1500.0, 1000.0]]), "torque_Nm,speed_rpm,power_W"
    )
    made = analyzed(capsys, 0, efficiency(path, torque_gain=0.2, power_gain=0.1, json=True))
    good, bad = made["details"]["load_points"]
    assert good["efficiency"]["value"] == pytest.approx(10.0 * 1500.0 * np.pi / 30.0 / 1700.0)
    half = 0.5 * np.ptp(good["loss"]["coverage_interval"])
    assert 1.7 * 0.5 < half < 1570.8 * 0.002 + 1.7
    assert "come out of" in bad["refused"]
    # What makes one row impossible is in the others too.
    assert [warning["id"] for warning in made["warnings"]] == ["", "above-one"]


def test_tables_as_spreadsheets_write_them(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    rows, heading = rows_of(), "id_A,iq_A,psi_d_Vs,psi_q_Vs"
    whole = analyzed(capsys, 0, flux_map(written(tmp_path / "m.csv", rows, heading), json=True))["parameters"]
    content = (tmp_path / "m.csv").read_text(encoding="utf-8")
    micro = written(tmp_path / "u.csv", rows * [1.0, 1.0, 1e6, 1e6], "id_A,iq_A,psi_d (µVs),psi_q (uWb)")
    minus = tmp_path / "minus.csv"
    minus.write_text(content.replace(",", ";").replace("-", "\u2212").replace(".", ","), encoding="utf-16")
    for path in (micro, minus):
        made = analyzed(capsys, 0, flux_map(path, json=True))["parameters"]
        assert made["flux_linkage"]["value"] == pytest.approx(whole["flux_linkage"]["value"], rel=1e-6)
    commas = tmp_path / "commas.csv"
    commas.write_text(content.replace(".", ","), encoding="utf-8")
    with pytest.raises(InputError, match=r"line 2: . cells under 4 headings"):
        flux_map(commas)


def test_a_file_that_is_no_table_is_refused(tmp_path: Path) -> None:
    path = tmp_path / "no.csv"
    path.write_text("hello", encoding="utf-8")
    with pytest.raises(InputError, match="heading and rows"):
        flux_map(path)
    path.write_text("id_A,iq_A,psi_d_Vs,psi_q_Vs\n1,2,x,4\n", encoding="utf-8")
    with pytest.raises(InputError, match="line 2, column psi_d_Vs"):
        flux_map(path)


@pytest.mark.parametrize(
    "above",
    ["2031-05-04 15:22:21.5\n", "Dyno 2, tester: me\n", "Motor,outrunner 5\nSupply (V),48\n"],
    ids=["time", "title", "names with values"],
)
def test_a_heading_below_a_title_is_found(above: str, tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    path = tmp_path / "load.csv"
    head = "Input voltage, Input Power, Output Torque, Output Speed, Room\nV, W, N.mm, rad/s, Deg C\n"
    path.write_text(f"{above}{head}48, 170, 800, 150, 21\n48, 390, 1800, 150, 21\n", encoding="utf-8")
    made = analyzed(capsys, 0, efficiency(path, json=True))
    found = [row["efficiency"]["value"] for row in made["details"]["load_points"]]
    assert found == pytest.approx([0.8 * 150 / 170, 1.8 * 150 / 390])


def test_a_unit_that_is_none_in_a_row_of_units_is_asked_for(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    path = tmp_path / "load.csv"
    path.write_text("Power,Torque,Speed\nW,mNm,rad.s\n170,800,150\n", encoding="utf-8")
    with pytest.raises(InputError, match=r"'Speed' states no unit.*--column 'speed=Speed \(rpm\)'"):
        efficiency(path)
    made = analyzed(capsys, 0, efficiency(path, column=("speed=Speed (rad/s)",), json=True))
    assert made["details"]["load_points"][0]["efficiency"]["value"] == pytest.approx(0.8 * 150 / 170)
