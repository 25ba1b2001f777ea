"""A moteus on a bus of CAN FD: bytes that are sent, currents, readings, and how it is stopped."""

import math
from collections.abc import Callable
from contextlib import suppress
from itertools import pairwise
from typing import Any

import pytest

from drivers.interfaces import (
    AbilityError,
    Accuracy,
    CommunicationError,
    IdentityError,
    InstrumentError,
    InverterAbility,
    MeasurementError,
    ReportedError,
    SetpointError,
)

Opened = Callable[..., Any]


def test_it_says_who_it_is_and_what_it_can_do(opened: Opened) -> None:
    inverter = opened()
    assert inverter.identity.manufacturer == "mjbots"
    assert inverter.identity.firmware == "1.3.4"
    assert inverter.identity.serial_number == "ESIzRP////5VZneI"
    assert inverter.abilities == frozenset(InverterAbility) - {InverterAbility.FREQUENCY}
    assert inverter.watchdog is None
    assert (inverter.maximum_current, inverter.maximum_frequency) == (20.0, 0.0)


def test_frames_to_the_byte_and_with_a_fast_phase(opened: Opened, moteus: Any, bus: Any) -> None:
    inverter = opened()
    moteus.requests.clear()
    with inverter.driving_dq_current(-2.0, 1.5):
        pass
    sent = [(f"{identifier:X}", data) for identifier, data in moteus.requests]
    # Mode 0 and the question for mode and fault; mode 9 with q and d. Each has a source of its own.
    stop, command, state = "0100001100110f", "0100090e1c0000c03f000000c01100110f50505050"[:40], "1100110f"
    assert [data for _, data in sent if not data.startswith("1100" + "1d")] == [
        stop, state, command, state, stop, state, "1e04",
    ]  # fmt: skip
    sources = [int(identifier, 16) >> 8 & 0x7F for identifier, _ in sent]
    assert all(0x10 <= source < 0x20 for source in sources)
    assert all(a != b for a, b in pairwise(sources))
    assert all(frame.is_fd and frame.bitrate_switch and frame.is_extended_id for frame in bus.frames)


def test_currents_are_regulated_in_a_block_and_stopped_at_its_end(opened: Opened, moteus: Any) -> None:
    inverter = opened()
    with inverter.driving_dq_current(-3.0, 4.0):
        assert (moteus.mode, moteus.d, moteus.q) == (9, -3.0, 4.0)
        inverter.set_dq_current(0.5, -1.0)
        assert (moteus.d, moteus.q) == (0.5, -1.0)
        inverter.command_zero()
        assert (moteus.mode, moteus.d, moteus.q) == (9, 0.0, 0.0)
    assert moteus.mode == 0
    with inverter.driving_current(2.5):
        assert (moteus.d, moteus.q) == (0.0, 2.5)
        inverter.set_current(-2.5)
        assert (moteus.d, moteus.q) == (0.0, -2.5)
    assert moteus.mode == 0


def test_it_goes_through_its_start(opened: Opened, moteus: Any) -> None:
    moteus.starting = [2, 3, 4]
    with opened().driving_dq_current(1.0, 2.0):
        assert (moteus.mode, moteus.d, moteus.q) == (9, 1.0, 2.0)


def test_a_reading_in_the_rotors_frame(opened: Opened, moteus: Any) -> None:
    inverter = opened(current_accuracy=Accuracy(gain=0.005, source="calibration"))
    with inverter.driving_dq_current(-3.0, 4.0):
        found = inverter.measure_dq()
    assert (found.d_current, found.q_current) == (-3.0, 4.0)
    assert (found.d_voltage, found.q_voltage) == (-1.25, 3.5)
    # 2.5 turns a second of a rotor with 7 pole pairs.
    assert found.electrical_speed == pytest.approx(2.0 * math.pi * 17.5)
    assert found.electrical_angle == pytest.approx(1.5)
    assert (found.bus_voltage, found.board_temperature, found.winding_temperature) == (24.0, 31.5, 42.25)
    assert (found.samples, found.duration) == (1, 0.0)
    assert found.current_accuracy.gain == 0.005
    assert "the maker states no accuracy" in found.voltage_accuracy.source
    assert inverter.measure_frequency().value == pytest.approx(17.5)


