"""`motorbench analyze table`: published figures beside a motor's."""

import json
import math
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


#: A motor of one pole pair as its maker's catalogue prints it, with K_t and K_n of block commutation.
CATALOGUE = """Characteristic;Value;Unit
Nominal voltage;24;V
No load speed;8810;rpm
No load current;253;mA
Stall torque;2080;mNm
Starting current;80,2;A
Terminal resistance phase to phase;0,299;Ω
Torque constant;25,9;mNm/A
Speed constant;369;rpm/V
Mechanical time constant;6,23;ms
Rotor inertia;139;gcm²
Number of pole pairs;1
"""


def read_sheet(capsys: pytest.CaptureFixture[str], path: Path, content: str) -> dict:
    path.write_text(content, encoding="utf-8")
    table(path, json=True)
    return json.loads(capsys.readouterr().out)


def test_a_data_sheet_is_held_against_itself(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    made = read_sheet(capsys, tmp_path / "sheet.csv", CATALOGUE)
    assert not made["unread"]
    figures = {row["parameter"]: row["value"] for row in made["figures"]}
    assert figures["stator_resistance"] == pytest.approx(0.1495)
    assert figures["inertia"] == pytest.approx(1.39e-5)
    assert "1.001" in made["checks"][0]
    assert "between two terminals" in made["checks"][0]
    assert len(made["checks"]) == 5
    assert all("agrees with" in check for check in made["checks"][1:])
    table(tmp_path / "sheet.csv")
    assert "0.01727" in capsys.readouterr().out


#: Below the figures, as makers go on; of these no quantity is one that is asked for.
HEAT = """Thermal data
Thermal resistance housing-ambient;4,7;K/W
Thermal resistance winding-housing;1,2;K/W
Insulation resistance;100;MOhm
Continuous stall torque;128;mNm
Ambient temperature;-40...+100;°C
"""


def by_tabs(catalogue: str) -> str:
    """As copied from a page: a title, then tabs, value and unit in one cell."""
    rows = (line.split(";") for line in (catalogue + HEAT).splitlines()[1:])
    return "Values at nominal voltage\n" + "".join(f"{row[0]}\t{' '.join(row[1:])}\n" for row in rows)


def by_blanks(catalogue: str) -> str:
    return by_tabs(catalogue).replace("\t", "  ")


def in_markdown(catalogue: str) -> str:
    head, *rows = (catalogue + HEAT).splitlines()
    return "\n".join(f"| {line.replace(';', ' | ')} |" for line in (head, "---;---;---", *rows)) + "\n"


@pytest.mark.parametrize("written", [by_tabs, by_blanks, in_markdown])
def test_a_data_sheet_is_read_as_pages_and_documents_write_it(written, tmp_path, capsys) -> None:
    expected = read_sheet(capsys, tmp_path / "sheet.csv", CATALOGUE)
    made = read_sheet(capsys, tmp_path / "sheet.md", written(CATALOGUE))
    assert (made["figures"], made["checks"]) == (expected["figures"], expected["checks"])
    assert not made["unread"]


def test_a_line_with_two_numbers_and_no_mark_is_not_read(tmp_path, capsys) -> None:
    made = read_sheet(capsys, tmp_path / "s.txt", "Torque constant at 25 °C 25.9 mNm/A\nPoles 8\nResistance 32 mOhm\n")
    assert {figure["parameter"] for figure in made["figures"]} == {"pole_pairs", "stator_resistance"}
    assert ["25.9 mNm/A" in row for row in made["unread"]] == [True]


def test_rows_that_give_nothing_say_what_to_add(tmp_path, capsys) -> None:
    made = read_sheet(capsys, tmp_path / "s.csv", "Nominal voltage,24 V\nStall torque,114 mNm\nStall current,3.74 A\n")
    assert (made["figures"], made["checks"]) == ([], [])
    assert "add resistance" in made["unread"][0]


def test_what_is_no_data_sheet_is_told_what_one_is(tmp_path) -> None:
    path = tmp_path / "s.csv"
    path.write_text("id (A),Ld (mH)\n0,1.5\n")
    with pytest.raises(UsageError, match=r"--run RUN or --motor FILE.*Torque constant;25\.9;mNm/A"):
        table(path)


@pytest.mark.parametrize(
    ("changed", "said"),
    [
        (("369;rpm/V", "369;rad/s/V"), "no usual pair of conventions"),
        (("25,9;mNm/A", "38,85;mNm/A"), "K_t per ampere, peak, of a sine current with K_e peak of a phase"),
        (("0,299;Ω", "0,1495;Ω"), "the factor 2"),
        (("139;gcm²", "139;kgcm²"), "is 0.00101 times R·J/K_t²"),
    ],
)
def test_a_data_sheet_that_contradicts_itself_is_told(
    changed: tuple[str, str], said: str, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    made = read_sheet(capsys, tmp_path / "sheet.csv", CATALOGUE.replace(*changed))
    assert said in str(made["checks"])


def test_no_convention_of_a_data_sheet_is_assumed(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    """The shipped motor has 8.5 mV·s and four pole pairs; what a row says of rms, lines or phases leaves fewer readings."""
    flux, speed = 4 * 8.5e-3, 1000.0 * 2.0 * math.pi / 60.0
    rows = f"Torque constant,{1.5 * math.sqrt(2) * flux:.5f},Nm/Arms\nBack-EMF constant line-to-line rms,"
    rows += f"{flux * speed * math.sqrt(1.5):.5f},V/krpm\nPoles,8\nResistance,32,mOhm\nStall torque,3,Nm,4,Nm\nInductance,1,V\n"
    found = compared(capsys, tmp_path / "s.csv", rows)
    assert [r["deviation_percent"] for r in found if r["parameter"] == "flux_linkage"] == pytest.approx(
        [0, 0], abs=0.05
    )
    assert [r["published"] for r in found if r["parameter"] == "stator_resistance"] == pytest.approx([0.016, 0.032])
    made = read_sheet(capsys, tmp_path / "s.csv", rows)
    assert [("Stall" in row, "unit of H" in row) for row in made["unread"]] == [(True, False), (False, True)]
    with pytest.raises(InputError, match="may mean"):
        read_sheet(capsys, tmp_path / "s.csv", CATALOGUE.replace("8810", "8.810"))


def test_a_data_sheet_s_zeros_and_quantities_that_stand_more_than_once_are_listed(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    rows = "Torque constant,0,Nm/A\nPoles,8\nPoles,6\nPoles,4\nResistance,32,mOhm\nRotor inertia,60,kgmm²\n"
    made = read_sheet(capsys, tmp_path / "s.csv", rows)
    assert {figure["parameter"] for figure in made["figures"]} == {"stator_resistance", "inertia"}
    assert sum("above zero" in row for row in made["unread"]) == 1
    assert sum("more than one value" in row for row in made["unread"]) == 2
