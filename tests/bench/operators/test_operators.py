import io
import itertools
import math
from collections.abc import Iterator
from dataclasses import replace
from pathlib import Path

import pytest
from rich.console import Console

from bench.i18n.errors import InputError
from bench.i18n.language import translator
from bench.motor.motor_file import load_motor
from bench.operators.answers import Answers, AnswersOperator, AnswersPrompt, load_answers
from bench.operators.person_prompt import PersonPrompt
from bench.operators.terminal import TerminalOperator
from bench.operators.virtual import VirtualOperator
from bench.safety.interrupts import Interrupted
from drivers.interfaces import OutputMode
from drivers.interfaces.text import text
from drivers.manual.drive import ManualDrive
from drivers.manual.options import ManualDriveOptions, ManualSupplyOptions
from drivers.manual.supply import ManualSupply
from procedures.core.actions import (
    ALIGN_D,
    ALL_OPEN,
    ConnectProbes,
    ConnectVoltmeter,
    CoupleDynamometer,
    CurrentProbe,
    DisconnectVoltmeter,
    DoByHand,
    EnterReading,
    LockRotor,
    MarkRestPositions,
    Mend,
    Node,
    ReleaseRotor,
    SeparateMeterLeads,
    ShortMeterLeads,
    StartTurning,
    StopTurning,
    Terminal,
    TurnToRest,
    UncoupleDynamometer,
    VoltageProbe,
)
from procedures.core.bench import ProcedureError
from procedures.core.events import RepeatStarted, StepStarted
from sim_instruments.clock.virtual_clock import VirtualClock
from sim_instruments.world.world import World
from tests.bench.operators.asking import Asking

READING = EnterReading("winding_temperature", text("the winding's temperature"), "°C", -50.0, 200.0)


def typing(lines: list[str]) -> tuple[TerminalOperator, io.StringIO]:
    said = io.StringIO()
    console = Console(file=said, width=100, color_system=None)
    left = iter(lines)

    def ask(question: str) -> str:
        said.write(question + "\n")
        try:
            return next(left)
        except StopIteration:
            raise EOFError from None

    return TerminalOperator(console, translator("en"), {"A": "white"}, ask), said


def test_an_action_is_printed_with_colours_and_waits() -> None:
    operator, said = typing([""])
    assert operator.perform(ALIGN_D) is None
    assert "A (white) → supply, plus" in said.getvalue()
    assert "B → supply, minus" in said.getvalue()


@pytest.mark.parametrize("word", ["", "y", "Done", "是", "完成"])
def test_what_says_that_it_is_done(word: str) -> None:
    operator, said = typing([word])
    assert operator.perform(ALIGN_D) is None
    assert said.getvalue().count("Done? Press Enter") == 1


@pytest.mark.parametrize(
    ("word", "told"),
    [
        ("no", "The run waits until this is done; Ctrl-C ends the run and switches everything off"),
        ("31 mOhm", "no input is needed here, and '31 mOhm' is not stored: press Enter when the work is done"),
    ],
)
def test_a_no_or_a_reading_does_not_pass_for_done(word: str, told: str) -> None:
    operator, said = typing([word, ""])
    assert operator.perform(ALIGN_D) is None
    assert told in said.getvalue()
    assert said.getvalue().count("Done? Press Enter") == 2


def test_a_reading_is_asked_again_until_it_makes_sense() -> None:
    operator, said = typing(["warm", "", "nan", "2500", " 23,5 °C "])
    assert operator.perform(READING) == 23.5
    assert "'warm' is not a number" in said.getvalue()
    assert "2500 °C is outside -50 … 200 °C" in said.getvalue()
    assert said.getvalue().count("Enter the winding's temperature in °C (-50 … 200)") == 5


def test_instruments_set_by_hand_reach_the_same_person() -> None:
    operator, said = typing(["", "x", "2", "1500"])
    prompt = PersonPrompt(operator, "supply")
    prompt.confirm(text("Switch the supply's output on."))
    assert prompt.ask(text("regulation: 0 off, 1 on"), "", 0, 3, None) == 2.0
    assert prompt.ask(text("speed"), "rpm", 0, 5000, text("of the shaft")) == 1500.0
    assert "DC supply: Switch the supply's output on." in said.getvalue()
    assert "Enter DC supply, regulation: 0 off, 1 on (0 … 3)" in said.getvalue()
    assert "Enter DC supply, speed of the shaft in rpm (0 … 5000)" in said.getvalue()


