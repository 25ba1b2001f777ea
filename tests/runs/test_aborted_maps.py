"""A flux map whose run is aborted, or that an error ends: what was taken until then is a smaller map in the run's folder."""

from pathlib import Path

import numpy as np
import pytest

from bench.analysis.load_tables import analyze_run_map
from bench.i18n.errors import InputError
from bench.journal.finished_run import read_run
from bench.journal.run_folder import RunFolder
from bench.journal.run_tables import table_content, tables_of
from bench.journal.verification import Integrity
from bench.journal.verify import verify
from bench.motor.motor_file import load_motor
from bench.report.files import rendered, write_page
from drivers.interfaces.errors import CommunicationError
from drivers.mjbots.inverter import MjbotsMoteus
from procedures.maps import flux_map, flux_map_standstill

MOTOR = Path(__file__).parents[2] / "bench" / "motors" / "ipmsm-map.toml"
EXPECTED = "[expected]\nflux_linkage = 0.01605\npole_pairs = 4\n\n[virtual]"


@pytest.fixture
def motor(tmp_path):
    """A motor on a known map, of which enough is expected that no procedure has to run before."""
    for file in (MOTOR, MOTOR.with_suffix(".csv")):
        (tmp_path / file.name).write_text(file.read_text().replace("[virtual]", EXPECTED, 1))
    return tmp_path / MOTOR.name


def strikes(monkeypatch, owner, name, at, error):
    """Have the call number `at` of a function end in an error."""
    asked, calls = getattr(owner, name), []

    def struck(*given, **named):
        calls.append(name)
        if len(calls) == at:
            raise error
        return asked(*given, **named)

    monkeypatch.setattr(owner, name, struck)
    return calls


def run_of(motorbench, motor, tmp_path, name, *settings):
    status, result = motorbench(
        "run", name, "--station", "virtual", "--operator", "virtual", "--motor", str(motor),
        *(part for setting in settings for part in ("--set", f"{name}.{setting}")),
    )  # fmt: skip
    (folder,) = (tmp_path / "runs").iterdir()
    return status, result, folder


def off_by(folder, motor):
    """Return by how much a folder's map is off the motor's (n, 2), with its uncertainties, and its full scale (V·s)."""
    table = np.genfromtxt(folder / "flux_map.csv", delimiter=",", names=True)
    truth = load_motor(str(motor)).virtual.flux_map
    true = np.column_stack(truth.flux(table["id_A"], table["iq_A"]))
    found = np.column_stack((table["psi_d_Vs"], table["psi_q_Vs"]))
    return found - true, np.column_stack((table["u_psi_d_Vs"], table["u_psi_q_Vs"])), np.abs(true).max()


STANDSTILL = ("locations=16", "lock=true")
ROTATION = ("locations=20",)
PLACES = (
    ("flux-map-standstill", STANDSTILL, MjbotsMoteus, "alternate_dq_current", 20),
    ("flux-map-standstill", STANDSTILL, MjbotsMoteus, "alternate_dq_current", 22),
    ("flux-map-standstill", STANDSTILL, flux_map_standstill, "fit_standstill", 1),
    ("flux-map-standstill", STANDSTILL, flux_map_standstill, "report_mtpa", 1),
    ("flux-map", ROTATION, MjbotsMoteus, "measure_dq", 24),
    ("flux-map", ROTATION, MjbotsMoteus, "set_dq_current", 34),
    ("flux-map", ROTATION, flux_map, "about_mtpa", 1),
    ("flux-map", ROTATION, flux_map, "report_mtpa", 1),
)


@pytest.mark.slow
@pytest.mark.parametrize(("name", "settings", "owner", "function", "at"), PLACES)
def test_an_abort_leaves_the_map_of_what_was_taken(
    motorbench, motor, tmp_path, monkeypatch, name, settings, owner, function, at
):
    calls = strikes(monkeypatch, owner, function, at, KeyboardInterrupt())
    status, result, folder = run_of(motorbench, motor, tmp_path, name, *settings)
    assert len(calls) >= at
    assert status == 1
    assert result["status"] == "aborted"
    left = result["procedures"][name]
    assert left["status"] == "failed"
    (ended,) = (warning for warning in left["warnings"] if warning["id"] == "ended-early")
    assert "interrupted. The map is of these" in ended["message"]
    off, uncertainty, scale = off_by(folder, motor)
    assert 8 <= len(off) <= left["findings"]["locations"]
    assert np.all(np.abs(off) <= 3.0 * uncertainty + 1e-12)
    assert np.abs(off).max() < 0.03 * scale
    assert verify(RunFolder(folder)).verdict is Integrity.UNTOUCHED
    # It is measured again where the run goes on.
    assert name not in read_run(folder, tmp_path).view.finished
    page = write_page(rendered(read_run(folder, tmp_path), "en"), folder, "en").read_text()
    assert "The map is of these" in page
    assert "Flux linkage" in page


