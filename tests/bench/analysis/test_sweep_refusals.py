"""Sweeps that tell no saliency, or nothing: no figure, or one with the truth in its interval."""

from pathlib import Path

import numpy as np
import pytest

from bench.analysis import analyze_rotor_sweep
from bench.i18n.errors import InputError

#: A motor with four pole pairs, read between two lines (H), at angles (degrees).
MEAN, SWING, PAIRS = 65e-6, 15e-6, 4


def sweep(folder: Path, steps: float, swing: float = SWING) -> Path:
    angle = np.arange(0.0, 360.0 + 0.5 * steps, steps)
    noise = np.random.default_rng(3).normal(0.0, 0.2e-6, angle.size)
    readings = 2.0 * (MEAN - swing * np.cos(2 * PAIRS * np.radians(angle) + 0.4)) + noise
    path = folder / "sweep.csv"
    np.savetxt(path, np.column_stack((angle, 1e6 * readings)), delimiter=",", header="angle (deg),L (uH)", comments="")
    return path


@pytest.mark.parametrize("steps", [40.0, 45.0])
def test_angles_too_far_apart_for_usual_pole_pairs_give_no_figure(tmp_path: Path, steps: float) -> None:
    found = analyze_rotor_sweep(sweep(tmp_path, steps))
    assert not found["parameters"]
    assert {row["cause"] for row in found["withheld"].values()} == {"pole-pairs-open"}
    assert "give --pole-pairs" in found["withheld"]["d_axis_inductance"]["message"]


def test_close_angles_show_no_saliency_without_pole_pairs(tmp_path: Path) -> None:
    found = analyze_rotor_sweep(sweep(tmp_path, 5.0, swing=0.0))
    low, high = found["parameters"]["q_axis_inductance"]["coverage_interval"]
    assert low <= MEAN <= high
    assert any("the pole pairs were not given" in warning["text"] for warning in found["warnings"])


@pytest.mark.parametrize(("reading", "said"), [(100.0, "all 72 readings are 0.0001 H"), (0.0, "above zero")])
def test_readings_that_are_all_one_are_refused_as_that(tmp_path: Path, reading: float, said: str) -> None:
    path = tmp_path / "flat.csv"
    path.write_text("angle (deg),L (uH)\n" + "".join(f"{5 * k},{reading}\n" for k in range(72)), encoding="utf-8")
    with pytest.raises(InputError, match=said):
        analyze_rotor_sweep(path, pole_pairs=PAIRS)


def test_a_meter_that_shows_one_of_two_steps_has_a_figure(tmp_path: Path) -> None:
    path = tmp_path / "steps.csv"
    up = np.random.default_rng(5).random(72) < 0.5
    path.write_text("angle (deg),L (uH)\n" + "".join(f"{5 * k},{129 + int(u) * 2}\n" for k, u in enumerate(up)))
    found = analyze_rotor_sweep(path, pole_pairs=PAIRS)
    low, high = found["parameters"]["d_axis_inductance"]["coverage_interval"]
    assert low <= MEAN <= high


@pytest.mark.parametrize(
    ("heading", "encoding"),
    [
        ("No.,angle (deg),Ls (uH),Q", "utf-8"),
        ("No.,angle [°],Ls [µH],Q", "latin-1"),
        ("No.,Winkel [°],Induktivität [µH],Güte", "latin-1"),
        ("序号,角度 (°),电感 (uH),品质因数", "gb2312"),
        ("序号,角度 (°),电感 (μH),品质因数", "gb2312"),
    ],
)
def test_a_meters_table_in_its_countrys_encoding_has_its_inductance_found_by_the_unit(
    tmp_path: Path, heading: str, encoding: str
) -> None:
    rows = sweep(tmp_path, 5.0).read_text(encoding="ascii").splitlines()[1:]
    path = tmp_path / "meter.csv"
    path.write_bytes("\n".join([heading, *(f"{k},{row},1.2" for k, row in enumerate(rows))]).encode(encoding))
    found = analyze_rotor_sweep(path, pole_pairs=PAIRS)
    low, high = found["parameters"]["d_axis_inductance"]["coverage_interval"]
    assert low <= MEAN - SWING <= high
    path.write_text("L1 (uH),L2 (uH),angle (deg)\n" + "".join(f"1,2,{5 * k}\n" for k in range(72)))
    with pytest.raises(InputError, match=r"several of the columns could be the inductance: .*L2"):
        analyze_rotor_sweep(path)


