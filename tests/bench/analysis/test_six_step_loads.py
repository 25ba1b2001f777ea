"""Tables of a six-step drive's load points: columns and units as people write them, and figures against a drive that is solved exactly."""

import math
from dataclasses import replace

import numpy as np
import pytest

from bench.analysis import TypedEmf, TypedWinding, analyze_six_step_loads
from bench.analysis.statements import read_statements
from bench.i18n.errors import InputError, UsageError
from bench.motor.six_step_file import load_drive
from sim_instruments.six_step import balance
from sim_instruments.six_step.emf import mean_line_emf
from sim_instruments.six_step.load import balance_load
from sim_instruments.six_step.state import Bridge
from tests.command_line import Call

DRIVE = load_drive("92bl-30-25l")
EMF = mean_line_emf(DRIVE)
STATES = [balance_load(Bridge(DRIVE), torque) for torque in (0.1, 0.3, 0.5, 0.7, 0.9)]
RPM = 30.0 / math.pi
KNOWN = TypedEmf(EMF, uncertainty=1e-3 * EMF, commutation=math.radians(1.0))
WINDING = TypedWinding("delta", 0.1146, 1e-3, inductance=0.4353e-3, inductance_uncertainty=5e-6)


def resistance(state):
    return (state.average_bus_voltage - EMF * state.speed) / state.average_supply_current


def rows_of(states=STATES, temperature=25.0):
    return [
        [s.average_bus_voltage, s.average_supply_current, s.speed * RPM, s.load_torque, temperature] for s in states
    ]


def table(folder, rows=None, heading="U (V),I (A),n (rpm),M (Nm),Tw (°C)", mark=",", decimal="."):
    path = folder / "loads.csv"
    lines = [mark.join(f"{v:.6g}".replace(".", decimal) for v in row) for row in rows or rows_of()]
    path.write_text("\n".join([heading, *lines]) + "\n", encoding="utf-8")
    return path


def wave(folder, state, name):
    """Return a capture of forty periods of a line's current on eight bits, begun anywhere, with noise."""
    random = np.random.default_rng(round(1e3 * state.load_torque))
    time = np.linspace(0.0, 39.7 * state.period, 20_000, endpoint=False)
    grid = np.linspace(0.0, state.period, 10_001)
    current = np.interp((time + 0.3 * state.period) % state.period, grid, state.line_currents(grid)[0])
    step = 2.4 * float(np.max(np.abs(current))) / 256.0
    current = step * np.round((current + 0.7 * step * random.standard_normal(time.size)) / step)
    path = folder / name
    np.savetxt(
        path, np.column_stack((time, current)), delimiter=",", fmt="%.8g", header="time (s),CH1 (A)", comments=""
    )
    return path


def holds(figure, truth):
    low, high = figure["coverage_interval"]
    return low <= truth <= high


@pytest.mark.parametrize(
    ("heading", "factors", "mark", "decimal", "typed"),
    [
        ("U (V),I (A),n (rpm),M (Nm),Tw (°C)", (1, 1, 1, 1, 1), ",", ".", {}),
        ("Spannung [V];Strom [mA];n [1/min];M [mNm];Temp [°C]", (1, 1e3, 1, 1e3, 1), ";", ",", {}),
        ("bus voltage (mV)\tbus current (A)\tspeed (rad/s)\ttorque (oz-in)\ttemperature (degC)", (1e3, 1, 1 / RPM, 141.612, 1),
         "\t", ".", {}),
        ("U (V),I (A),eRPM (rpm),torque (Nm),temp (C°)", (1, 1, 4, -1, 1), ",", ".",
         {"pole_pairs": 4, "mapped": ["temperature=temp (C°) (°C)"]}),
        ("U (V),I (A),speed (rpm),torque (Nm),temp (°C)", (1, 1, -4, 1, 1), ",", ".", {"pole_pairs": 4, "electrical": True}),
    ],
)  # fmt: skip
def test_layouts(tmp_path, heading, factors, mark, decimal, typed):
    rows = [[v * f for v, f in zip(row, factors, strict=True)] for row in rows_of()]
    if "C°" in heading:
        heading, typed = heading.replace(" (C°)", ""), {**typed, "mapped": ["temperature=temp (°C)"]}
    made = analyze_six_step_loads(table(tmp_path, rows, heading, mark, decimal), emf=KNOWN, **typed)
    figure = made["parameters"]["equivalent_resistance"]
    assert figure["value"] == pytest.approx(resistance(STATES[-1]), rel=2e-3)
    assert holds(figure, resistance(STATES[-1]))
    assert not made["misfit"]
    assert not made["warnings"]
    points = made["details"]["points"]
    assert [p["equivalent_resistance"] for p in points] == pytest.approx([resistance(s) for s in STATES], rel=1e-2)


