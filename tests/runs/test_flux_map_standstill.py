"""The flux map at standstill: strokes of a motor on a known map, through the inverter's and the oscilloscope's own drivers."""

from dataclasses import replace

import numpy as np
import pytest

from drivers.interfaces.errors import LimitError
from drivers.mjbots.inverter import MjbotsMoteus
from procedures.core.bench import ProcedureError
from procedures.maps import standstill_run
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
    # No resistance was measured before, so that nothing tells the drive's current.
    assert [each.identifier for each in found.warnings] == ["current-not-checked"]


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


@pytest.mark.slow
@pytest.mark.parametrize("degrees", [-25.0, 15.0])
def test_an_angle_of_the_drive_that_is_far_off_is_named_and_gives_no_map(degrees):
    turned = BenchSetting(disturbances=Disturbances(inverter=CurrentLoop(angle_error=np.radians(degrees))))
    with flux_bench(QUIET, KNOWN, seed=3, setting=turned) as bench:
        found = map_of(bench, KNOWN, "locations=12", "lock=true", name=NAME)
    (notice,) = found.warnings
    assert notice.identifier == "no-map"
    assert "Calibrate the drive's angle" in str(notice.message)
    assert not found.parameters


def test_the_magnets_flux_linkage_is_needed():
    with (
        flux_bench(QUIET, PLATE) as bench,
        pytest.raises(ProcedureError, match="flux linkage of the magnets cannot be measured"),
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


#: Where a Ctrl-C may strike: at each step's beginning, at each call of the bench, and between them.
PLACES = (
    "flux_map_standstill.known_pole_pairs",
    "flux_map_standstill.phases_on",
    "flux_map_standstill.grid_locations",
    "flux_map_standstill.StrokeRecorder",
    "flux_map_standstill.take_strokes",
    "standstill_run.StrokePlan",
    "standstill_run._rest",
    pytest.param("flux_map_standstill.fit_standstill", marks=pytest.mark.slow),
    "flux_map_standstill.report_mtpa",
)


@pytest.mark.parametrize("place", PLACES)
def test_an_abort_anywhere_leaves_the_drive_off(place, monkeypatch):
    struck = []

    def aborts(*_, **__):
        struck.append(place)
        raise KeyboardInterrupt

    monkeypatch.setattr(f"procedures.maps.{place}", aborts)
    with flux_bench(QUIET, KNOWN, seed=3) as bench:
        with pytest.raises(KeyboardInterrupt):
            map_of(bench, KNOWN, "locations=12", "lock=true", name=NAME)
        assert struck == [place]
        assert not bench.world.inverter.enabled


@pytest.mark.parametrize("method", ["alternate_dq_current", "measure_dq"])
@pytest.mark.parametrize("call", [1, 3])
def test_an_abort_in_a_call_of_the_drive_leaves_it_off(method, call, monkeypatch):
    asked = getattr(MjbotsMoteus, method)
    calls = []

    def aborts(self, *given):
        calls.append(method)
        if len(calls) == call:
            raise KeyboardInterrupt
        return asked(self, *given)

    monkeypatch.setattr(MjbotsMoteus, method, aborts)
    with flux_bench(QUIET, KNOWN, seed=3) as bench:
        with pytest.raises(KeyboardInterrupt):
            map_of(bench, KNOWN, "locations=12", "lock=true", name=NAME)
        assert not bench.world.inverter.enabled


def test_a_limit_on_the_way_leaves_the_map_of_what_was_taken(monkeypatch):
    rest, calls = standstill_run._rest, []

    def stops(*given):
        calls.append(given)
        if len(calls) == 16:
            raise LimitError("inverter", "temperature", 91.0, "°C", 90.0, "the drive")
        rest(*given)

    monkeypatch.setattr(standstill_run, "_rest", stops)
    with flux_bench(QUIET, KNOWN, seed=3) as bench:
        found = map_of(bench, KNOWN, "locations=20", "lock=true", name=NAME)
        assert not bench.world.inverter.enabled
    (ended,) = (notice for notice in found.warnings if notice.identifier == "ended-early")
    assert "temperature = 91 °C is beyond 90 °C" in str(ended.message)
    off, uncertainty = errors_of(found, MAP)
    assert 8 <= len(off) < 20
    assert np.all(np.abs(off) <= 3.0 * uncertainty + 1e-12)
