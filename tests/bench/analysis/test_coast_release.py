"""A coast-down's record that begins before the release or goes on behind the standstill gives the shaft's own friction."""

import numpy as np
import pytest

from bench.analysis.coast_down import analyze_coast_down
from bench.captures import CaptureError

COULOMB, VISCOUS, TOP, STEP = 20.0, 0.1, 300.0, 0.002
#: A shaft whose drive comes to the end of its voltage: it rises ever more slowly, and lets go there.
SPUN_UP = TOP * -np.expm1(-np.arange(0.0, 8.0, STEP) / 2.5) / -np.expm1(-8.0 / 2.5)


def analysed(tmp_path, before, behind=(), noise=0.1):
    time = np.arange(0.0, 9.0, STEP)
    coast = (TOP + COULOMB / VISCOUS) * np.exp(-VISCOUS * time) - COULOMB / VISCOUS
    speed = np.concatenate((before, coast[coast > 10.0]))
    speed = speed + np.random.default_rng(5).normal(0.0, noise, speed.size)
    speed = np.concatenate((speed, behind))
    path = tmp_path / "coast.csv"
    table = np.column_stack((STEP * np.arange(speed.size), speed))
    np.savetxt(path, table, delimiter=",", header="time (s),speed (rad/s)", comments="")
    return analyze_coast_down(path)


def holds(found):
    truths = {"coulomb_deceleration": COULOMB, "viscous_rate": VISCOUS}
    return all(
        low <= truths[name] <= high
        for name, figure in found["parameters"].items()
        for low, high in [figure["coverage_interval"]]
    )


@pytest.mark.parametrize(
    "before",
    [
        np.full(100, TOP),
        np.full(1500, TOP),
        np.full(6000, TOP),
        np.linspace(30.0, TOP, 2000),
        SPUN_UP,
        np.concatenate((np.full(600, 30.0), np.zeros(1200), np.linspace(0.0, TOP, 200), np.full(1000, TOP))),
    ],
    ids=["short", "held", "long", "driven", "spun up", "stood, started and held"],
)
def test_what_comes_before_the_release_is_left_out_and_said(tmp_path, before):
    found = analysed(tmp_path, before)
    [said] = [each for each in found["assumptions"] if "the coast-down begins at" in each]
    begin = float(said.split("begins at ")[1].split(" s:")[0])
    released = STEP * before.size
    assert released <= begin < released + 0.3
    assert not found["misfit"]
    assert holds(found)


def test_a_coast_down_alone_is_taken_whole(tmp_path):
    found = analysed(tmp_path, np.zeros(0))
    assert not any("the coast-down begins" in each or "stands still" in each for each in found["assumptions"])
    assert holds(found)


@pytest.mark.parametrize("behind", [np.zeros(2000), np.full(800, 9.0)], ids=["zero", "last value"])
def test_what_comes_behind_the_standstill_is_left_out(tmp_path, behind):
    found = analysed(tmp_path, np.full(500, TOP), behind)
    assert any("is constant from" in each for each in found["assumptions"])
    assert not found["misfit"]
    assert holds(found)


def test_a_second_coast_down_is_refused_with_where_the_first_ends(tmp_path):
    stood, up = np.zeros(1000), np.linspace(0.0, 0.95 * TOP, 500)
    down = np.linspace(0.95 * TOP, 0.0, 4000)
    with pytest.raises(
        CaptureError, match=r"driven again at about .* more than one coast-down; take one of them with --from and --to"
    ):
        analysed(tmp_path, np.linspace(0.0, TOP, 500), behind=np.concatenate((stood, up, down)))


def test_a_slower_run_before_is_left_out(tmp_path):
    before = np.concatenate(
        (np.linspace(0.0, 0.8 * TOP, 500), np.linspace(0.8 * TOP, 0.0, 4000), np.linspace(0.0, TOP, 500))
    )
    assert holds(analysed(tmp_path, before))
