"""Hands that turn unevenly and take hold anew, eyes that read a thermometer, fingers that slip."""

import numpy as np
import pytest

from bench.operators.virtual import VirtualOperator
from drivers.interfaces.text import text
from procedures.core.actions import EnterReading, StartTurning
from sim_instruments.disturbances.bench import Disturbances, Hands
from tests.bench.virtual.disturbances.conftest import Make, Stand

TEMPERATURE = EnterReading("winding_temperature", text("temperature"), "°C", -60.0, 250.0)


def turned(one: Stand, seconds: float = 20.0) -> np.ndarray:
    """Return the speeds (rad/s) of a shaft that an operator turns at 2 rad/s."""
    VirtualOperator(one.world, 1).perform(StartTurning(2.0))
    speeds = []
    for _ in range(round(seconds / 0.01)):
        one.sleep(0.01)
        speeds.append(one.world.shaft_velocity())
    return np.array(speeds)


def test_a_hand_takes_hold_anew_and_the_shaft_stands_meanwhile(stand: Make) -> None:
    speeds = turned(stand(Disturbances(hands=Hands(regrips=1.0, regrip_time=0.4))))
    standing = speeds == 0.0
    # A turn takes π s and a regrip 0.4 s on average, by ± 40 % and ± 50 %.
    regrips = np.count_nonzero(np.diff(standing.astype(int)) == 1)
    assert 4 <= regrips <= 8
    assert np.mean(standing) == pytest.approx(0.4 / (np.pi + 0.4), abs=0.06)
    assert np.all(turned(stand(), 5.0) > 0.0)


def test_a_hand_turns_unevenly(stand: Make) -> None:
    speeds = turned(stand(Disturbances(hands=Hands(unevenness=0.3))), 10.0)
    assert (speeds.min(), speeds.max()) == pytest.approx((1.4, 2.6), abs=0.02)
    usual = turned(stand(), 10.0)
    assert (usual.min(), usual.max()) == pytest.approx((1.8, 2.2), abs=0.02)


def test_a_thermometer_outside_shows_part_of_the_windings_warmth(stand: Make) -> None:
    one = stand(Disturbances(hands=Hands(thermometer_share=0.4)))
    one.world.set_winding_temperature(75.0)
    assert VirtualOperator(one.world, 1).thermometer() == pytest.approx(25.0 + 0.4 * 50.0, abs=0.5)
    usual = stand()
    usual.world.set_winding_temperature(75.0)
    assert VirtualOperator(usual.world, 1).thermometer() == pytest.approx(75.0, abs=0.5)


def test_a_decimal_point_slips_by_one_place(stand: Make) -> None:
    operator = VirtualOperator(stand(Disturbances(hands=Hands(slips=0.5))).world, 1)
    typed = np.array([float(str(operator.perform(TEMPERATURE))) for _ in range(200)])
    read = operator.thermometer()
    places = np.log10(typed / read)
    assert set(np.rint(places)) == {-1.0, 0.0, 1.0}
    assert np.allclose(places, np.rint(places), atol=0.01)
    assert np.mean(np.rint(places) != 0.0) == pytest.approx(0.5, abs=0.12)


@pytest.mark.parametrize("values", [{"slips": 1.5}, {"unevenness": 1.0}, {"regrip_time": 0.0}])
def test_hands_that_nobody_has_are_refused(values: dict[str, float]) -> None:
    with pytest.raises(ValueError, match=next(iter(values))):
        Hands(**values)