def test_waveforms_give_what_a_run_gives(tmp_path):
    captures = [wave(tmp_path, state, f"{k}.csv") for k, state in enumerate(STATES)]
    # The rows stand in another order than their currents.
    made = analyze_six_step_loads(
        table(tmp_path, rows_of()[::-1]),
        captures[::-1],
        pole_pairs=4,
        winding=WINDING,
        accuracy=read_statements(["voltage=0.1%", "current=0.2%", "CH1=1%", "speed=0.02%"]),
    )
    last = STATES[-1]
    copper = balance.losses(last).copper / last.average_supply_current**2
    truths = {
        "line_emf_constant": EMF,
        "switch_resistance": DRIVE.switch_resistance,
        "equivalent_resistance": resistance(last),
        "copper_resistance": copper,
        "commutation_resistance": resistance(last) - 2.0 * DRIVE.switch_resistance - copper,
    }
    figures = made["parameters"]
    assert not made["withheld"]
    assert {name: holds(figures[name], truth) for name, truth in truths.items()} == dict.fromkeys(truths, True)
    assert figures["line_emf_constant"]["value"] == pytest.approx(EMF, rel=2e-3)
    low, high = figures["line_emf_constant"]["coverage_interval"]
    assert high - low < 0.015 * EMF
    assert any(row["source"].startswith("oscilloscope") for row in figures["copper_resistance"]["budget"])
    assert {"commutation_resistance_slope", "commutation_resistance_offset"} <= set(figures)


def test_a_regulated_voltage_withholds_what_has_the_leads_in_it(tmp_path):
    captures = [wave(tmp_path, state, f"{k}.csv") for k, state in enumerate(STATES)]
    rows = [[DRIVE.source_voltage, *row[1:]] for row in rows_of()]
    path = table(tmp_path, rows)
    made = analyze_six_step_loads(path, captures, pole_pairs=4, winding=WINDING)
    assert made["withheld"].keys() == {"equivalent_resistance", "switch_resistance"}
    assert holds(made["parameters"]["line_emf_constant"], EMF)
    leads = TypedEmf(leads=DRIVE.source_resistance)
    made = analyze_six_step_loads(path, captures, pole_pairs=4, winding=WINDING, emf=leads)
    assert holds(made["parameters"]["equivalent_resistance"], resistance(STATES[-1]))
    assert holds(made["parameters"]["switch_resistance"], DRIVE.switch_resistance)


def test_a_probe_of_another_factor_is_named(tmp_path):
    captures = [wave(tmp_path, state, f"{k}.csv") for k, state in enumerate(STATES)]
    made = analyze_six_step_loads(table(tmp_path), captures, pole_pairs=4, winding=WINDING, scale={"CH1": 10.0})
    assert {row["cause"] for row in made["misfit"]} >= {"probe-factor"}
    assert "equivalent_resistance" in made["withheld"]


def test_a_table_alone_tells_no_resistance(tmp_path):
    made = analyze_six_step_loads(table(tmp_path))
    assert made["withheld"]["equivalent_resistance"]["cause"] == "no-waveform"
    assert not made["parameters"]


def test_a_flux_linkage_stands_for_the_emf_constant(tmp_path):
    flux = EMF / (3.0 / math.pi * math.sqrt(3.0) * 4)
    made = analyze_six_step_loads(table(tmp_path), pole_pairs=4, emf=TypedEmf(flux_linkage=flux))
    assert holds(made["parameters"]["equivalent_resistance"], resistance(STATES[-1]))
    assert [w["id"] for w in made["warnings"]] == ["unstated-uncertainty"]


@pytest.mark.parametrize(
    ("row", "column", "wrong"), [(1, 0, 26.34), (2, 2, 2350.0), (3, 1, 1.125), (3, 2, 3280.0), (0, 0, 240.3)]
)
def test_a_mistyped_row_is_left_out(tmp_path, row, column, wrong):
    rows = rows_of()
    rows[row][column] = wrong
    made = analyze_six_step_loads(table(tmp_path, rows), emf=KNOWN)
    assert [p["row"] for p in made["details"]["points"] if p["left_out"]] == [row + 1]
    assert holds(made["parameters"]["equivalent_resistance"], resistance(STATES[-1]))


