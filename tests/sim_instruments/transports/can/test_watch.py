"""A virtual drive's heartbeat consumer: what CiA 301 and 402 make of it."""

import threading
from collections.abc import Callable, Iterator

import pytest

from sim_instruments.instruments.cia402.power import SdoError
from sim_instruments.transports.can.watch import HeartbeatConsumer

Heard = Callable[[int, bytearray, float], None]


class Bus:
    """Keeps who listens for what, and the control words that were obeyed."""

    def __init__(self) -> None:
        self.listeners: dict[int, Heard] = {}
        self.words: list[int] = []
        self.acted = threading.Event()

    def act(self, word: int) -> None:
        self.words.append(word)
        self.acted.set()

    def beat(self, producer: int = 0x7F) -> None:
        self.listeners[0x700 + producer](0x700 + producer, bytearray(b"\x05"), 0.0)


@pytest.fixture
def bus() -> Bus:
    return Bus()


@pytest.fixture
def consumer(bus: Bus) -> Iterator[HeartbeatConsumer]:
    made = HeartbeatConsumer(bus.listeners.__setitem__, bus.listeners.__delitem__, bus.act)
    yield made
    made.close()


@pytest.mark.parametrize(("option", "words"), [(1, [0x00]), (2, [0x00]), (3, [0x02])])
def test_a_heartbeat_that_stays_away(bus: Bus, consumer: HeartbeatConsumer, option: int, words: list[int]) -> None:
    assert consumer.write(0x6007, option)
    assert consumer.write(0x1016, 0x7F << 16 | 20)
    bus.beat()
    assert bus.acted.wait(10.0)
    assert bus.words == words


def test_nothing_is_watched_before_the_first_heartbeat_nor_after_it_was_taken_back(
    bus: Bus, consumer: HeartbeatConsumer
) -> None:
    consumer.write(0x6007, 2)
    consumer.write(0x1016, 0x7F << 16 | 10)
    assert not bus.acted.wait(0.1)
    consumer.write(0x1016, 0)
    assert bus.listeners == {}
    assert not bus.acted.wait(0.05)


def test_no_action_is_an_option_too(bus: Bus, consumer: HeartbeatConsumer) -> None:
    consumer.write(0x6007, 0)
    consumer.write(0x1016, 0x7F << 16 | 10)
    bus.beat()
    assert not bus.acted.wait(0.1)


def test_what_is_not_its_own_is_left_to_the_drive(consumer: HeartbeatConsumer) -> None:
    assert not consumer.write(0x6040, 6)
    with pytest.raises(SdoError, match="no option of this drive"):
        consumer.write(0x6007, 9)