def test_angles_are_typed_in_degrees() -> None:
    operator, said = typing(["ten", "", "0 90 180,5; 270"])
    assert operator.perform(MarkRestPositions()) == pytest.approx(
        [0.0, math.pi / 2, math.radians(180.5), 1.5 * math.pi]
    )
    assert "not a list of angles" in said.getvalue()


def test_angles_are_typed_in_chinese() -> None:
    operator, _ = typing(["０　９０度、180.5 270°"])
    assert operator.perform(MarkRestPositions()) == pytest.approx(
        [0.0, math.pi / 2, math.radians(180.5), 1.5 * math.pi]
    )


def test_the_end_of_the_input_aborts() -> None:
    operator, _ = typing([])
    with pytest.raises(Interrupted, match="end of the input"):
        operator.perform(LockRotor())


def test_wiring_is_put_right_or_given_up() -> None:
    mend = Mend(
        text("B (green) is open: the wire is off, or its phase is broken"), tuple(ALIGN_D.lines({"B": "green"}))
    )
    operator, said = typing(["P-0007", "", "n"])
    assert operator.perform(mend) is True
    assert "'P-0007' is no answer here" in said.getvalue(), "a scanner's line has nothing measured again"
    assert "Correct the wiring: B (green) is open" in said.getvalue()
    assert "B (green) → supply, minus" in said.getvalue()
    assert operator.perform(mend) is False
    assert "type n to give up" in said.getvalue()


def test_other_work_of_hands_is_said_in_the_procedure_s_own_words() -> None:
    operator, said = typing([""])
    assert operator.perform(DoByHand(text("Shut the {what}", what="hatch"))) is None
    assert "▶ Shut the hatch" in said.getvalue()


def test_chinese_is_spoken() -> None:
    said = io.StringIO()
    console = Console(file=said, width=100, color_system=None)
    operator = TerminalOperator(console, translator("zh"), {}, lambda _: "")
    operator.perform(ALL_OPEN)
    ManualSupply(PersonPrompt(operator, "supply"), VirtualClock(), ManualSupplyOptions(48.0, 5.0)).configure(1.0, 2.0)
    assert "连接电机端子" in said.getvalue()
    assert "直流电源: 将电源设为 1 V，限流 2 A；如有过流保护，请打开。" in said.getvalue()


@pytest.fixture
def answers(tmp_path: Path) -> Path:
    path = tmp_path / "answers.toml"
    path.write_text(
        "[readings]\nwinding_temperature = [20.0, 21]\nrest_positions_deg = [[0, 180], [5, 95, 185, 275]]\n",
        encoding="utf-8",
    )
    return path


def test_answers_are_given_in_order_and_run_out(answers: Path) -> None:
    operator = AnswersOperator(load_answers(answers))
    assert operator.perform(LockRotor()) is None
    assert [operator.perform(READING), operator.perform(READING)] == [20.0, 21.0]
    assert operator.perform(MarkRestPositions()) == pytest.approx([0.0, math.pi])
    with pytest.raises(ProcedureError, match=r"winding_temperature have run out; still asked is 'Enter the winding's"):
        operator.perform(READING)
    with pytest.raises(ProcedureError, match=r"no answers for winding_temprature.*did you mean winding_temperature"):
        operator.perform(EnterReading("winding_temprature", text("x"), "°C", 0.0, 1.0))


def test_answers_that_run_out_after_a_doubted_reading_say_where_one_more_belongs() -> None:
    given = Answers({"lcr_meter.resistance": [0.032, 0.32, 0.032]}, "answers.toml")
    prompt = AnswersPrompt(given, "lcr_meter")

    def ask(number: int, count: int, *, again: bool = False) -> float:
        given.hear(RepeatStarted(terminals="A–B", number=number, count=count, again=again))
        return prompt.ask(text("resistance Rs"), "Ω", 0.0, 1.0, None)

    given.hear(StepStarted(step="3.2.2/3", text="Measure", time=0.0))
    assert [ask(1, 2), ask(2, 2), ask(2, 2, again=True)] == [0.032, 0.32, 0.032]
    with pytest.raises(ProcedureError) as stop:
        ask(1, 2)
    said = str(stop.value)
    assert "at step 3.2.2/3, A–B, reading 1 of 2. Add number 4 to readings.lcr_meter.resistance" in said
    assert "needs one more answer. Insert that answer as number 3 (step 3.2.2/3, A–B, reading 2 of 2)" in said


