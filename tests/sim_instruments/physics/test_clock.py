import threading

import pytest

from sim_instruments.clock.virtual_clock import VirtualClock


def test_a_single_participant_jumps() -> None:
    clock = VirtualClock()
    clock.sleep(3600.0)
    assert clock.now() == 3600.0
    clock.sleep(0.0)
    assert clock.now() == 3600.0


def test_several_participants_wake_in_order_of_their_wake_ups() -> None:
    clock = VirtualClock(participants=3)
    log: list[tuple[float, str]] = []

    def work(name: str, steps: list[float]) -> None:
        for step in steps:
            clock.sleep(step)
            log.append((clock.now(), name))
        clock.leave()

    threads = [
        threading.Thread(target=work, args=("a", [1.0, 1.0, 1.0])),
        threading.Thread(target=work, args=("b", [2.5])),
        threading.Thread(target=work, args=("c", [0.25, 9.75])),
    ]
    for thread in threads:
        thread.start()
    for thread in threads:
        thread.join(10.0)
    assert not any(thread.is_alive() for thread in threads)
    assert log == [(0.25, "c"), (1.0, "a"), (2.0, "a"), (2.5, "b"), (3.0, "a"), (10.0, "c")]


def test_time_waits_for_a_participant_at_work() -> None:
    clock = VirtualClock(participants=2)
    woke = threading.Event()

    def sleeper() -> None:
        clock.sleep(5.0)
        woke.set()

    thread = threading.Thread(target=sleeper)
    thread.start()
    assert not woke.wait(0.05)
    assert clock.now() == 0.0
    clock.sleep(2.0)
    assert clock.now() == 2.0
    assert not woke.is_set()
    clock.leave()
    thread.join(10.0)
    assert clock.now() == 5.0


def test_a_server_sleeps_for_its_blocked_client() -> None:
    clock = VirtualClock()
    served = threading.Event()

    def server() -> None:
        clock.sleep(0.3)
        served.set()

    thread = threading.Thread(target=server)
    thread.start()
    assert served.wait(10.0)
    thread.join(10.0)
    assert clock.now() == 0.3


def test_callbacks_see_the_new_time_before_sleepers_return() -> None:
    clock = VirtualClock()
    seen: list[float] = []
    remove = clock.on_advance(seen.append)
    clock.sleep(1.0)
    clock.sleep(2.0)
    remove()
    clock.sleep(1.0)
    assert seen == [1.0, 3.0]


def test_a_failing_callback_does_not_leave_the_clock_stuck() -> None:
    clock = VirtualClock()

    def fail(_: float) -> None:
        raise RuntimeError("broken face")

    remove = clock.on_advance(fail)
    with pytest.raises(RuntimeError, match="broken face"):
        clock.sleep(1.0)
    remove()
    clock.sleep(1.0)
    assert clock.now() == 2.0


def test_misuse_is_named() -> None:
    clock = VirtualClock()
    with pytest.raises(ValueError, match="not negative"):
        clock.sleep(-1.0)
    with pytest.raises(ValueError, match="at least one"):
        VirtualClock(participants=0)
    clock.on_advance(lambda _: clock.sleep(1.0))
    with pytest.raises(RuntimeError, match="must not sleep"):
        clock.sleep(1.0)
    clock.leave()
    with pytest.raises(RuntimeError, match="no participants left"):
        clock.leave()


def test_time_stops_where_it_was_told_to_on_its_way() -> None:
    clock = VirtualClock()
    seen: list[tuple[str, float]] = []
    clock.on_advance(lambda time: seen.append(("advance", time)))
    clock.call_at(2.0, lambda: seen.append(("second", clock.now())))
    clock.call_at(1.0, lambda: seen.append(("first", clock.now())))
    cancel = clock.call_at(1.5, lambda: seen.append(("never", clock.now())))
    cancel()
    cancel()
    clock.call_at(3.0, lambda: seen.append(("at the end", clock.now())))
    clock.sleep(3.0)
    assert seen == [
        ("advance", 1.0),
        ("first", 1.0),
        ("advance", 2.0),
        ("second", 2.0),
        ("advance", 3.0),
        ("at the end", 3.0),
        ("advance", 3.0),
    ]
    # Nobody waits for what nobody sleeps for.
    clock.call_at(10.0, lambda: seen.append(("later", clock.now())))
    clock.sleep(1.0)
    assert clock.now() == 4.0


def test_an_alarm_may_set_the_next_one() -> None:
    clock = VirtualClock()
    seen: list[float] = []

    def again() -> None:
        seen.append(clock.now())
        if len(seen) < 3:
            clock.call_at(clock.now() + 0.25, again)

    clock.call_at(0.5, again)
    clock.sleep(5.0)
    assert seen == [0.5, 0.75, 1.0]
