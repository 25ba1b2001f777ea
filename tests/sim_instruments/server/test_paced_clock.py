import threading

import pytest

from sim_instruments.clock.paced_clock import PacedClock


class Wall:
    """A wall clock that a test turns."""

    def __init__(self) -> None:
        self.time = 100.0

    def __call__(self) -> float:
        return self.time


def test_it_runs_as_many_times_as_fast() -> None:
    wall = Wall()
    clock = PacedClock(20.0, wall)
    assert clock.now() == 0.0
    wall.time += 0.5
    assert clock.now() == pytest.approx(10.0)


def test_sleeping_takes_bench_time_and_never_less() -> None:
    clock = PacedClock(500.0)
    before = clock.now()
    clock.sleep(5.0)
    assert clock.now() >= before + 5.0
    clock.sleep(0.0)


@pytest.mark.parametrize("seconds", [-1.0, float("nan"), float("inf")])
def test_impossible_times_are_refused(seconds: float) -> None:
    with pytest.raises(ValueError, match="finite and not negative"):
        PacedClock().sleep(seconds)


@pytest.mark.parametrize("speedup", [0.0, 0.01, 2000.0, float("nan")])
def test_impossible_speeds_are_refused(speedup: float) -> None:
    with pytest.raises(ValueError, match=r"outside 0\.1 … 1000"):
        PacedClock(speedup)


def test_a_pulse_tells_those_who_follow() -> None:
    wall, told = Wall(), list[float]()
    clock = PacedClock(2.0, wall)
    stop = clock.on_advance(told.append)
    wall.time += 1.0
    clock.pulse()
    stop()
    stop()
    wall.time += 1.0
    clock.pulse()
    assert told == [pytest.approx(2.0)]


def test_a_pulse_runs_what_is_due_in_its_order() -> None:
    wall, seen = Wall(), list[str]()
    clock = PacedClock(2.0, wall)
    clock.call_at(3.0, lambda: seen.append("later"))
    clock.call_at(1.0, lambda: seen.append("first"))
    clock.call_at(1.5, lambda: clock.call_at(1.9, lambda: seen.append("third")) and None)
    cancel = clock.call_at(1.2, lambda: seen.append("never"))
    cancel()
    cancel()
    clock.pulse()
    assert seen == []
    wall.time += 1.0
    clock.pulse()
    assert seen == ["first", "third"]
    wall.time += 1.0
    clock.pulse()
    assert seen == ["first", "third", "later"]


def test_time_stands_still_while_the_bench_is_behind_and_makes_nothing_up() -> None:
    wall = Wall()
    clock = PacedClock(20.0, wall)
    wall.time += 3.0
    clock.pulse(behind=True)
    wall.time += 5.0
    assert clock.now() == pytest.approx(60.0)
    clock.pulse(behind=True)
    wall.time += 1.0
    clock.pulse()
    assert clock.now() == pytest.approx(60.0)
    wall.time += 0.05
    assert clock.now() == pytest.approx(61.0)


def test_closing_wakes_whoever_sleeps() -> None:
    clock = PacedClock(1.0)
    sleeper = threading.Thread(target=clock.sleep, args=(3600.0,))
    sleeper.start()
    clock.close()
    sleeper.join(5.0)
    assert not sleeper.is_alive()
