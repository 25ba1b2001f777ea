"""The guardian's own delays, by which it gives a run more time."""

from bench.safety.guardian.lateness import Lateness


def test_the_longest_delay_of_the_window_counts_and_no_more_than_the_window() -> None:
    late = Lateness(0.6)
    assert late.allowance(0.0) == 0.0
    late.woke(planned=1.0, now=1.005)
    assert late.allowance(1.005) == 0.0, "a waker's usual delay is none"
    late.woke(planned=1.05, now=1.25)
    late.woke(planned=1.30, now=1.35)
    assert round(late.allowance(1.35), 6) == 0.2
    assert round(late.allowance(1.9), 6) == 0.05, "the longer one is past"
    assert late.allowance(2.0) == 0.0
    late.woke(planned=3.0, now=60.0)
    assert late.allowance(60.0) == 0.6
