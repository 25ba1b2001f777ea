import numpy as np
import pytest

from sim_instruments.bench import VirtualBench
from sim_instruments.world.world import World


@pytest.fixture
def world(virtual_bench: VirtualBench) -> World:
    """A shaft turned by hand, three probes on its terminals, and half a second gone."""
    world = virtual_bench.world
    world.connect({"A": "supply+", "B": "supply-"})
    for channel, nodes in enumerate((("A", "B"), ("B", "C"), ("C", "star")), 1):
        world.attach_voltage_probe(channel, *nodes)  # type: ignore[arg-type]
    world.attach_current_probe(4, "A")
    world.turn_shaft(20.0)
    world.supply.set_voltage(1.0)
    world.clock.sleep(0.3)
    world.supply.switch(True)
    world.clock.sleep(0.2)
    return world


TIMES = np.linspace(0.1, 0.45, 700)
CHANNELS = (1, 2, 3, 4, 5)


def test_what_is_held_is_what_was_sensed(world: World) -> None:
    held = world.hold_probes(0.1, 0.45)
    for channel in CHANNELS:
        assert np.array_equal(held.signal(channel, TIMES), world.probe_signal(channel, TIMES))
    assert np.ptp(held.signal(4, TIMES)) > 0.05
    assert np.array_equal(held.signal(1, TIMES[::7]), held.signal(1, TIMES)[::7])
    assert not held.signal(5, TIMES).any()
    assert held.signal(1, np.zeros(0)).shape == (0,)


def test_it_outlasts_the_bench_memory_and_any_change(world: World) -> None:
    held = world.hold_probes(0.1, 0.45)
    before = [world.probe_signal(channel, TIMES) for channel in CHANNELS]
    world.detach_probe(1)
    world.attach_voltage_probe(2, "A", "star")
    world.hold_shaft()
    world.connect({})
    for _ in range(10):
        world.clock.sleep(500.0)
        world.shaft_speed(0.0)
    with pytest.raises(ValueError, match="no longer known"):
        world.probe_signal(2, TIMES)
    for channel, values in zip(CHANNELS, before, strict=True):
        assert np.array_equal(held.signal(channel, TIMES), values)


def test_times_to_come_cannot_be_held(world: World) -> None:
    with pytest.raises(ValueError, match="still to come"):
        world.hold_probes(0.1, 0.6)