def test_an_answer_out_of_range_is_refused(answers: Path) -> None:
    operator = AnswersOperator(load_answers(answers))
    with pytest.raises(ProcedureError, match=r"the answer 20 to winding_temperature is outside 0 … 10 °C"):
        operator.perform(EnterReading("winding_temperature", text("x"), "°C", 0.0, 10.0))
    with pytest.raises(ProcedureError, match=r"21 °C to winding_temperature is unusual \(usual are 22 … 45 °C\)"):
        operator.perform(EnterReading("winding_temperature", text("x"), "°C", -60.0, 250.0, (22.0, 45.0)))


@pytest.mark.parametrize(
    ("content", "said"),
    [
        ("[reading]\na = 1\n", "unknown key reading; did you mean readings"),
        ('[readings]\na = "16 mOhm"\n', "readings.a = '16 mOhm'; give numbers without units"),
        ("readings = 3\n", r"allowed is a table \[readings\]"),
        ("[readings\n", "not valid TOML"),
    ],
)
def test_bad_answers_files_are_refused(tmp_path: Path, content: str, said: str) -> None:
    path = tmp_path / "answers.toml"
    path.write_text(content, encoding="utf-8")
    with pytest.raises(InputError, match=said):
        load_answers(path)


@pytest.fixture
def world() -> Iterator[World]:
    return World(load_motor("lg-400w").virtual_motor(), VirtualClock(), seed=3)


def aligning(world: World, seed: int = 0) -> Asking:
    """Hands that have connected the motor for its d axis to a supply that is on."""
    hands = Asking(VirtualOperator(world, seed), world.clock)
    hands.perform(ALIGN_D)
    world.supply.set_voltage(5.0)
    world.supply.set_current_limit(2.9)
    world.supply.switch(True)
    return hands


def test_the_virtual_operator_marks_every_rest_position(world: World) -> None:
    hands = aligning(world, 3)
    hands.perform(TurnToRest())
    marks = hands.perform(MarkRestPositions())
    assert isinstance(marks, list)
    # The fifth is the first one come round again.
    assert len(marks) == 5
    spacings = [math.degrees(b - a) for a, b in itertools.pairwise(marks)]
    assert spacings == pytest.approx([90.0] * 4, abs=4.0)
    assert hands.hand_time > 15.0


def test_one_pole_pair_comes_round_once_a_turn() -> None:
    motor = load_motor("lg-400w").virtual_motor()
    world = World(
        replace(motor, pole_pairs=1, flux_linkage=4.0 * motor.flux_linkage, cogging_torque=0.0), VirtualClock(), seed=3
    )
    hands = aligning(world, 3)
    hands.perform(TurnToRest())
    first, last = hands.perform(MarkRestPositions())
    assert math.degrees(last - first) == pytest.approx(360.0, abs=4.0)


def test_nobody_locks_a_shaft_that_still_swings(world: World) -> None:
    hands = aligning(world)
    hands.perform(LockRotor())
    locked = world.dial_angle()
    hands.perform(ReleaseRotor())
    world.clock.sleep(5.0)
    assert world.dial_angle() == pytest.approx(locked, abs=1e-3)


