"""`motorbench analyze table`: published figures beside a motor's."""

import json
from pathlib import Path

import pytest

from bench.cli.analyze.table import table
from bench.i18n.errors import InputError, UsageError


def compared(capsys: pytest.CaptureFixture[str], path: Path, content: str, **more: float) -> list[dict]:
    path.write_text(content, encoding="utf-8")
    table(path, motor="lg-400w", json=True, **more)
    return json.loads(capsys.readouterr().out)["compared"]


def test_ld_over_current_as_moteus_writes_it(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    levels = {"ld": [{"d_A": 0.0, "L_d_H": 73e-6}, {"d_A": -10.0, "L_d_H": 80.3e-6}], "fit": {"lambda_m": 0.0086}}
    rows = compared(capsys, tmp_path / "ld.json", json.dumps(levels))
    assert [(r["parameter"], r["current"]) for r in rows] == [
        ("d_axis_inductance", 0.0),
        ("d_axis_inductance", -10.0),
        ("flux_linkage", None),
    ]
    assert [r["deviation_percent"] for r in rows[:2]] == pytest.approx([0.0, 10.0], abs=1e-6)


def test_what_a_vesc_stored_is_divided_by_nine_tenths(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    stored = (0.9 * 0.5 * (73e-6 + 76.5e-6), 0.9 * 3.5e-6)
    xml = (
        f"<MCConfiguration><foc_motor_l>{stored[0]}</foc_motor_l><foc_motor_ld_lq_diff>{stored[1]}</foc_motor_ld_lq_diff>"
        "<si_motor_poles>8</si_motor_poles></MCConfiguration>"
    )
    rows = {r["parameter"]: r for r in compared(capsys, tmp_path / "mc.xml", xml)}
    assert rows["d_axis_inductance"]["published"] == pytest.approx(73e-6)
    assert rows["q_axis_inductance"]["published"] == pytest.approx(76.5e-6)
    assert rows["pole_pairs"]["published"] == 4.0
    rows = {r["parameter"]: r for r in compared(capsys, tmp_path / "mc.xml", xml, vesc_scale=1.0)}
    assert rows["d_axis_inductance"]["deviation_percent"] == pytest.approx(-10.0, abs=0.01)


def test_columns_take_their_units(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    rows = compared(capsys, tmp_path / "t.csv", "id (A),Ld (uH),Lq (uH)\n0,73,76.5\n5,70,75\n")
    assert [r["published"] for r in rows] == pytest.approx([73e-6, 76.5e-6, 70e-6, 75e-6])


@pytest.mark.parametrize(
    ("content", "said"),
    [
        ("{}", "contains no figures in a known form"),
        ('{"ld": 3}', "contains no figures in a known form"),
        ("<a></a>", "contains no figures in a known form"),
        ("<foc_motor_r>x</foc_motor_r>", "not a number"),
        ("id (A),Ld (H)\n1\n", "line 2"),
        ('{"ld": [{"d_A": 0, "L_d_H": NaN}]}', "not a number"),
        ("", "contains no figures in a known form"),
        ("id (A),Ld\n0,60\n", r"column 'Ld' has no unit of H"),
        ("id (A),Ld (Ohm)\n0,60e-6\n", r"column 'Ld \(Ohm\)' has no unit of H"),
        ("id (V),Ld (H)\n0,60e-6\n", r"column 'id \(V\)' has no unit of A"),
    ],
)
def test_what_cannot_be_read_is_refused(tmp_path: Path, content: str, said: str) -> None:
    path = tmp_path / "file"
    path.write_text(content, encoding="utf-8")
    with pytest.raises(InputError, match=said):
        table(path, motor="lg-400w")


def test_run_or_motor(tmp_path: Path) -> None:
    with pytest.raises(UsageError, match="one of the two"):
        table(tmp_path / "x")
    with pytest.raises(InputError, match="cannot be read"):
        table(tmp_path / "x", motor="lg-400w")


def test_figures_that_nothing_is_there_for_are_named(tmp_path: Path) -> None:
    motor, published = tmp_path / "m.toml", tmp_path / "ld.csv"
    motor.write_text('[nameplate]\nname = "m"\nconnection = "wye"\nrated_current = 1.0\n', encoding="utf-8")
    published.write_text("id (A),Ld (H)\n0,1e-3\n", encoding="utf-8")
    with pytest.raises(InputError, match=r"it has figures of d-axis inductance, and .*m\.toml has none of these"):
        table(published, motor=str(motor))
