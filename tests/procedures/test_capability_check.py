"""What a bridge cannot give is said from the type value alone, with what would do."""

from types import SimpleNamespace
from typing import Any, cast

import pytest

from drivers.interfaces import Accuracy, Aperture
from procedures.core.bench import Bench, Role
from procedures.core.nameplate import Nameplate, WindingConnection
from procedures.note.stator_resistance import StatorResistance, StatorResistanceSettings


class Bridge:
    """Answers for its accuracy; anything else that is asked of it fails."""

    identity = SimpleNamespace(model="bridge")

    def __init__(self, accuracy: Accuracy) -> None:
        self.accuracy = accuracy
        self.asked: list[tuple[Any, ...]] = []

    def accuracy_at(self, *given: Any) -> tuple[Accuracy, Accuracy]:
        self.asked.append(given)
        return self.accuracy, Accuracy()


def check_capability(bridge: Bridge, expected: dict[str, float], *roles: Role, **given: Any) -> list[str]:
    bench = SimpleNamespace(lcr_meter=bridge, has=lambda role: role in roles)
    plate = Nameplate("m", WindingConnection.WYE, rated_current=1.0, expected=expected)
    notices = StatorResistance.check_capability(cast("Bench", bench), plate, StatorResistanceSettings(**given))
    assert all(notice.identifier == "cannot-support" for notice in notices)
    return [str(notice.message) for notice in notices]


COARSE = Accuracy(offset=3.3e-3)


def test_it_names_procedure_instrument_and_what_would_do() -> None:
    bridge = Bridge(COARSE)
    (said,) = check_capability(
        bridge, {"stator_resistance": 0.016, "d_axis_inductance": 70e-6}, Role.SUPPLY, Role.VOLTMETER
    )
    assert said == (
        "stator-resistance: the lcr_meter (bridge) at 20 Hz on 32 mΩ between lines can give 6 %, and 1 % is asked for (relative "
        "standard uncertainty); measure by four-wire direct current instead: stator-resistance-dc"
    )
    assert bridge.asked == [(0.032, 70e-6, 20.0, 1.0, Aperture.LONG)]


def test_it_says_what_the_station_lacks_for_that() -> None:
    (said,) = check_capability(Bridge(COARSE), {"stator_resistance": 0.016}, Role.SUPPLY)
    assert "the station lacks supply or voltmeter" in said


@pytest.mark.parametrize("expected", [{}, {"flux_linkage": 0.01}, {"stator_resistance": 1.0}])
def test_nothing_is_claimed_where_nothing_is_known_or_all_is_well(expected: dict[str, float]) -> None:
    assert check_capability(Bridge(COARSE), expected) == []


def test_a_temperature_known_too_badly_is_named_as_such() -> None:
    (said,) = check_capability(Bridge(Accuracy()), {"stator_resistance": 0.016}, temperature_uncertainty=10.0)
    assert "the winding's temperature would have to be known within ±4.5 K" in said
    assert check_capability(Bridge(Accuracy()), {"stator_resistance": 0.016}, temperature_uncertainty=4.4) == []
