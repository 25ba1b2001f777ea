"""What is polled until a time is over, by a process that may sleep at any moment."""

import pytest

from drivers.interfaces import polls


class SleepyClock:
    """A clock of whose process the processor is taken for `pause` (s) after each reading."""

    def __init__(self, pause: float = 0.0) -> None:
        self.time, self.pause, self.slept = 0.0, pause, list[float]()

    def now(self) -> float:
        return self.time

    def sleep(self, seconds: float) -> None:
        self.slept.append(seconds)
        self.time += seconds

    def read(self) -> float:
        """Return the time of the reading; the process sleeps after it."""
        result = self.time
        self.time += self.pause
        return result


def poll_to_the_end(clock: SleepyClock, timeout: float, interval: float) -> list[float]:
    read = []
    for last in polls(clock, timeout, interval):
        read.append(clock.read())
        if last:
            break
    return read


def test_readings_are_an_interval_apart_and_the_last_is_at_the_end() -> None:
    assert poll_to_the_end(SleepyClock(), 1.0, 0.25) == [0.0, 0.25, 0.5, 0.75, 1.0]


@pytest.mark.parametrize("pause", [0.9, 30.0])
def test_the_last_reading_is_always_of_after_the_end(pause: float) -> None:
    read = poll_to_the_end(SleepyClock(pause), 1.0, 0.25)
    assert read[-1] >= 1.0
    assert all(time < 1.0 for time in read[:-1])


def test_nothing_is_waited_for_after_the_last() -> None:
    clock = SleepyClock()
    assert poll_to_the_end(clock, 0.0, 5.0) == [0.0]
    assert clock.slept == []
