"""Tables of four-wire readings: columns, lines, signs and units as people write them, and what the readings themselves show."""

import numpy as np
import pytest

from bench.analysis import analyze_four_wire
from bench.analysis.statements import read_statements
from bench.analysis.temperature import copper_temperature
from bench.captures import CaptureError
from tests.command_line import Call

LEVELS = 5.0 * np.array([1.0, 0.75, 0.5, 0.25, 1.0])
#: Readings, not set points: with all their digits.
CURRENT = np.concatenate((LEVELS, -LEVELS)) + 1e-4 * np.random.default_rng(8).standard_normal(10)


def table(path, columns, heading, mark=","):
    np.savetxt(path, np.column_stack(columns), delimiter=mark, fmt="%.7g", header=heading, comments="")
    return path


def volts(resistance, seed=0, current=CURRENT):
    """Return voltages with a thermal EMF, a zero of the ammeter and noise."""
    random = np.random.default_rng(seed)
    return resistance * (current + 2e-3 * np.sign(current)) + 20e-6 + 3e-6 * random.standard_normal(current.size)


def given(result):
    return result["parameters"]["stator_resistance"]


def test_one_line_in_millivolts(tmp_path):
    path = table(tmp_path / "ab.csv", (CURRENT, 1e3 * volts(0.2)), "I (A),U (mV)")
    result = analyze_four_wire(path)
    low, high = given(result)["coverage_interval"]
    assert low < 0.1 < high
    assert high - low < 2e-5
    assert given(result)["winding"] is None
    assert any("taken as equal" in said for said in result["assumptions"])


@pytest.mark.parametrize("columns", ["files", "one current", "a current each"])
def test_three_lines(tmp_path, columns):
    lines = {"AB": 0.2, "BC": 0.203, "CA": 0.197}
    read = [volts(ohms, seed) for seed, ohms in enumerate(lines.values())]
    if columns == "files":
        files = [table(tmp_path / f"{n}.csv", (CURRENT, v), "I (A),U (V)") for n, v in zip(lines, read, strict=True)]
    elif columns == "one current":
        files = [table(tmp_path / "all.csv", (CURRENT, *read), "I (A);U_AB (V);U_BC (V);U_CA (V)", ";")]
    else:
        each = [column for v in read for column in (CURRENT, v)]
        files = [table(tmp_path / "all.csv", each, ",".join(f"I_{n} (A),U_{n} (V)" for n in lines))]
    result = analyze_four_wire(files, connection="delta")
    assert given(result)["value"] == pytest.approx(0.1, rel=1e-3)
    assert given(result)["winding"] == pytest.approx(0.3, rel=1e-3)
    assert result["details"]["largest_deviation"] == pytest.approx(0.015, abs=1e-3)
    assert not result["warnings"]


def test_a_line_that_differs_is_named(tmp_path):
    read = [volts(ohms, seed) for seed, ohms in enumerate((0.2, 0.2, 0.22))]
    path = table(tmp_path / "all.csv", (CURRENT, *read), "I (A),U_AB (V),U_BC (V),U_CA (V)")
    warning = next(each for each in analyze_four_wire(path)["warnings"] if each["id"] == "unequal-phases")
    assert "U_CA differs" in warning["text"]
    assert "6.5%" in warning["text"]


def test_a_supply_shows_no_sign(tmp_path):
    path = table(tmp_path / "ab.csv", (np.abs(CURRENT), volts(0.2)), "I (A),U (V)")
    result = analyze_four_wire(path)
    assert given(result)["value"] == pytest.approx(0.1, rel=2e-4)
    assert any("shows no sign" in said for said in result["assumptions"])


def test_stated_limits_and_temperature(tmp_path):
    path = table(tmp_path / "ab.csv", (CURRENT, volts(0.2)), "I (A),U (V)")
    result = analyze_four_wire(
        path,
        accuracy=read_statements(["current=0.2%+5mA", "U=0.05%+10uV"]),
        temperature=copper_temperature(65.0, 1.0, 0.00393),
    )
    assert given(result)["value"] == pytest.approx(0.1 * (1 + 0.00393 * 5) / (1 + 0.00393 * 45), rel=2e-4)
    relative = given(result)["standard_uncertainty"] / given(result)["value"]
    warm = 0.00393 / (1 + 0.00393 * 45)
    assert relative == pytest.approx(np.hypot(np.hypot(0.002, 0.0005), warm) / np.sqrt(3.0), rel=0.02)
    assert "25 °C" in given(result)["convention"]


@pytest.mark.parametrize("factor", [0.1, 10.0, -1.0])
def test_a_typed_slip(tmp_path, factor):
    read = volts(0.2)
    read[3] *= factor
    result = analyze_four_wire(table(tmp_path / "ab.csv", (CURRENT, read), "I (A),U (V)"))
    assert "repeats-differ" in {each["id"] for each in result["warnings"]}
    if "stator_resistance" in result["parameters"]:
        low, high = given(result)["coverage_interval"]
        assert low < 0.1 < high


