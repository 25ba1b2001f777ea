"""Tables for `motorbench analyze flux-map`, `short-circuit` and `efficiency`: headings, units and marks of others."""

from pathlib import Path

import numpy as np
import pytest

from bench.cli.analyze.maps import efficiency, flux_map, short_circuit
from bench.i18n.errors import InputError, UsageError
from tests.bench.cli.map_tables import analyzed, rows_of, written


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
        pytest.param("n [1/min],I (A)", (), marks=pytest.mark.slow),
        pytest.param("Speed in rpm;Current in A", (), marks=pytest.mark.slow),
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


def test_more_rows_than_can_be_weighed_are_refused(tmp_path: Path) -> None:
    rows = np.column_stack((np.linspace(10.0, 1000.0, 501), np.full(501, 3.0), np.full(501, 400.0)))
    path = written(tmp_path / "long.csv", rows, "speed_rad/s,current_A,power_W")
    with pytest.raises(InputError, match="501 rows; up to 500 are taken, thin the table out"):
        short_circuit(path, pole_pairs=4.0)
    path = written(tmp_path / "long.csv", np.tile(rows, (10, 1)), "speed_rad/s,torque_Nm,power_W")
    with pytest.raises(InputError, match="5010 rows; up to 5000 are taken"):
        efficiency(path)


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
