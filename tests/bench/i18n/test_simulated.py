"""What the simulation says is told by its words: each sentence that it really says is known, and comes in Chinese."""

import re
from collections.abc import Callable
from dataclasses import replace

import pytest

from bench.i18n.language import translator
from bench.i18n.simulated import simulated, simulation_error
from bench.testing import virtual_motor
from drivers.interfaces.text import text
from sim_instruments.clock.virtual_clock import VirtualClock
from sim_instruments.physics.motor import defects
from sim_instruments.physics.motor.iron import Iron
from sim_instruments.physics.motor.motor import VirtualMotor
from sim_instruments.physics.motor.shorted_turns import ShortedTurns
from sim_instruments.world.machine_data import InverterStage
from sim_instruments.world.world import World

#: Names of keys and of what stands in a file, units, and short names that are the same in both languages.
AS_IT_IS = re.compile(
    r"\[[\w.]+\]|'\w+'|\b\w+_\w+\b|\b(inertia|rad/s|EMF|V|A|iron|id|iq|nan|inf)\b|[-\d.]+(e[-+]?\d+)?"
)


def driven() -> World:
    clock = VirtualClock()
    world = World(virtual_motor("lg-400w").virtual_motor(), clock, inverter=InverterStage(dc_voltage=20.0))
    world.couple_dynamometer()
    world.connect({"A": "inverter_u", "B": "inverter_v", "C": "inverter_w"})
    world.dynamometer.set_mode("speed")
    world.dynamometer.command(400.0)
    world.dynamometer.enable(True)
    clock.sleep(5.0)
    return world


def in_chinese(sentence: str) -> str:
    words = simulated(sentence)
    assert words.template != "{message}"
    assert str(words) == sentence
    return words.render(translator("zh"))


def test_what_an_inverter_does_that_is_off() -> None:
    (sentence,) = driven().truth()["unmodelled"]
    chinese = in_chinese(sentence)
    assert "逆变器" in chinese
    assert not re.search("[A-Za-z]{2}", AS_IT_IS.sub("", chinese))


@pytest.mark.parametrize("motor", ["lg-400w", "92bl-30-25l"])
def test_hands_that_may_not(motor: str) -> None:
    world = driven()
    with pytest.raises(RuntimeError) as turning:
        world.uncouple_dynamometer()
    with pytest.raises(RuntimeError) as driving:
        world.turn_shaft(1.0)
    still = World(virtual_motor(motor).virtual_motor(), VirtualClock())
    still.lock_rotor()
    with pytest.raises(RuntimeError) as locked:
        still.turn_shaft(1.0)
    for error in (turning, driving, locked):
        assert not re.search("[A-Za-z]{2}", AS_IT_IS.sub("", in_chinese(str(error.value))))


def lg() -> VirtualMotor:
    return virtual_motor("lg-400w").virtual_motor()


@pytest.mark.parametrize(
    "make",
    [
        lambda: replace(lg(), inertia=-1.0),
        lambda: replace(lg(), cogging_torque=-1.0),
        lambda: replace(lg(), phase_resistances=(1.0, 1.0)),
        lambda: replace(lg(), d_axis_saturation_current=0.0),
        lambda: replace(lg(), emf_shares=(1.0, 1.0, 3.0)),
        lambda: replace(lg(), turn_shares=(1.0, 1.0, 0.0)),
        lambda: replace(lg(), exchanged=("A", "A")),
        lambda: replace(lg(), flux_harmonics=((1, 0.1, 0.0),)),
        lambda: replace(
            lg(),
            shorted_turns=ShortedTurns(0, 0.1),
            iron=Iron(eddy_coupling=0.2),
        ),
        lambda: replace(lg(), d_axis_saturation_current=20.0, iron=Iron(eddy_coupling=0.2)),
        lambda: defects.hall_stuck(replace(lg(), halls=None), "high"),
    ],
)
def test_a_motor_that_cannot_be_simulated(make: Callable[[], object]) -> None:
    with pytest.raises(ValueError, match=r".") as refused:
        make()
    assert not re.search("[A-Za-z]{2}", AS_IT_IS.sub("", in_chinese(str(refused.value))))


def test_what_is_not_known_stands_as_it_is() -> None:
    assert simulated("something {else}").render(translator("zh")) == "something {else}"
    own = text("the shaft got stuck after {turns} turns", turns=2)
    assert simulation_error(RuntimeError(own)) == own
    assert simulation_error(ValueError("the shaft does not move: the rotor is stuck")).render(translator("zh")) == (
        "转轴不动：转子卡死"
    )