def test_a_contact_that_rectifies_where_both_polarities_follow_each_other(tmp_path):
    levels = 5.0 * np.array([1.0, 0.75, 0.5, 0.25])
    current = np.column_stack((levels, -levels)).ravel()
    read = volts(0.2, current=current) + 4e-3 * np.maximum(current, 0.0)
    result = analyze_four_wire(table(tmp_path / "ab.csv", (current, read), "I (A),U (V)"))
    assert "curvature" in {each["id"] for each in result["warnings"]}
    low, high = given(result)["coverage_interval"]
    assert low < 0.1 < high


def test_a_winding_that_warms_is_told(tmp_path):
    time = 10.0 * np.arange(CURRENT.size)
    warm = 0.2 * (1.0 + 0.00393 * 8.0 * time / time[-1])
    path = table(tmp_path / "ab.csv", (time, CURRENT, warm * CURRENT), "time (s),I (A),U (V)")
    warning = next(each for each in analyze_four_wire(path)["warnings"] if each["id"] == "heating")
    assert "+8" in warning["text"] or "+7." in warning["text"]


@pytest.mark.parametrize("order", ["falling", "by polarity", "in turn"])
def test_whole_amperes_are_said_to_be_coarse(tmp_path, order):
    levels = np.array([5.0, 4.0, 3.0, 2.0, 1.0])
    current = {
        "falling": np.concatenate((levels, -levels[::-1])),
        "by polarity": np.concatenate((levels, -levels)),
        "in turn": np.column_stack((levels, -levels)).ravel(),
    }[order]
    result = analyze_four_wire(table(tmp_path / "ab.csv", (current, volts(0.2, current=current)), "I (A),U (V)"))
    low, high = given(result)["coverage_interval"]
    assert low < 0.1 < high
    assert high - low > 0.02
    warning = next(each for each in result["warnings"] if each["id"] == "few-digits")
    assert "'I' are written to 30%" in warning["text"]


def test_few_readings_are_said(tmp_path):
    current = np.array([2.0, 1.0, -1.0, -2.0])
    result = analyze_four_wire(table(tmp_path / "ab.csv", (current, volts(0.2, current=current)), "I (A),U (V)"))
    assert "few-readings" in {each["id"] for each in result["warnings"]}


@pytest.mark.parametrize(
    ("heading", "columns", "message"),
    [
        ("I (A),U (V)", (LEVELS, 0.2 * LEVELS), "one sign"),
        ("I,U (V)", (CURRENT, volts(0.2)), "column 'I' states no unit.*A, mA"),
        ("I (A),U", (CURRENT, volts(0.2)), "column 'U' states no unit.*V, mV"),
        ("I1 (A),I2 (A),U1 (V),U2 (V),U3 (V)", (CURRENT, CURRENT, *(volts(0.2, k) for k in range(3))), "2 columns of"),
        ("I (A),U1 (V),U2 (V)", (CURRENT, volts(0.2), volts(0.2, 1)), "2 lines are there"),
        ("I (A),U (V)", (CURRENT, -volts(0.2)), "wrong way round"),
        ("I (A),U1 (V),U2 (V),U3 (V)", (CURRENT, volts(0.2), volts(0.2, 1), volts(0.9, 2)), "exceeds the sum"),
        ("I (A),U1 (V),U2 (V),U3 (V)", (CURRENT, *[volts(0.2)] * 3), "same readings"),
    ],
)
def test_what_cannot_be_used(tmp_path, heading, columns, message):
    path = table(tmp_path / "table.csv", columns, heading)
    with pytest.raises(CaptureError, match=f"table.csv.*{message}"):
        analyze_four_wire(path)


def test_without_a_heading(tmp_path):
    path = tmp_path / "table.csv"
    np.savetxt(path, np.column_stack((CURRENT, volts(0.2))), delimiter=",")
    with pytest.raises(CaptureError, match=r"column 2.*no unit"):
        analyze_four_wire(path)


def test_typed_as_a_command(call: Call, tmp_path):
    path = table(tmp_path / "ab.csv", (CURRENT, volts(0.2)), "I (A),U (V)")
    code, out, _ = call("analyze", "four-wire", str(path), "--temperature", "25", "--language", "zh")
    assert code == 0
    assert "定子电阻" in out
    code, _, err = call("analyze", "four-wire", str(path), "--reading", "phase", "--connection", "delta")
    assert code == 2
    assert "no star point" in err
    assert call("analyze", "four-wire")[0] == 2


def test_a_column_of_row_numbers_is_no_reading(tmp_path):
    rows = np.arange(1, CURRENT.size + 1)
    plain = analyze_four_wire(table(tmp_path / "plain.csv", (CURRENT, volts(0.2)), "I (A),U (V)"))
    numbered = analyze_four_wire(table(tmp_path / "numbered.csv", (rows, CURRENT, volts(0.2)), "No,I (A),U (V)"))
    assert given(numbered)["coverage_interval"] == given(plain)["coverage_interval"]


