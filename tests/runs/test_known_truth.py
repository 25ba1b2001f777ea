"""Every procedure on the virtual bench, through the real drivers, finds what the virtual motor is."""

import math

import pytest

SHIPPED = ("lg-400w", "ipmsm", "ipmsm-map", "outrunner-delta", "gimbal", "drone", "92bl-30-25l")
#: In every suite; the others among the slow tests.
QUICK = ("lg-400w", "outrunner-delta")
MEASURED = {
    "pole_pairs",
    "stator_resistance",
    "d_axis_inductance",
    "q_axis_inductance",
    "flux_linkage",
    "back_emf_constant_mechanical",
    "torque_constant",
    "inertia",
    "coulomb_friction",
    "viscous_friction",
}


def completed(motorbench, motor):
    status, given = motorbench("demo", "--motor", motor, "--seed", "7")
    assert status == 0, given.get("cause")
    return given


@pytest.fixture(scope="module")
def demo(motorbench_once):
    return completed(motorbench_once, "lg-400w")


@pytest.mark.parametrize("motor", [pytest.param(m, marks=() if m in QUICK else pytest.mark.slow) for m in SHIPPED])
def test_every_figure_holds_the_truth(motorbench_once, motor):
    given = completed(motorbench_once, motor)
    parameters = given["parameters"]
    assert set(parameters) >= MEASURED
    for name in MEASURED:
        truth = parameters[name]["truth"]
        for figure in (parameters[name], *parameters[name]["alternatives"]):
            allowed = 3.0 * figure["standard_uncertainty"] + 1e-9 * abs(truth)
            assert abs(figure["value"] - truth) <= allowed, (name, figure["procedure"], figure["value"], truth)
    assert "disagreement" not in {w["id"] for w in given["warnings"]}


def test_a_clean_bench_shows_nothing_beyond_the_model(demo):
    assert demo["misfit"] == []
    assert demo["withheld"] == {}


@pytest.mark.slow
def test_two_runs_with_one_seed_give_the_same_figures(demo, motorbench):
    figures = [
        {n: (p["value"], p["standard_uncertainty"]) for n, p in given["parameters"].items()}
        for given in (demo, completed(motorbench, "lg-400w"))
    ]
    assert figures[0] == figures[1]


def test_the_run_warns_of_the_errata_that_apply(demo):
    # The coast is followed down to a fifth of the speed: two points on each ramp then cost next to nothing (E6).
    assert {w["id"] for w in demo["warnings"]} >= {"E1", "E3", "E4", "E9", "E10", "E15"}


@pytest.mark.parametrize(("coast_share", "warned"), [(0.2, False), (0.5, True)])
def test_two_points_are_warned_of_where_the_ramps_cover_different_speeds(motorbench, coast_share, warned):
    _, given = motorbench(
        *("run", "inertia", "--station", "virtual", "--motor", "lg-400w"), *("--set", f"coast_share={coast_share}")
    )
    inertia = given["parameters"]["inertia"]
    assert (abs(inertia["note_value"] / inertia["value"] - 1.0) > 0.01) == warned
    assert ("E6" in {w["id"] for w in given["warnings"]}) == warned
    assert inertia["value"] == pytest.approx(inertia["truth"], rel=0.02)


def test_aligned_bridge_reads_one_and_a_half_times_the_inductance(motorbench):
    _, given = motorbench("run", "dq-inductance-aligned", "--station", "virtual", "--motor", "lg-400w")
    findings = given["procedures"]["dq-inductance-aligned"]["findings"]
    assert findings["reading_d"] == pytest.approx(109.5e-6, rel=3e-3)
    assert findings["reading_q"] == pytest.approx(114.75e-6, rel=3e-3)


def test_weak_alignment_is_a_warning(motorbench):
    _, given = motorbench(
        "run", "dq-inductance-time-constant", "--station", "virtual", "--motor", "lg-400w", "--set", "align_share=0.1"
    )
    assert "E11" in {w["id"] for w in given["warnings"]}


@pytest.mark.slow
def test_torque_from_shaft_power(motorbench):
    _, given = motorbench(
        "run", "inertia", "--station", "virtual", "--motor", "lg-400w", "--set", "torque_source=power"
    )
    # So small a motor is far below what the power meter resolves.
    withheld = given["withheld"]["inertia"]
    assert withheld["cause"] == "too-uncertain"
    assert "E5" in {w["id"] for w in given["warnings"]}


def test_delta_gives_winding_and_equivalent_wye(motorbench):
    _, given = motorbench("run", "stator-resistance", "--station", "virtual", "--motor", "outrunner-delta")
    resistance = given["parameters"]["stator_resistance"]
    assert resistance["winding"] == pytest.approx(3.0 * resistance["value"])
    assert "E8" in {w["id"] for w in given["warnings"]}


def test_one_line_voltage_gives_the_same_flux(motorbench):
    _, given = motorbench(
        "run", "back-emf-constant", "--station", "virtual", "--motor", "lg-400w", "--set", "probing=line"
    )
    flux = given["parameters"]["flux_linkage"]
    assert abs(flux["value"] - flux["truth"]) <= 3.0 * flux["standard_uncertainty"]


def test_sweep_that_is_too_quick_is_noticed(motorbench):
    _, given = motorbench(
        "run", "dq-inductance-extremes", "--station", "virtual", "--motor", "lg-400w", "--set", "turning_speed=8"
    )
    assert "rough-sweep" in {w["id"] for w in given["warnings"]} or given["status"] == "failed"


@pytest.mark.slow
def test_saturation_shows_as_a_curve_that_depends_on_the_direction(motorbench):
    _, given = motorbench(
        *("run", "dq-inductance-time-constant", "--station", "virtual", "--motor", "ipmsm"),
        *("--set", "curve_shares=[0.1, 0.4]", "--set", "repeats=2"),
    )
    curve = given["procedures"]["dq-inductance-time-constant"]["findings"]["curve"]
    d = {round(point["current"] / 9.96, 1): point["inductance"] for point in curve["d"]}
    assert d[1.0] < d[-1.0] * 0.97, "a current along the magnets must find less inductance"
    assert d[1.0] == pytest.approx(174.0e-6, rel=0.01)
    q = [point["inductance"] for point in curve["q"]]
    assert q[0] == pytest.approx(q[-1], rel=0.01)
    assert max(q) <= 361e-6
    # Two channels of 2 % of a screen that the step fills to nine tenths, beside what the repeats scatter.
    for point in (*curve["d"], *curve["q"]):
        gains = math.sqrt(2.0 / 3.0) * 0.02 / 0.9 * point["inductance"]
        assert point["standard_uncertainty"] == pytest.approx(math.hypot(gains, point["repeatability"]), rel=0.04)


def test_flux_is_referred_to_25_degrees(motorbench):
    figures = []
    for settings in ((), ("--set", "magnet_coefficient=0")):
        _, given = motorbench(
            *("run", "back-emf-constant", "--station", "virtual", "--motor", "lg-400w"),
            *("--set", "winding_temperature=65", *settings),
        )
        figures.append(given["parameters"]["flux_linkage"]["value"])
    assert figures[0] / figures[1] == pytest.approx(1.0 / 0.96)
