"""Synthetic Hall sensors with every fault there is."""

import itertools
import math

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from procedures.estimation.emf.hall import HallFault, judge, switching
from procedures.estimation.fitting.fit import EstimationError


def record(*, offset=0.0, placements=(0.0, 0.0, 0.0), order=(1, 2, 3), inverted=(), dead=(), duty=0.5, noise=0.02,
           turns=4.3, points=2000, seed=0, drift=0.0):  # fmt: skip
    """Return time (s), the line EMF A − C and the three leads (V) of sensors that rise at 0°, 120°, 240° of it, offset added."""
    random = np.random.default_rng(seed)
    t = np.linspace(0.0, 0.04, points)
    angle = 2 * math.pi * turns * (t / t[-1] + drift * (t / t[-1]) ** 2) + 1.0
    emf = 8.0 * np.sin(angle) + 0.4 * np.sin(5 * angle) + noise * random.standard_normal(points)
    leads = []
    for sensor in order:
        start = offset + placements[sensor - 1] + (sensor - 1) * 2 * math.pi / 3
        level = np.mod(angle - start + 2 * math.pi * (duty - 0.5) / 2, 2 * math.pi) < 2 * math.pi * duty
        level = ~level if sensor in inverted else level
        level = np.zeros_like(level) if sensor in dead else level
        leads.append(5.0 * level + noise * random.standard_normal(points))
    return t, emf, np.array(leads)


def judged(**how):
    seen, _ = switching(*record(**how), least_swing=1.0)
    return judge(dict(enumerate(seen, 1)))


def test_a_sound_sensor_rises_with_the_emf_and_half_a_turn_later_falls():
    seen, frequency = switching(*record(), least_swing=1.0)
    assert frequency == pytest.approx(4.3 / 0.04, rel=1e-3)
    for k, found in enumerate(seen):
        assert math.remainder(found.rise - k * 2 * math.pi / 3, 2 * math.pi) == pytest.approx(
            0.0, abs=4 * found.uncertainty
        )
        assert found.duty == pytest.approx(0.5, abs=0.002)
        assert math.degrees(found.uncertainty) < 0.2


@settings(max_examples=30, deadline=None)
@given(
    st.floats(min_value=-25.0, max_value=25.0),
    st.permutations([1, 2, 3]),
    st.sets(st.sampled_from([1, 2, 3]), max_size=2),
    st.integers(min_value=0, max_value=99),
)
def test_every_order_and_polarity_is_told_apart(offset, order, inverted, seed):
    found = judged(offset=math.radians(offset), order=order, inverted=inverted, seed=seed)
    cyclic = order in ([2, 3, 1], [3, 1, 2])
    if cyclic and not inverted:
        # All three moved on by one is as good as a rotor turned by a third.
        assert found.faults == ()
        assert abs(math.degrees(found.offset)) > 90.0
        return
    swapped = {(f.lead, f.carries) for f in found.faults if f.fault is HallFault.SWAPPED}
    assert swapped == {(lead, sensor) for lead, sensor in enumerate(order, 1) if lead != sensor}
    upside_down = {f.lead for f in found.faults if f.fault is HallFault.INVERTED}
    assert upside_down == {lead for lead, sensor in enumerate(order, 1) if sensor in inverted}
    assert math.degrees(found.offset) == pytest.approx(offset, abs=0.3)
    assert found.explained


@pytest.mark.parametrize("offset", [-180.0, -120.0, -60.0, 60.0, 120.0])
def test_all_three_moved_alike_is_an_offset(offset):
    found = judged(offset=math.radians(offset + 4.0))
    assert found.faults == ()
    assert math.remainder(math.degrees(found.offset) - offset - 4.0, 360.0) == pytest.approx(0.0, abs=0.3)


def test_all_upside_down_is_half_a_turn():
    found = judged(inverted=(1, 2, 3))
    assert found.faults == ()
    assert abs(math.degrees(found.offset)) == pytest.approx(180.0, abs=0.3)


@pytest.mark.parametrize("dead", [k for n in (1, 2, 3) for k in itertools.combinations((1, 2, 3), n)])
def test_dead_sensors_are_named_and_the_others_measured(dead):
    found = judged(dead=dead, offset=0.1)
    assert [f.lead for f in found.faults if f.fault is HallFault.DEAD] == list(dead)
    assert len(found.faults) == len(dead)
    assert math.isnan(found.offset) == (len(dead) == 3)
    assert math.isnan(found.spacing) == (len(dead) >= 2)
    if len(dead) < 3:
        assert found.offset == pytest.approx(0.1, abs=0.01)


def test_a_sensor_out_of_place_and_an_uneven_duty_are_measured():
    found = judged(placements=(0.0, math.radians(7.0), 0.0), duty=0.46)
    assert found.faults == ()
    assert math.degrees(found.spacing) == pytest.approx(7.0, abs=0.3)
    assert found.duty == pytest.approx(0.04, abs=0.003)
    assert math.degrees(found.offset) == pytest.approx(7.0 / 3.0, abs=0.3)


def test_two_leads_on_one_sensor_are_not_explained():
    seen, _ = switching(*record(order=(1, 1, 3)), least_swing=1.0)
    assert not judge(dict(enumerate(seen, 1))).explained


def test_a_speed_that_drifts_does_not_matter():
    assert judged(drift=0.02, offset=0.2).offset == pytest.approx(0.2, abs=0.01)


def test_scatter_is_within_the_uncertainty_stated():
    found = [
        switching(*record(seed=seed, turns=4.3 + 0.01 * seed, noise=0.3), least_swing=1.0)[0][1] for seed in range(15)
    ]
    off = np.array([math.remainder(f.rise - 2 * math.pi / 3, 2 * math.pi) for f in found])
    stated = np.mean([f.uncertainty for f in found])
    assert np.sqrt(np.mean(off**2)) < 1.5 * stated
    assert stated < math.radians(0.5)


def test_noise_alone_is_dead_and_a_flutter_is_no_sensor():
    t, emf, leads = record()
    leads[0] = 0.02 * np.random.default_rng(1).standard_normal(t.size)
    leads[1] = 5.0 * (np.arange(t.size) % 20 < 10)
    seen, _ = switching(t, emf, leads, least_swing=1.0)
    assert seen[0] is None
    assert seen[1] is None
    assert seen[2] is not None


def test_a_record_that_is_too_short_is_refused():
    with pytest.raises(EstimationError, match="two are needed"):
        switching(*record(turns=1.5), least_swing=1.0)