def test_what_no_drive_has_is_withheld(tmp_path):
    for name, change in {
        "chopped": lambda v, i, n, m, t: [v / 0.7, 0.7 * i, n, m, t],
        "half of the marks": lambda v, i, n, m, t: [v, i, 2.0 * n, m, t],
        "twice the marks": lambda v, i, n, m, t: [v, i, 0.5 * n, m, t],
    }.items():
        made = analyze_six_step_loads(table(tmp_path, [change(*row) for row in rows_of()]), emf=KNOWN)
        assert made["withheld"].keys() == {"equivalent_resistance"}, name
        assert any("marks a turn" in row["message"] for row in made["misfit"]), name


def test_a_frequency_shows_the_tachometers_factor(tmp_path):
    rows = [[*row[:2], 0.5 * row[2], *row[3:], 4.0 * row[2] / 60.0] for row in rows_of()]
    path = table(tmp_path, rows, "U (V),I (A),n (rpm),M (Nm),Tw (°C),f (Hz)")
    made = analyze_six_step_loads(path, emf=KNOWN, pole_pairs=4)
    assert made["withheld"]["equivalent_resistance"]["cause"] == "speed-differs"


def test_a_regulated_voltage_asks_for_the_leads(tmp_path):
    rows = [[DRIVE.source_voltage, *row[1:]] for row in rows_of()]
    asked = analyze_six_step_loads(table(tmp_path, rows), emf=KNOWN)
    assert asked["withheld"]["equivalent_resistance"]["cause"] == "voltage-at-supply"
    made = analyze_six_step_loads(table(tmp_path, rows), emf=replace(KNOWN, leads=DRIVE.source_resistance))
    assert made["parameters"]["equivalent_resistance"]["value"] == pytest.approx(resistance(STATES[-1]), rel=5e-3)


@pytest.mark.parametrize(
    ("change", "typed", "error", "said"),
    [
        (lambda row: [*row[:4]], {}, UsageError, "--temperature-after"),
        (lambda row: [*row[:4], math.nan], {"temperature": 25.0}, UsageError, "5 rows have no winding temperature"),
        (lambda row: [*row[:4], 400.0], {}, InputError, "winding temperatures"),
        (lambda row: [row[0], 0.0, *row[2:]], {}, InputError, "row 1 has a current of 0"),
        (lambda row: [row[0], math.nan, *row[2:]], {}, InputError, "row 1 has no current"),
    ],
)
def test_refusals(tmp_path, change, typed, error, said):
    rows = [change(row) for row in rows_of()]
    heading = ",".join(["U (V)", "I (A)", "n (rpm)", "M (Nm)", "Tw (°C)"][: len(rows[0])])
    with pytest.raises(error, match=said):
        analyze_six_step_loads(table(tmp_path, rows, heading), emf=KNOWN, **typed)


def test_captures_need_their_rows_and_the_winding(tmp_path):
    captures = [wave(tmp_path, state, f"{k}.csv") for k, state in enumerate(STATES[:4])]
    with pytest.raises(UsageError, match="5 rows, and 4 captures"):
        analyze_six_step_loads(table(tmp_path), captures, winding=WINDING)
    with pytest.raises(UsageError, match="--winding-resistance"):
        analyze_six_step_loads(table(tmp_path, rows_of(STATES[:4])), captures)


def test_temperatures_between_two_that_are_typed(tmp_path):
    rows = [row[:4] for row in rows_of()]
    path = table(tmp_path, rows, "U (V),I (A),n (rpm),M (Nm)")
    made = analyze_six_step_loads(path, emf=KNOWN, temperature=20.0, temperature_after=60.0)
    assert {p["winding_temperature"] for p in made["details"]["points"]} == {40.0}
    assert holds(made["parameters"]["equivalent_resistance"], resistance(STATES[-1]))


def test_the_command(tmp_path, call: Call):
    path = str(table(tmp_path))
    assert call("analyze", "six-step-loads", path)[0] == 1
    typed = ("--line-emf-constant", f"{EMF:.6g}", "--emf-uncertainty", "1e-4", "--commutation-angle", "1")
    code, out, _ = call("analyze", "six-step-loads", path, *typed, "--budget", "--accuracy", "voltage=0.1%")
    assert code == 0
    assert "Armature equivalent resistance" in out
    assert "angle of commutation" in out
    for wrong in (
        ("--commutation-angle", "90"),
        ("--emf-uncertainty", "0.1"),
        ("--line-emf-constant", "0"),
        ("--winding-resistance", "-1"),
        ("--temperature", "400"),
        ("--line-emf-constant", "0.05", "--flux-linkage", "0.01"),
    ):
        code, _, err = call("analyze", "six-step-loads", path, *wrong)
        assert code == 2
        assert wrong[0] in err
