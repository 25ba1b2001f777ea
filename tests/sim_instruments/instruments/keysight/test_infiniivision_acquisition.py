"""A trigger that is looked for in pieces is the one that is found at once."""

import math
from typing import Literal

import numpy as np
import pytest

from sim_instruments.instruments.oscilloscope.acquisition import Acquisition
from sim_instruments.instruments.oscilloscope.arming import Setup
from sim_instruments.instruments.oscilloscope.edge import Edge
from sim_instruments.instruments.oscilloscope.record import FloatArray, Vertical

EVENTS = (0.31, 1.7)


class Bench:
    """A signal with a pulse at each event, and a time that is set."""

    def __init__(self) -> None:
        self.time = 0.0
        self.looked = 0
        self.acquisition = Acquisition(
            lambda: self.time,
            self.signal,
            lambda *_: self,
            np.random.default_rng(1),
            0.0,  # type: ignore[arg-type]
        )

    def signal(self, channel: int, times: FloatArray) -> FloatArray:
        self.looked = max(self.looked, len(times))
        return sum(np.exp(-(((times - event) / 1.0e-3) ** 2)) for event in EVENTS) * 5.0  # type: ignore[return-value]


def setup(averages: int = 1) -> Setup:
    vertical = Vertical(scale=1.0, offset=0.0, probe=1.0, noise_factor=0.0)
    edge = Edge(2.5, "POS", 0.1)
    return Setup(-5.0e-4, 1.0e-3, 1000, {1: vertical}, vertical, 1, edge, automatic=False, averages=averages)


@pytest.mark.parametrize("how", ["SING", "RUN"])
def test_pieces_find_what_one_go_finds(how: Literal["SING", "RUN"]) -> None:
    benches = Bench(), Bench()
    for bench in benches:
        (bench.acquisition.single if how == "SING" else bench.acquisition.run)(setup())
        bench.time = 2.0
    pieces = benches[1]
    turns = 0
    while pieces.acquisition.catch_up():
        turns += 1
    records = [bench.acquisition.record() for bench in benches]
    expected = EVENTS[how == "RUN"] - 1.0e-3 * math.sqrt(math.log(2.0))
    for record in records:
        assert record is not None
        assert record.triggers[0] == pytest.approx(expected, abs=1.0e-6)
    assert turns > (5 if how == "SING" else 40)
    assert pieces.looked < 10_000
    assert not pieces.acquisition.catch_up()


def test_a_record_that_was_seen_is_kept_until_the_next_trigger() -> None:
    bench = Bench()
    bench.acquisition.run(setup())
    bench.time = 1.0
    while bench.acquisition.catch_up():
        pass
    first = bench.acquisition.record()
    bench.time = 1.5
    assert bench.acquisition.record() is first
    assert first is not None


def test_a_past_that_is_forgotten_is_not_looked_through() -> None:
    bench = Bench()
    bench.acquisition.single(setup())
    bench.time = 1000.0
    assert not bench.acquisition.catch_up()
    assert bench.acquisition.state == "SING"
    assert bench.looked < 10_000


def test_averages_end_with_the_last_of_their_triggers() -> None:
    bench = Bench()
    bench.acquisition.single(setup(averages=2))
    bench.time = 3.0
    while bench.acquisition.catch_up():
        pass
    record = bench.acquisition.record()
    assert record is not None
    assert len(record.triggers) == 2
