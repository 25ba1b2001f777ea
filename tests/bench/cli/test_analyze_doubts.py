"""`motorbench analyze` with tables and records that read well and mean something else: each is asked about or refused."""

import math
from collections.abc import Sequence
from pathlib import Path

import numpy as np
import pytest

from bench.analysis import analyze_step_response
from bench.captures import CaptureError
from bench.cli.analyze.maps import efficiency, flux_map, short_circuit
from bench.i18n.errors import InputError

LOADS = [(torque, speed) for torque in (0.1, 0.5, 1.0) for speed in (500.0, 1000.0, 3000.0)]


def power_of(torque: float, speed: float) -> float:
    return torque * speed * math.pi / 30.0 + 2.0 + 0.005 * speed + 4.0 * torque**2


def loads(path: Path, rows: Sequence[Sequence[float]], heading: str = "torque_Nm,speed_rpm,power_W") -> Path:
    lines = [heading, *(",".join(f"{value:.6g}" for value in row) for row in rows)]
    path.write_text("\n".join(lines) + "\n", encoding="utf-8")
    return path


def test_thousands_beside_decimal_commas_are_refused_with_their_cell(tmp_path: Path) -> None:
    path = tmp_path / "load.csv"
    path.write_text("torque_Nm;speed_rpm;power_W\n1,0;500;70\n1,0;1.000;130\n", encoding="utf-8")
    with pytest.raises(InputError, match=r"line 3, column speed_rpm: '1\.000' may mean 1000 or 1, .* '1,0'"):
        efficiency(path)
    path.write_text("torque_Nm;speed_rpm;power_W\n1,0;500;70\n1,0;1000;130\n", encoding="utf-8")
    assert efficiency(path) == 0


@pytest.mark.parametrize(
    ("rows", "words"),
    [
        ([(t, n * math.pi / 30.0, power_of(t, n)) for t, n in LOADS], "rad/s under a heading in rpm makes it 9.549 times"),
        ([(t, n, t * n * math.pi / 30.0) for t, n in LOADS], "input and output power are equal at every point"),
        ([(t, n, power_of(t, n) * (10.0 if k == 5 else 1.0)) for k, (t, n) in enumerate(LOADS)], "rows 0.5 N·m, 314.2 rad/s do not follow"),
        ([(n, t, power_of(t, n)) for t, n in LOADS], "are the columns of torque and speed interchanged"),
    ],
)  # fmt: skip
def test_load_points_that_no_motor_has_are_asked_about(
    rows: Sequence[Sequence[float]], words: str, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    efficiency(loads(tmp_path / "load.csv", rows))
    assert words in " ".join(capsys.readouterr().out.split())


def test_right_load_points_bear_no_doubt_and_no_interval_of_nothing(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    path = loads(tmp_path / "load.csv", [(t, n, power_of(t, n)) for t, n in LOADS])
    efficiency(path)
    shown = " ".join(capsys.readouterr().out.split())
    assert "±" not in shown
    assert "Warnings" not in shown
    assert "errors of torque, speed, power are not stated and therefore not included" in shown
    efficiency(path, torque_gain=0.2, speed_gain=0.1, power_gain=0.2)
    shown = capsys.readouterr().out
    assert "±" in shown
    assert "not included" not in shown


def test_peak_values_are_said_where_nothing_shows_rms(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    grid = [(float(d), float(q)) for d in range(-8, 9, 4) for q in range(-8, 9, 4)]
    path = loads(
        tmp_path / "map.csv", [(d, q, 0.05 + 1e-3 * d, 2e-3 * q) for d, q in grid], "id_A,iq_A,psi_d_Vs,psi_q_Vs"
    )
    flux_map(path)
    assert "taken as peak values" in " ".join(capsys.readouterr().out.split())
    rows = [(w * 7.5 / math.pi, 0.3 * w / math.hypot(0.5, w * 0.01)) for w in (20.0, 50.0, 100.0, 200.0, 500.0, 2000.0)]
    path = loads(tmp_path / "short.csv", rows, "speed_rpm,current_A")
    for rms, words in ((False, "currents are taken as peak values"), (True, "currents are rms, as --rms says")):
        short_circuit(path, pole_pairs=4.0, flux_linkage=0.3, rms=rms)
        assert words in " ".join(capsys.readouterr().out.split())


def test_exchanged_columns_of_a_step_are_named(tmp_path: Path) -> None:
    random = np.random.default_rng(4)
    time = np.linspace(-0.002, 0.008, 2001)
    volts = np.where(time > 0.0, 2.0, 0.0) + random.normal(0.0, 0.004, time.size)
    amperes = 4.0 * -np.expm1(-np.maximum(time, 0.0) / 1e-3) + random.normal(0.0, 0.004, time.size)
    rows = np.column_stack((time, amperes, volts)).tolist()
    path = loads(tmp_path / "step.csv", rows, "time (s),CH1 (V),CH2 (A)")
    with pytest.raises(
        CaptureError, match=r"Interchanged they do \(0\.5 Ω, 0\.0005 H.*are the two columns interchanged"
    ):
        analyze_step_response(path)