def test_the_virtual_operator_wires_locks_and_couples(world: World) -> None:
    hands = Asking(VirtualOperator(world), world.clock)
    hands.perform(ALIGN_D)
    assert world.truth()["wiring"] == {"A": "supply+", "B": "supply-", "C": "supply-"}
    hands.perform(LockRotor())
    assert world.truth()["rotor_locked"]
    with pytest.raises(ProcedureError, match="the rotor is locked"):
        hands.perform(StartTurning(0.1))
    hands.perform(CoupleDynamometer())
    assert world.truth()["dynamometer_coupled"]
    assert world.truth()["rotor_locked"]
    hands.perform(UncoupleDynamometer())
    hands.perform(ReleaseRotor())
    hands.perform(StartTurning(0.5))
    world.clock.sleep(1.0)
    assert world.truth()["shaft_speed"] == pytest.approx(0.5, rel=0.2)
    hands.perform(ConnectVoltmeter(Terminal.A, Terminal.B))
    assert world.voltmeter_voltage(0.0) != 0.0
    hands.perform(DisconnectVoltmeter())
    assert world.voltmeter_voltage(0.0) == 0.0
    hands.perform(StopTurning())
    assert world.truth()["shaft_speed"] == 0.0
    hands.perform(ShortMeterLeads())
    assert world.truth()["leads_shorted"]
    hands.perform(SeparateMeterLeads())
    assert not world.truth()["leads_shorted"]
    hands.perform(ConnectProbes((VoltageProbe(1, Node.A, Node.B), CurrentProbe(4, Terminal.A))))
    temperature = hands.perform(READING)
    assert temperature == pytest.approx(25.0, abs=1.0)
    with pytest.raises(ProcedureError, match="maximum_current"):
        hands.perform(EnterReading("maximum_current", text("x"), "A", 0.0, 1.0))


def test_a_seed_decides_the_hand(world: World) -> None:
    first, second, third = (VirtualOperator(world, seed).perform(READING) for seed in (1, 1, 2))
    assert first == second != third


def test_the_virtual_operator_feels_a_stuck_shaft(world: World) -> None:
    hands = VirtualOperator(world)
    world.set_stuck_rotor(True)
    for action in (StartTurning(0.5), TurnToRest()):
        with pytest.raises(ProcedureError, match="the shaft does not move: the rotor is stuck"):
            hands.perform(action)
    world.set_stuck_rotor(False)
    hands.perform(StartTurning(0.5))
    world.clock.sleep(2.0)
    world.set_stuck_rotor(True)
    world.clock.sleep(10.0)
    with pytest.raises(ProcedureError, match=r"the shaft got stuck after 0\.1\d turns"):
        hands.perform(StopTurning())


@pytest.mark.parametrize(
    "typed",
    [
        *("1", "01", "cc", " CC ", "Constant Current", "1 constant current (CC)"),
        *("１", "ＣＣ", "恒流", "1 恒流（CC）", "1 恒流 (CC)", "恒流 (CC)"),
    ],
)
def test_one_of_fixed_answers_is_typed_by_its_number_its_sign_or_its_name(typed: str) -> None:
    operator, said = typing(["", "4", "1.0", "C", typed])
    made = ManualSupply(PersonPrompt(operator, "supply"), VirtualClock(), ManualSupplyOptions(48.0, 5.0))
    assert made.output_mode() is OutputMode.CONSTANT_CURRENT
    told = said.getvalue()
    assert told.count("Choose DC supply, regulation, by the lamp that is lit: 0 off, 1 constant current (CC), ") == 5
    assert "Choose one of the answers first." in told
    for refused in ("4", "1.0", "C"):
        assert f"'{refused}' is not one of the answers; choose from 0 off, 1 constant current (CC), " in told


def test_the_words_that_a_choice_shows_in_chinese_are_taken() -> None:
    said: list[str] = []
    replies = iter(["恒定", "恒流"])

    def ask(question: str) -> str:
        said.append(question)
        return next(replies)

    printed = io.StringIO()
    console = Console(file=printed, width=200, color_system=None)
    operator = TerminalOperator(console, translator("zh"), {}, ask)
    made = ManualSupply(PersonPrompt(operator, "supply"), VirtualClock(), ManualSupplyOptions(48.0, 5.0))
    assert made.output_mode() is OutputMode.CONSTANT_CURRENT
    assert "1 恒流" in said[0]
    assert "“恒定”" in printed.getvalue()


def test_hall_signals_are_typed_with_their_leading_zeros() -> None:
    operator, said = typing(["2", "010"])
    drive = ManualDrive(PersonPrompt(operator, "drive"), VirtualClock(), ManualDriveOptions(60.0, 10.0))
    assert drive.hall_state() == (False, True, False)
    assert "each 0 or 1: 000, 001, 010, 011, 100, 101, 110, 111" in said.getvalue()
