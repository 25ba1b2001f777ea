"""The supply's own protections, set by the driver and tripped by the simulated instrument."""

from collections.abc import Callable
from typing import Any

import pytest

from drivers.interfaces import OutputMode, Regulated, ReportedError

MakeCounted = Callable[..., Any]


@pytest.fixture
def loaded(counted: MakeCounted) -> Any:
    bench = counted()
    bench.world.connect({"A": "supply+", "B": "supply-"})
    bench.world.lock_rotor()
    return bench


def test_an_output_that_is_to_hold_its_voltage_goes_off_at_its_current_limit(loaded: Any) -> None:
    supply, seen = loaded["supply"], {}

    def block() -> None:
        with supply.energised(1.0, 0.5):
            for moment in (0.02, 0.2):
                loaded.bench.clock.sleep(moment)
                seen[moment] = loaded.world.truth()["output_on"]
            assert supply.output_mode() is OutputMode.TRIPPED

    with pytest.raises(ReportedError, match="supply: over-current protection switched the output off"):
        block()
    # A moment at the limit is passed over; and nothing is left latched.
    assert seen == {0.02: True, 0.2: False}
    assert loaded.world.truth()["supply_tripped"] is None
    assert not loaded.world.truth()["output_on"]
    with supply.energised(0.05, 5.0):
        loaded.bench.clock.sleep(0.2)
        assert supply.output_mode() is OutputMode.CONSTANT_VOLTAGE


def test_an_output_that_is_to_hold_its_current_does_not_trip_at_it(loaded: Any) -> None:
    supply = loaded["supply"]
    with supply.energised(1.0, 0.5, Regulated.CURRENT):
        loaded.bench.clock.sleep(5.0)
        assert supply.output_mode() is OutputMode.CONSTANT_CURRENT
    assert not loaded.world.truth()["output_on"]


def test_an_over_voltage_switches_off_and_is_named(loaded: Any) -> None:
    supply = loaded["supply"]

    def block() -> None:
        with supply.energised(0.1, 10.0):
            # A lower level than the driver's stands for a voltage that runs away.
            loaded.bench.instrument("supply").write(b"VOLT:PROT 0.05,(@1)\n")
            loaded.bench.clock.sleep(0.1)
            assert not loaded.world.truth()["output_on"]

    with pytest.raises(ReportedError, match="over-voltage protection switched the output off"):
        block()
    assert loaded.world.truth()["supply_tripped"] is None