@pytest.mark.parametrize(("heading", "kind"), [("electrical angle (deg)", "electrical"), ("angle (deg)", "mechanical")])
def test_the_heading_says_that_the_angle_is_electrical(tmp_path: Path, heading: str, kind: str) -> None:
    angle = np.arange(0.0, 360.0, 5.0)
    periods = 1 if kind == "electrical" else 4
    table = np.column_stack((angle, 1.0 + 0.2 * np.cos(2.0 * periods * np.radians(angle))))
    path = tmp_path / "sweep.csv"
    np.savetxt(path, table, delimiter=",", header=f"{heading},inductance (mH)", comments="")
    found = analyze_rotor_sweep(path, pole_pairs=4)
    assert found["parameters"]["d_axis_inductance"]["value"] == pytest.approx(0.4e-3, rel=1e-6)
    assert f"angle is {kind}" in found["assumptions"]


ANGLE = np.arange(0.0, 361.0, 5.0)
READ = 2.0 * (MEAN - SWING * np.cos(2 * PAIRS * np.radians(ANGLE) + 0.4))
READ += np.random.default_rng(8).normal(0.0, 0.2e-6, ANGLE.size)
LOSS, TURNS = 0.5, 2.0 * np.pi * 1000.0
QUALITY = TURNS * READ / LOSS
IN_PARALLEL = READ * (1.0 + QUALITY**-2)


@pytest.mark.parametrize(
    ("heading", "beside", "frequency"),
    [
        ("Lp (uH),Q", QUALITY, None),
        ("L_p (uH),D", 1.0 / QUALITY, None),
        ("Lp (uH),Rp (Ohm)", TURNS * IN_PARALLEL * QUALITY, 1000.0),
        ("Lp 1 kHz (uH),Rp (Ohm)", TURNS * IN_PARALLEL * QUALITY, None),
    ],
)
def test_inductances_of_a_parallel_circuit_are_converted(
    heading: str, beside: np.ndarray, frequency: float | None, tmp_path: Path
) -> None:
    path, table = tmp_path / "lp.csv", np.column_stack((ANGLE, 1e6 * IN_PARALLEL, beside))
    np.savetxt(path, table, delimiter=",", header=f"angle (deg),{heading}", comments="")
    found = analyze_rotor_sweep(path, pole_pairs=PAIRS, frequency=frequency)
    for name, truth in (("d_axis_inductance", MEAN - SWING), ("q_axis_inductance", MEAN + SWING)):
        low, high = found["parameters"][name]["coverage_interval"]
        assert low <= truth <= high
    assert "parallel circuit" in str(found["assumptions"])
    np.savetxt(path, table[:, :2], delimiter=",", header=f"angle (deg),{heading.split(',')[0]}", comments="")
    with pytest.raises(InputError, match="Set the meter to Ls"):
        analyze_rotor_sweep(path, pole_pairs=PAIRS)


def test_readings_at_several_frequencies_are_not_one_sweep(tmp_path: Path) -> None:
    path = tmp_path / "long.csv"
    rows = [
        f"{a:g},{f:g},{1e6 * x * k:.2f}" for a, x in zip(ANGLE, READ, strict=True) for f, k in ((20, 1.06), (1000, 1))
    ]
    path.write_text("\n".join(["angle (deg),frequency (Hz),L (uH)", *rows]) + "\n", encoding="utf-8")
    with pytest.raises(InputError, match=r"at 20, 1000 Hz.*--frequency"):
        analyze_rotor_sweep(path, pole_pairs=PAIRS)
    low, high = analyze_rotor_sweep(path, pole_pairs=PAIRS, frequency=1000.0)["parameters"]["q_axis_inductance"][
        "coverage_interval"
    ]
    assert low <= MEAN + SWING <= high
