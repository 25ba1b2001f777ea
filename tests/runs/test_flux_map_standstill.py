"""The flux map at standstill: strokes of a motor on a known map, through the inverter's and the oscilloscope's own drivers."""

from dataclasses import replace

import numpy as np
import pytest

from procedures.core.bench import ProcedureError
from sim_instruments.bench import BenchSetting
from sim_instruments.disturbances.bench import Disturbances
from sim_instruments.disturbances.current_loop import CurrentLoop
from tests.runs.flux_bench import errors_of, flux_bench, map_of
from tests.runs.test_flux_map import MAP, PLATE, made_motor

NAME = "flux-map-standstill"
KNOWN = replace(PLATE, expected={"flux_linkage": MAP.flux_linkage})
QUIET = replace(made_motor(), inertia=0.05)


@pytest.mark.slow
def test_it_holds_the_map_of_a_motor_that_saturates():
    with flux_bench(QUIET, KNOWN, seed=3) as bench:
        found = map_of(bench, KNOWN, "locations=16", name=NAME)
        assert bench.world.truth()["shaft_speed"] == pytest.approx(0.0, abs=0.2)
    off, uncertainty = errors_of(found, MAP)
    table = found.findings["tables"]["flux_map.csv"]
    scale = found.findings["full_scale"]
    assert len(table["iq_A"]) >= 14
    assert np.abs(off).max() < 1e-2 * scale
    assert np.all(np.abs(off) <= 3.0 * uncertainty + 1e-12)
    assert found.findings["resistance"] == pytest.approx(0.02, rel=0.05)
    assert found.findings["swing"] < np.radians(2.0)
    assert not found.warnings


@pytest.mark.slow
def test_a_drive_on_600_v_whose_current_sensors_are_noisy():
    plate = replace(KNOWN, rated_voltage=600.0)
    noisy = BenchSetting(disturbances=Disturbances(inverter=CurrentLoop(current_noise=0.1)))
    with flux_bench(QUIET, plate, seed=3, setting=noisy) as bench:
        found = map_of(bench, plate, "locations=12", "lock=true", name=NAME)
    off, uncertainty = errors_of(found, MAP)
    table = found.findings["tables"]["flux_map.csv"]
    assert len(off) >= 10
    assert np.all(np.abs(off) <= 3.0 * uncertainty + 1e-12)
    # Strokes along the d axis have both their ends in the map, not the mean of these.
    assert np.sum(np.hypot(table["id_A"], table["iq_A"]) < 1.0) == 1
    assert np.median(uncertainty) < 0.03 * found.findings["full_scale"]


def test_the_magnets_flux_linkage_is_needed():
    with (
        flux_bench(QUIET, PLATE) as bench,
        pytest.raises(ProcedureError, match="flux linkage of the magnets is not seen"),
    ):
        map_of(bench, PLATE, name=NAME)


@pytest.mark.slow
def test_a_light_rotor_has_a_smaller_map_and_its_limit_named():
    with flux_bench(replace(made_motor(), inertia=2e-5), KNOWN, seed=3) as bench:
        found = map_of(bench, KNOWN, "locations=16", name=NAME)
    (moves,) = (notice for notice in found.warnings if notice.identifier == "rotor-moves")
    assert "swings the rotor by more than 5 electrical degrees" in str(moves.message)


@pytest.mark.slow
def test_a_locked_rotor_may_be_as_light_as_it_likes():
    with flux_bench(replace(made_motor(), inertia=2e-5), KNOWN, seed=3) as bench:
        found = map_of(bench, KNOWN, "locations=16", "lock=true", name=NAME)
    off, uncertainty = errors_of(found, MAP)
    assert found.findings["swing"] == 0.0
    assert np.abs(off).max() < 2e-2 * found.findings["full_scale"]
    assert np.all(np.abs(off) <= 3.0 * uncertainty + 1e-12)


@pytest.mark.parametrize(
    "module", ["standstill_run._rest", "standstill_run.StrokePlan", "flux_map_standstill.take_strokes"]
)
def test_an_abort_on_the_way_leaves_the_drive_off(module, monkeypatch):
    def aborts(*_, **__):
        raise KeyboardInterrupt

    monkeypatch.setattr(f"procedures.maps.{module}", aborts)
    with flux_bench(QUIET, KNOWN, seed=3) as bench:
        with pytest.raises(KeyboardInterrupt):
            map_of(bench, KNOWN, "locations=12", name=NAME)
        assert not bench.world.inverter.enabled
