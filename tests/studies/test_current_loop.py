"""The study of current loops in small: none unstable, and where the computing delay is short the bandwidth is the one asked for."""

import pytest

from reports.exports.current_loop import DEFAULT_BANDWIDTH

pytestmark = pytest.mark.slow


def test_true_gains_close_the_loop_with_the_bandwidth_that_was_asked() -> None:
    from tests.studies.current_loop import respond

    omega = 2.0 * 3.141592653589793 * 100.0
    loop = respond("q", (omega * 1e-3, omega * 2e-3, omega * 0.1), (0.1, 1e-3, 2e-3), 100.0, 1000)
    assert loop.bandwidth == pytest.approx(100.0, rel=0.03)
    assert loop.settled


def test_measured_gains() -> None:
    from tests.studies.current_loop import loops_of

    loops = [loop for index in range(3) for loop in loops_of(5, index, DEFAULT_BANDWIDTH, 504)]
    assert len(loops) == 6
    for loop in loops:
        assert loop.settled
        assert loop.bandwidth == pytest.approx(DEFAULT_BANDWIDTH, rel=0.10)
        assert loop.overshoot < 0.05
