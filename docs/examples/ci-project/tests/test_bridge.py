"""The driver reads what is true, and says so where it cannot."""

import pytest
from bridge import Bridge


@pytest.fixture
def bench(virtual_bench, virtual_motor):
    made = virtual_bench(virtual_motor("lg-400w", phase_resistances=(0.5, 0.5, 0.5)), seed=7)
    made.bench.world.connect({"A": "lcr_high", "B": "lcr_low"})
    return made


def test_two_phases_in_series(bench):
    _, resistance = Bridge(bench.resource("lcr_meter"), frequency=100.0).measure()
    # The leads have some milliohms, which nobody measured here.
    assert resistance == pytest.approx(2.0 * bench.truth["stator_resistance"], abs=0.02)


def test_an_open_circuit_is_said(bench):
    bench.bench.world.connect({})
    bridge = Bridge(bench.resource("lcr_meter"), frequency=100.0)
    with pytest.raises(RuntimeError, match="status is"):
        bridge.measure()


def test_faults_reach_the_driver(bench):
    resource = bench.resource("lcr_meter", timeout=200)
    bridge = Bridge(resource, frequency=100.0)
    bench.inject("lcr_meter: silence at 0")
    with pytest.raises(Exception, match=r"(?i)timeout"):
        bridge.measure()
