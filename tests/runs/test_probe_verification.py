"""Verification of the probes: gains that later measurements are corrected by, within what the reference states."""

from dataclasses import replace

import pytest

from bench.cli.main import main
from bench.motor.motor_file import load_motor
from procedures.core.bench import ProcedureError
from procedures.end_of_line.probe_verification import ranges_for
from sim_instruments.bench import BenchSetting, VirtualBench
from sim_instruments.disturbances.bench import Disturbances
from sim_instruments.disturbances.channel import ChannelPath
from sim_instruments.instruments.errors import Errors, ScopeErrors
from tests.runs.on_bench import measure, within

FILE = load_motor("lg-400w")
GAINS = (0.006, -0.008, 0.002, -0.005)
UNIT = replace(Errors(), oscilloscope=ScopeErrors(gain=GAINS, reference=0.01))


def verified(errors=UNIT, disturbances=None, *settings):
    setting = BenchSetting(disturbances=disturbances or Disturbances())
    with VirtualBench(FILE.virtual_motor(), seed=3, sockets=False, errors=errors, setting=setting) as bench:
        result = measure(bench, FILE.nameplate, "probe-verification", *settings)
        assert not bench.world.truth()["output_on"]
        return result, {parameter.name: parameter for parameter in result.parameters}


def test_every_channels_gain_is_found_in_every_range():
    result, found = verified()
    for channel, gain in enumerate(GAINS, 1):
        assert within(found[f"channel_{channel}_gain"], 1.01 + gain)
    off = [
        abs(row["gain"] / (1.01 + GAINS[row["channel"] - 1]) - 1.0) / row["limit"] for row in result.findings["gains"]
    ]
    assert max(off) < 1.6
    assert sum(each <= 1.0 for each in off) >= 0.9 * len(off)
    assert max(found[f"channel_{channel}_gain"].standard_uncertainty for channel in (1, 2, 3)) < 5e-4
    assert found["channel_4_gain"].standard_uncertainty < 3e-3


@pytest.mark.parametrize(("volts", "widest"), [(None, 40.0), (14.8, 40.0), (24.0, 80.0), (48.0, 160.0), (320.0, 800.0)])
def test_the_ranges_reach_to_what_the_nameplates_voltage_takes(volts, widest):
    ranges = ranges_for(volts)
    assert (ranges[0], ranges[-1]) == (0.08, widest)
    assert sorted(ranges) == list(ranges)


def test_a_24_v_motor_has_wider_ranges_verified_than_any_motor():
    plate = replace(FILE.nameplate, rated_voltage=24.0, maximum_voltage=None)
    with VirtualBench(FILE.virtual_motor(), seed=3, sockets=False, errors=UNIT) as bench:
        result = measure(bench, plate, "probe-verification", "current_ranges=[]", "record_time=0.02", "settle=0.02")
    assert max(row["range"] for row in result.findings["gains"]) == 80.0


@pytest.mark.slow
def test_a_48_v_motors_back_emf_is_known_as_well_as_the_verification_and_without_its_ranges_that_is_said(motorbench):
    arguments = ("run", "probe-verification", "back-emf-constant", "--station", "virtual", "--motor", "ipmsm")
    _, whole = motorbench(*arguments)
    assert not [warning for warning in whole["warnings"] if warning["id"] == "range-not-verified"]
    flux = whole["parameters"]["flux_linkage"]
    assert flux["standard_uncertainty"] < 2e-3 * flux["value"]
    _, short = motorbench(*arguments, "--set", "voltage_ranges=[16.0, 40.0]")
    (said,) = [warning for warning in short["warnings"] if warning["id"] == "range-not-verified"]
    assert said["procedure"] == "back-emf-constant"
    assert "holds at 16 … 40 V full scale" in said["message"]
    assert short["parameters"]["flux_linkage"]["standard_uncertainty"] > 5.0 * flux["standard_uncertainty"]


def test_a_wrong_factor_is_no_gain():
    with pytest.raises(ProcedureError, match=r"channel 2 shows 0\.10"):
        verified(UNIT, Disturbances({2: ChannelPath(factor=0.1)}))


def test_ranges_that_nothing_fills_are_refused():
    with pytest.raises(ProcedureError, match="fill none of the ranges"):
        verified(UNIT, None, "voltage_ranges=[400.0]", "current_ranges=[400.0]")


@pytest.mark.slow
def test_what_follows_is_corrected_in_this_run_and_in_another(motorbench, tmp_path, capsys):
    arguments = ("run", "back-emf-constant", "--station", "virtual", "--motor", "lg-400w")
    _, both = motorbench(arguments[0], "probe-verification", *arguments[1:])
    flux, truth = both["parameters"]["flux_linkage"], FILE.virtual_motor().flux_linkage_y
    assert flux["standard_uncertainty"] < 2e-3 * flux["value"]
    assert flux["coverage_interval"][0] <= truth <= flux["coverage_interval"][1]
    assert any("verified on this bench; voltmeter" in row["source"] for row in flux["budget"])
    _, later = motorbench(*arguments, "--probe-verification", both["run"])
    assert later["parameters"]["flux_linkage"]["standard_uncertainty"] == pytest.approx(
        flux["standard_uncertainty"], rel=0.05
    )
    assert later["probe_verification"] == both["run"]
    _, without = motorbench(*arguments)
    assert without["parameters"]["flux_linkage"]["standard_uncertainty"] > 5.0 * flux["standard_uncertainty"]
    with pytest.raises(SystemExit) as stopped:
        main([*arguments, "--probe-verification", without["run"], "--runs", str(tmp_path / "runs")])
    assert stopped.value.code == 1
    assert "no finished Verification of the probes" in capsys.readouterr().err