def test_a_reading_is_the_mean_of_what_comes_within_its_time(opened: Opened, moteus: Any) -> None:
    inverter = opened(sample_interval=0.01)
    values = iter(range(100))
    moteus_register = moteus._register
    moteus._register = lambda number: float(next(values)) if number == 0x00D else moteus_register(number)
    with inverter.driving_dq_current(0.0, 1.0):
        values = iter(range(100))
        found = inverter.measure_dq(0.1)
    assert found.samples == 11
    assert found.duration == pytest.approx(0.1)
    assert found.bus_voltage == pytest.approx(sum(range(11)) / 11)


def test_a_reversed_output_and_a_gear(opened: Opened, moteus: Any) -> None:
    moteus.configuration |= {
        "motor_position.output.sign": "-1",
        "motor_position.rotor_to_output_ratio": "0.250000",
        "servo.enable_motor_temperature": "0",
    }
    found = opened().measure_dq()
    assert found.electrical_speed == pytest.approx(2.0 * math.pi * 2.5 * 4 * 7)
    assert found.electrical_angle == pytest.approx(2.0 * math.pi - 1.5)
    assert math.isnan(found.winding_temperature)
    # It is stopped, but puts out nothing.
    assert math.isnan(found.d_voltage)
    assert math.isnan(found.q_voltage)


@pytest.mark.parametrize("code", range(96, 106))
def test_a_limited_output_gives_no_reading_and_no_point(opened: Opened, moteus: Any, code: int) -> None:
    inverter = opened(settle_timeout=0.1)
    with inverter.driving_dq_current(0.0, 1.0):
        moteus.code = code
        with pytest.raises(MeasurementError, match=rf"limited by .* \(code {code}\): this reading is not used"):
            inverter.measure_dq()
        with pytest.raises(MeasurementError, match=rf"limited by .* \(code {code}\)"):
            inverter.set_dq_current(0.0, 2.0)
    assert moteus.mode == 0


def test_currents_that_do_not_come_are_told(opened: Opened, moteus: Any) -> None:
    moteus.shortfall = 0.5
    with (
        pytest.raises(MeasurementError, match=r"the currents are 0 A and 2\.5 A 0\.1 s after mode 9, d 0 A, q 5 A"),
        opened(settle_timeout=0.1).driving_dq_current(0.0, 5.0),
    ):
        raise AssertionError("it is not entered")
    assert moteus.mode == 0


@pytest.mark.parametrize(("d", "q"), [(21.0, 0.0), (0.0, -21.0), (15.0, 15.0), (math.nan, 0.0), (0.0, math.inf)])
def test_beyond_the_stations_limit_nothing_is_sent(opened: Opened, moteus: Any, d: float, q: float) -> None:
    inverter = opened()
    moteus.requests.clear()
    for call in (inverter.driving_dq_current, inverter.set_dq_current):
        with pytest.raises(SetpointError, match="the limit of the station; nothing was sent"):
            enter(call(d, q))
    assert not moteus.requests


def test_the_drives_own_limit_holds_where_it_is_less(opened: Opened, moteus: Any) -> None:
    moteus.configuration["servo.max_current_A"] = "8.000000"
    inverter = opened()
    assert inverter.maximum_current == 8.0
    with pytest.raises(SetpointError, match=r"outside -8 … 8 A, the limit of the drive \(servo.max_current_A\)"):
        inverter.set_dq_current(0.0, 9.0)
    with inverter.driving_dq_current(0.0, 8.0):
        assert moteus.q == 8.0


def enter(block: Any) -> None:
    with block:
        pass


def test_what_it_does_not_offer_and_what_needs_a_block_is_refused(opened: Opened, moteus: Any) -> None:
    inverter = opened()
    moteus.requests.clear()
    with pytest.raises(AbilityError, match="moteus: this inverter does not offer a frequency at a current"):
        inverter.driving_frequency(1.0, 1.0)
    for call in (inverter.set_current, lambda q: inverter.set_dq_current(0.0, q)):
        with pytest.raises(InstrumentError, match="it regulates no current; nothing was sent"):
            call(1.0)
    assert not moteus.requests


