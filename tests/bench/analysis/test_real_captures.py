from pathlib import Path

import numpy as np
import pytest

from bench.analysis import analyze_back_emf
from bench.analysis.statements import read_statements
from bench.captures import read_captures
from procedures.estimation.emf.back_emf import fit_back_emf
from procedures.estimation.emf.integrated_flux import flux_by_integration


def _folder() -> Path:
    for parent in Path(__file__).resolve().parents:
        if parent.name == "tests":
            return parent.parent.parent / "shared" / "data" / "vdyno_trampa6340"
    raise AssertionError("this file lies under no folder 'tests'")


FOLDER = _folder()
pytestmark = pytest.mark.skipif(
    not FOLDER.is_dir(), reason="the V-Dyno captures are not beside the repository (shared/data)"
)
RTB = [FOLDER / f"0500rpm1_CHAN{k}.csv.gz" for k in (1, 2, 3)]
TEKTRONIX = [FOLDER / "YellowA0001CH1.CSV", FOLDER / "RedA0001CH2.CSV"]


def test_rohde_schwarz_record_of_500_rpm() -> None:
    found = analyze_back_emf(RTB, scale={"CHAN3": 10}, pole_pairs=7, connection="phase")
    details = found["details"]
    assert details["mechanical_speed_rpm"] == pytest.approx(499.7, abs=0.1)
    channels = details["channels"].values()
    assert [c["fundamental"]["value"] for c in channels] == pytest.approx([2.0, 2.0, 2.0], abs=0.03)
    assert [c["phase_degrees"]["value"] for c in channels] == pytest.approx([0, -120, 120], abs=1.0)
    assert all(2.0 < c["harmonics_percent"]["5"] < 5.0 for c in channels)
    assert found["parameters"]["flux_linkage"]["value"] == pytest.approx(5.4350e-3, rel=1e-4)
    assert found["withheld"] == {}
    low, high = found["parameters"]["flux_linkage"]["coverage_interval"]
    assert low < details["flux_linkage_least_squares"]["value"] < high
    assert not any("differ by more than" in w["text"] for w in found["warnings"])


@pytest.mark.slow
def test_rohde_schwarz_record_with_the_probe_factor_forgotten() -> None:
    found = analyze_back_emf(RTB, pole_pairs=7)
    assert set(found["parameters"]) == {"electrical_frequency"}
    withheld = found["withheld"]["flux_linkage"]
    assert withheld["cause"] == "probe-factor"
    assert "channel C3" in withheld["message"]
    assert "--scale C3=10;" in withheld["message"]


def test_tektronix_record_of_a_hand_drill() -> None:
    capture = read_captures(TEKTRONIX).evenly_sampled()
    assert [c.name for c in capture.channels] == ["CH1", "CH2"]
    assert [c.resolution for c in capture.channels] == pytest.approx([0.04, 0.04])
    time, values = capture.times(), np.vstack([c.values for c in capture.channels])
    fit = fit_back_emf(time, values)
    assert fit.drift_significant
    assert -0.02 < fit.drift < -0.002
    flux = flux_by_integration(time, values)
    assert flux.per_period.shape[1] >= 5
    assert np.all(np.ptp(flux.per_period, axis=1) < 0.01 * flux.values)
    first, second = (flux_by_integration(time[part], values[:, part]) for part in (slice(0, 1250), slice(1250, None)))
    assert first.values == pytest.approx(second.values, rel=5e-3)


@pytest.mark.slow
def test_the_two_ends_of_a_line_on_one_oscilloscope_and_three_phases_on_another_are_one_motor() -> None:
    """Two probes on two terminals, no ground on the motor: each shows half of the line's voltage. Three probes make a star point."""
    found = analyze_back_emf(TEKTRONIX)
    assert {each["cause"] for each in found["withheld"].values()} == {"opposite-channels"}
    assert any("drifts" in w["text"] for w in found["warnings"])
    line = analyze_back_emf(TEKTRONIX, connection="ends")["parameters"]["flux_linkage"]
    assert line["value"] == pytest.approx(5.477e-3, rel=5e-4)
    assert line["estimator"] == "voltage integrated over whole periods"
    limits = read_statements(["voltage=2%"])
    both = [
        analyze_back_emf(files, accuracy=limits, coupling={"": "dc"}, **how)["parameters"]["flux_linkage"]
        for files, how in (
            (TEKTRONIX, {"connection": "ends"}),
            (RTB, {"connection": "phase", "scale": {"CHAN3": 10}}),
        )
    ]
    assert max(each["coverage_interval"][0] for each in both) < min(each["coverage_interval"][1] for each in both)
    unsaid = analyze_back_emf(RTB, scale={"CHAN3": 10})
    assert unsaid["withheld"]["flux_linkage"]["cause"] == "connection-open"