#: Two amounts of current, set again and again.
TWO = 3.0 * np.array([1.0, -1.0, 0.5, -0.5] * 4) * (1.0 + 2e-3 * np.random.default_rng(5).standard_normal(16))


def test_two_amounts_of_current_do_not_hide_a_contact_that_changes_with_the_current(tmp_path):
    random = np.random.default_rng(6)
    film = 0.2 * TWO * (1.0 + 0.02 / (1.0 + np.abs(TWO) / 0.6)) + 3e-6 * random.standard_normal(TWO.size)
    result = analyze_four_wire(table(tmp_path / "ab.csv", (TWO, film), "I (A),U (V)"))
    low, high = given(result)["coverage_interval"]
    assert low < 0.1 < high
    assert [said["id"] for said in result["warnings"]] == ["few-readings"]
    assert "two amounts" in result["warnings"][0]["text"]


def test_two_amounts_of_current_that_agree_keep_their_narrow_interval(tmp_path):
    clean = 0.2 * TWO + 3e-6 * np.random.default_rng(7).standard_normal(TWO.size)
    low, high = given(analyze_four_wire(table(tmp_path / "ab.csv", (TWO, clean), "I (A),U (V)")))["coverage_interval"]
    assert low < 0.1 < high
    assert high - low < 5e-6


def test_a_contact_that_comes_and_goes_is_told_where_no_accuracy_is_stated(tmp_path):
    random = np.random.default_rng(9)
    current = np.tile(CURRENT, 3)
    read = 0.2 * current * (1.0 + 0.02 * (random.random(current.size) < 0.3))
    path = table(tmp_path / "ab.csv", (current, read), "I (A),U (V)")
    result = analyze_four_wire(path)
    low, high = given(result)["coverage_interval"]
    assert low < 0.1 < high
    assert "repeats-differ" in [said["id"] for said in result["warnings"]]
    assert any("nothing stated explains it" in found["message"] for found in result["misfit"])


@pytest.mark.parametrize(("alternates", "told"), [(False, True), (True, False)])
def test_a_sweep_of_the_current_says_that_it_hides_a_thermal_drift(tmp_path, alternates, told):
    rising = np.array([-5.0, -4.0, -3.0, -2.0, -1.0, 1.0, 2.0, 3.0, 4.0, 5.0])
    current = (rising[[0, 9, 1, 8, 2, 7, 3, 6, 4, 5]] if alternates else rising) + 1e-4 * np.arange(10) ** 2 % 7e-4
    read = 2e-3 * current + 10e-6 * np.linspace(0.0, 1.0, 10) + 2e-8 * np.random.default_rng(3).standard_normal(10)
    result = analyze_four_wire(table(tmp_path / "ab.csv", (current, 1e3 * read), "I (A),U (mV)"))
    assert ("drift-hidden" in [said["id"] for said in result["warnings"]]) == told
    if told:
        low, high = given(result)["coverage_interval"]
        # 10 µV over 10 A: a thousandth of 1 mΩ, as the warning says.
        assert given(result)["value"] == pytest.approx(1e-3 * 1.0005, rel=1e-4)
        assert high - low < 1e-6


def test_a_reading_without_a_current_is_one_of_the_voltmeters_zero(tmp_path):
    levels = np.array([0.0, 1.0012, 2.0007, 3.0021, 4.0003])
    current = np.concatenate((levels, -levels, levels, -levels))
    result = analyze_four_wire(table(tmp_path / "ab.csv", (current, volts(0.2, current=current)), "I (A),U (V)"))
    low, high = given(result)["coverage_interval"]
    assert low < 0.1 < high
    assert high - low < 1e-4


def test_a_current_and_nothing_do_not_show_a_resistance(tmp_path):
    current = np.tile([-1.0, 0.0, 1.0], 4)
    path = table(tmp_path / "ab.csv", (current, volts(0.2, current=current)), "I (A),U (V)")
    with pytest.raises(CaptureError, match="all currents are alike; take readings at several currents"):
        analyze_four_wire(path)


def test_a_voltmeter_that_is_off_is_said(tmp_path):
    path = table(tmp_path / "ab.csv", (CURRENT, 0.0 * CURRENT), "I (A),U (V)")
    with pytest.raises(CaptureError, match="all voltages are alike, whatever the current"):
        analyze_four_wire(path)


def test_two_columns_of_one_name_and_no_voltage(tmp_path):
    path = table(tmp_path / "ab.csv", (CURRENT, CURRENT), "I (A),I (A)")
    with pytest.raises(CaptureError, match="none of the columns could be the voltage"):
        analyze_four_wire(path)


def test_set_points_of_one_digit_are_said_to_set_the_interval(tmp_path):
    current = np.tile([1.0, -1.0, 2.0, -2.0, 3.0, -3.0], 2)
    result = analyze_four_wire(table(tmp_path / "ab.csv", (current, volts(0.2, current=current)), "I (A),U (V)"))
    [said] = [each["text"] for each in result["warnings"] if each["id"] == "few-digits"]
    assert "written to 46% of their size" in said