def test_one_that_was_stopped_by_somebody_else_is_not_started_again(opened: Opened, moteus: Any) -> None:
    inverter, guard = opened(), opened(guarding=True)
    with inverter.driving_dq_current(0.0, 1.0):
        guard.make_safe()
        assert moteus.mode == 0
        with pytest.raises(ReportedError, match=r"it regulates no current, its mode is 0 \(stopped\)"):
            inverter.set_dq_current(0.0, 2.0)
    assert 9 not in moteus.modes[moteus.modes.index(9) + 1 :]


def test_whoever_guards_asks_nothing_and_stops_it(opened: Opened, moteus: Any) -> None:
    moteus.mode, moteus.q = 9, 5.0
    guard = opened(guarding=True)
    assert not moteus.requests
    guard.make_safe()
    assert moteus.mode == 0
    assert all(0x20 <= identifier >> 8 & 0x7F < 0x30 for identifier, _ in moteus.requests)
    # What a shutdown sequence measures.
    assert guard.measure_current().value == 0.0
    assert guard.measure_frequency().value == pytest.approx(2.5)
    guard.close()
    assert not moteus.set


@pytest.mark.parametrize("moment", range(1, 40))
def test_however_a_run_breaks_off_it_is_stopped(opened: Opened, moteus: Any, moment: int) -> None:
    class StruckError(Exception):
        pass

    inverter = opened()
    count = 0
    exchange = inverter._controller.exchange

    def strikes(*given: Any, **named: Any) -> Any:
        nonlocal count
        count += 1
        reply = exchange(*given, **named)
        if count == moment:
            raise StruckError
        return reply

    inverter._controller.exchange = strikes
    with suppress(StruckError), inverter.driving_dq_current(0.0, 1.0):
        inverter.set_dq_current(1.0, 0.0)
        inverter.measure_dq(0.01)
    assert moteus.mode == 0
    inverter._controller.exchange = exchange


def test_a_fault_is_named_and_the_stage_stopped(opened: Opened, moteus: Any) -> None:
    inverter = opened()
    fault = "the drive is in fault 34: the bus voltage was above"
    # The end of the block finds it as well.
    with pytest.raises(ReportedError, match=fault), inverter.driving_dq_current(0.0, 1.0):  # noqa: PT012
        moteus.mode, moteus.code = 1, 34
        with pytest.raises(ReportedError, match=fault):
            inverter.measure_dq()
    assert moteus.mode == 0
    moteus.mode, moteus.code = 1, 33
    with pytest.raises(ReportedError, match="fault 33: its gate driver"):
        inverter.make_safe()
    assert moteus.mode == 0


def test_a_fault_that_was_found_is_told_and_then_cleared(opened: Opened, moteus: Any) -> None:
    inverter = opened()
    moteus.mode, moteus.code = 1, 35
    with pytest.raises(ReportedError, match="fault 35: its encoder is at fault"):
        enter(inverter.driving_dq_current(0.0, 1.0))
    assert 9 not in moteus.modes
    with inverter.driving_dq_current(0.0, 1.0):
        assert moteus.mode == 9


def test_a_fault_while_it_starts_is_named(opened: Opened, moteus: Any) -> None:
    moteus.starting = [2, 1]
    moteus_command = moteus._command

    def command(mode: int, written: Any) -> None:
        moteus_command(mode, written)
        if mode == 9:
            moteus.code = 36

    moteus._command = command
    with (
        pytest.raises(ReportedError, match="fault 36: it is not calibrated for a motor"),
        opened().driving_dq_current(0.0, 1.0),
    ):
        raise AssertionError("it is not entered")


def test_a_stop_that_is_not_taken_is_told(opened: Opened, moteus: Any) -> None:
    inverter = opened(transition_timeout=0.05)
    with (
        pytest.raises(
            ReportedError, match=r"stays in mode 9 \(d- and q-axis current\) after a stop. Switch its supply off"
        ),
        inverter.driving_dq_current(0.0, 1.0),
    ):
        moteus.deaf = {0}
    moteus.deaf = set()
    inverter.make_safe()
    assert moteus.mode == 0