@pytest.mark.slow
def test_strokes_of_a_run_that_was_killed_make_a_map(motorbench, motor, tmp_path):
    status, _, folder = run_of(motorbench, motor, tmp_path, "flux-map-standstill", *STANDSTILL)
    assert status == 0
    _, table = analyze_run_map(folder)
    whole = np.genfromtxt(folder / "flux_map.csv", delimiter=",", names=True)
    for name, column in table.items():
        assert column == pytest.approx(whole[name], rel=1e-6, abs=1e-12)
    # A run that was killed has a journal that ends in the middle of a line, and records that it did not come to note.
    lines = (folder / "journal.jsonl").read_bytes().splitlines(keepends=True)
    kept = [k for k, line in enumerate(lines) if b'"kind":"strokes_kept"' in line]
    killed = tmp_path / "killed"
    killed.mkdir()
    (killed / "waveforms").symlink_to(folder / "waveforms")
    (killed / "journal.jsonl").write_bytes(b"".join(lines[: kept[-4] + 2]) + lines[kept[-4] + 2][:20])
    part, fewer = analyze_run_map(killed, pole_pairs=4)
    (killed / "flux_map.csv").write_text(table_content(fewer))
    off, uncertainty, scale = off_by(killed, motor)
    assert part["details"]["trains"] == len(kept) - 3
    assert 8 <= len(off) < len(table["id_A"])
    assert np.all(np.abs(off) <= 3.0 * uncertainty + 1e-12)
    assert np.abs(off).max() < 0.03 * scale
    (killed / "waveforms").unlink()
    with pytest.raises(InputError, match="no whole record of the strokes"):
        analyze_run_map(killed)
    (killed / "journal.jsonl").write_bytes(b"".join(lines[: kept[0]]))
    with pytest.raises(InputError, match="no readings of flux-map"):
        analyze_run_map(killed)


def test_an_error_leaves_the_map_of_what_was_taken(motorbench, motor, tmp_path, monkeypatch):
    strikes(monkeypatch, MjbotsMoteus, "measure_dq", 24, CommunicationError("inverter", "no reply"))
    status, result, folder = run_of(motorbench, motor, tmp_path, "flux-map", *ROTATION)
    assert status == 1
    assert result["status"] == "failed"
    off, uncertainty, _ = off_by(folder, motor)
    assert len(off) >= 8
    assert np.all(np.abs(off) <= 3.0 * uncertainty + 1e-12)
    assert result["parameters"]["map_flux_linkage"]["procedure"] == "flux-map"


@pytest.mark.parametrize(
    ("name", "function", "at", "why"),
    [
        ("flux-map", "measure_dq", 6, "give no result"),
        pytest.param(*("flux-map-standstill", "alternate_dq_current", 12, "there is no map"), marks=pytest.mark.slow),
    ],
)
def test_too_little_is_said_to_be_no_map(motorbench, motor, tmp_path, monkeypatch, name, function, at, why):
    strikes(monkeypatch, MjbotsMoteus, function, at, KeyboardInterrupt())
    _, result, folder = run_of(motorbench, motor, tmp_path, name, *(STANDSTILL if "stand" in name else ROTATION))
    told = [result["cause"], *(warning["message"] for warning in result["warnings"])]
    assert sum(why in each for each in told) == 1, told
    assert not (folder / "flux_map.csv").exists()


def test_two_maps_of_a_run_have_a_file_each():
    result = {
        "procedures": {
            "flux-map-standstill": {"findings": {"tables": {"flux_map.csv": {"id_A": [1.0]}}}},
            "flux-map": {"findings": {"tables": {"flux_map.csv": {"id_A": [2.0]}}}},
        }
    }
    assert dict(tables_of(result)) == {
        "flux_map-flux-map-standstill.csv": b"id_A\n1.0\n",
        "flux_map.csv": b"id_A\n2.0\n",
    }
