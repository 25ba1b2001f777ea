"""What the simulation says is told by its words: each sentence that it really says is known, and comes in Chinese."""

import math
import re
from collections.abc import Callable
from dataclasses import replace
from pathlib import Path
from typing import Any

import pytest

from bench.i18n.language import translator
from bench.i18n.simulated import simulated, simulation_error
from bench.motor.shipped_motors import motor_content
from bench.motor.six_step_file import load_drive
from bench.testing import virtual_motor
from drivers.interfaces.text import text
from sim_instruments.clock.virtual_clock import VirtualClock
from sim_instruments.physics.motor import defects
from sim_instruments.physics.motor.iron import Iron
from sim_instruments.physics.motor.motor import VirtualMotor
from sim_instruments.physics.motor.shorted_turns import ShortedTurns
from sim_instruments.six_step.drive import EmfHarmonic, SixStepError
from sim_instruments.six_step.load import balance_load
from sim_instruments.six_step.run_up import run_up
from sim_instruments.six_step.state import Bridge
from sim_instruments.six_step.steady_state import steady_state
from sim_instruments.world.machine_data import InverterStage
from sim_instruments.world.world import World
from tests.command_line import Call

#: Names of keys and of what stands in a file, units, and short names that are the same in both languages.
AS_IT_IS = re.compile(
    r"\[[\w.]+\]|'\w+'|“\w+”|\b\w+_\w+\b"
    r"|\b(inertia|connection|resistance|duration|delta|wye|rad/s|rad|rpm|EMF|V|A|H|N|iron|id|iq|nan|inf)\b"
    r"|[-\d.]+(e[-+]?\d+)?"
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


DRIVE = load_drive("92bl-30-25l")


def solved(speed: float, **changed: Any) -> object:
    return steady_state(Bridge(replace(DRIVE, **changed)), speed)


@pytest.mark.parametrize(
    "refused",
    [
        lambda: replace(DRIVE, resistance=math.nan),
        lambda: replace(DRIVE, source_voltage=0.0),
        lambda: replace(DRIVE, diode_drop=-1.0),
        lambda: replace(DRIVE, connection="star"),
        lambda: replace(DRIVE, pole_pairs=0),
        lambda: replace(DRIVE, mutual_inductance=1.0),
        lambda: replace(DRIVE, advance_angle=2.0),
        lambda: replace(DRIVE, emf_harmonics=(EmfHarmonic(2, 0.1, 0.0),)),
        lambda: replace(DRIVE, emf_harmonics=(EmfHarmonic(3, 0.1, 0.0),) * 2),
        lambda: replace(DRIVE, emf_harmonics=(EmfHarmonic(3, math.inf, 0.0),)),
        lambda: balance_load(Bridge(DRIVE), math.nan),
        lambda: balance_load(Bridge(replace(DRIVE, coulomb_friction=900.0)), 0.1),
        lambda: balance_load(Bridge(DRIVE), 900.0),
        lambda: balance_load(Bridge(DRIVE), -900.0),
        lambda: run_up(Bridge(DRIVE), -1.0),
        lambda: run_up(Bridge(DRIVE), math.nan),
        lambda: solved(0.0),
        lambda: solved(1e12),
        lambda: solved(100.0, resistance=1e-12, source_resistance=0.0, switch_resistance=0.0),
    ],
)
def test_a_drive_and_a_point_that_cannot_be_solved(refused: Callable[[], object]) -> None:
    with pytest.raises(SixStepError) as error:
        refused()
    assert not re.search("[A-Za-z]{2}", AS_IT_IS.sub("", in_chinese(str(error.value))))


@pytest.mark.parametrize(
    ("file", "line"),
    [("sim_instruments/six_step/state.py", "the diodes change more than 40 times in one state at 12.5 rad/s: check "
      "inductances, resistances and EMF harmonics of the motor"),
     ("sim_instruments/six_step/steady_state.py", "no periodic steady state found at 12.5 rad/s after 60 iterations "
      "(residual 0.1)")],
)  # fmt: skip
def test_what_no_drive_is_known_to_reach(file: str, line: str) -> None:
    """These ends no test can bring about: their words stand in the solver as they stand here, their values aside."""
    source = re.sub(r'"\s+f?"', "", (Path(__file__).parents[3] / file).read_text(encoding="utf-8"))
    said = [re.sub(r"\\{[^}]*\\}", "[^ )]+", re.escape(one)) for one in re.findall(r'f"([^"\n]+)"', source)]
    assert any(re.fullmatch(one, line) for one in said)
    assert not re.search("[A-Za-z]{2}", AS_IT_IS.sub("", in_chinese(line)))


def test_what_the_command_and_the_file_say_is_chinese(call: Call, tmp_path: Path) -> None:
    _, _, error = call("sim", "six-step", "92bl-30-25l", "--speed", "1e15", "--language", "zh")
    assert "此驱动器可求解" in error
    _, content, _ = motor_content("92bl-30-25l")
    file = tmp_path / "drive.toml"
    wrong = re.sub(rb"(?m)^mutual_inductance = \S+", b"mutual_inductance = 0.5", content)
    file.write_bytes(wrong)
    _, _, error = call("sim", "six-step", str(file), "--speed", "1000", "--language", "zh")
    assert "电感矩阵正定" in error


def test_what_is_not_known_stands_as_it_is() -> None:
    assert simulated("something {else}").render(translator("zh")) == "something {else}"
    own = text("the shaft got stuck after {turns} turns", turns=2)
    assert simulation_error(RuntimeError(own)) == own
    assert simulation_error(ValueError("the shaft does not move: the rotor is stuck")).render(translator("zh")) == (
        "转轴不动：转子卡死"
    )