def test_a_current_that_flows_on_is_told(opened: Opened, moteus: Any) -> None:
    inverter, register = opened(transition_timeout=0.05), moteus._register
    moteus._register = lambda number: 3.0 if number == 0x004 else register(number)
    with pytest.raises(ReportedError, match=r"is stopped, but 3 A still flow. Switch its supply off"):
        enter(inverter.driving_dq_current(0.0, 3.0))
    moteus._register = register
    inverter.make_safe()


def test_a_start_that_is_not_taken_is_told(opened: Opened, moteus: Any) -> None:
    moteus.deaf = {9}
    with (
        pytest.raises(ReportedError, match=r"it regulates no current, its mode is 0 \(stopped\)"),
        opened(transition_timeout=0.05).driving_dq_current(0.0, 1.0),
    ):
        raise AssertionError("it is not entered")


def test_zero_is_commanded_in_whatever_mode_it_was_left(opened: Opened, moteus: Any) -> None:
    inverter = opened()
    moteus.requests.clear()
    inverter.command_zero()
    assert moteus.modes == []
    for left in (10, 11, 1):
        moteus.mode = left
        inverter.command_zero()
        assert moteus.mode == 0


@pytest.mark.parametrize("lost", [1, 2])
def test_lost_replies_are_asked_for_again(opened: Opened, moteus: Any, lost: int) -> None:
    inverter = opened()
    with inverter.driving_dq_current(0.0, 1.0):
        moteus.lost = lost
        inverter.set_dq_current(0.0, 2.0)
        assert moteus.q == 2.0
        moteus.lost = 1
        assert inverter.measure_dq().d_voltage == -1.25


def test_a_silent_one_is_told_and_a_bus_is_opened_anew_to_stop_it(opened: Opened, moteus: Any) -> None:
    inverter = opened()
    with inverter.driving_dq_current(0.0, 1.0):
        moteus.lost = 3
        with pytest.raises(CommunicationError, match=r"after 'read registers': no reply. Check node, can_prefix"):
            inverter.measure_dq()
        # The three of the first stop: the second one gets through.
        moteus.lost = 3
    assert moteus.mode == 0


def test_a_late_reply_is_not_taken_for_anothers(opened: Opened, moteus: Any, bus: Any) -> None:
    inverter = opened()
    with inverter.driving_dq_current(0.0, 1.0):
        late = moteus.take(0x9001, bytes.fromhex("1d0d"))
        moteus.bus = 30.0
        take = bus._moteus.take
        bus._moteus.take = lambda *frame: (take(*frame), late)[1]
        # Sixteen sources: the late one's comes round, but not within three questions.
        inverter._controller._sources = iter([0x11, 0x12, 0x13])
        with pytest.raises(CommunicationError):
            inverter._readings.registers()
        bus._moteus.take = take
        inverter._controller._sources = iter(range(0x14, 0x20))
        assert inverter._readings.registers()[0x00D] == 30.0


def test_nobody_there(opened: Opened, bus: Any) -> None:
    with pytest.raises(CommunicationError, match="inverter after 'read 0x101, 0x102, 0x120': no reply"):
        opened("can://virtual/moteus?node=2")
    with pytest.raises(CommunicationError, match="no reply"):
        opened("can://virtual/elsewhere?node=1")


def test_another_one_answers(opened: Opened) -> None:
    with pytest.raises(IdentityError, match=r"serial number ESIzRP////5VZneI answers, expected 7"):
        opened(serial_number="7")


def test_other_registers_are_refused(opened: Opened, moteus: Any) -> None:
    moteus.map_version = 3
    with pytest.raises(ReportedError, match="its register map has version 3, known are 4, 5"):
        opened()


def test_a_prefix_goes_before_every_identifier(opened: Opened, moteus: Any) -> None:
    opened(can_prefix=0x123).measure_current()
    assert {identifier >> 16 for identifier, _ in moteus.requests} == {0x123}


def test_its_frames_are_told_as_candump_writes_them(opened: Opened) -> None:
    told: list[tuple[str, str, bytes]] = []
    inverter = opened(wire=lambda *one: told.append(one))
    told.clear()
    inverter.measure_current()
    (sent, came) = told
    assert sent[:2] == ("can", ">")
    assert sent[2].partition(b"##1")[2].startswith(b"1100")
    assert came[:2] == ("can", "<")
    assert came[2].startswith(b"11")
