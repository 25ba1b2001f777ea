"""What a moteus is set up for: read at its opening, set and given back, or refused with what to do."""

import struct
from collections.abc import Callable
from typing import Any

import pytest

from drivers.interfaces import CommunicationError, ReportedError
from drivers.mjbots.options import MoteusOptions
from drivers.mjbots.telemetry import decoder_of
from tests.drivers.mjbots.conftest import CONFIGURATION, schema

Opened = Callable[..., Any]


def test_what_may_be_set_is_set_and_given_back(opened: Opened, moteus: Any) -> None:
    moteus.configuration |= {"servo.fw.enable": "1", "servopos.position_max": "0.010000"}
    inverter = opened(maximum_voltage=30.0)
    assert moteus.set == [
        ("servo.fw.enable", "0"),
        ("servopos.position_max", "nan"),
        ("servo.max_current_A", "20.000000"),
        ("servo.max_voltage", "30.000000"),
    ]
    changed = {one.query: (one.found, one.wanted) for one in inverter.found_state if one.changed}
    assert changed["servo.max_current_A"] == ("100.000000", "20.000000")
    assert inverter.maximum_current == 20.0
    moteus.set.clear()
    inverter.close()
    assert moteus.set == [
        ("servo.max_voltage", "46.000000"),
        ("servo.max_current_A", "100.000000"),
        ("servopos.position_max", "0.010000"),
        ("servo.fw.enable", "1"),
    ]
    inverter.close()
    assert len(moteus.set) == 4


@pytest.mark.parametrize("most", [52.815870482657814, 123.4567891, 7.0000004, 0.381371211])
@pytest.mark.parametrize("said", ["{:g}", "{:f}"])
def test_a_limit_with_more_digits_than_the_drive_has_is_set(
    opened: Opened, moteus: Any, most: float, said: str
) -> None:
    """What the drive keeps is single precision, and what it says of it is rounded once more."""

    moteus.kept = lambda value: said.format(struct.unpack("<f", struct.pack("<f", float(value)))[0])
    moteus.configuration["servo.max_current_A"] = moteus.kept(repr(most))
    inverter = opened(maximum_current=most)
    assert inverter.maximum_current == pytest.approx(most, rel=1e-5)
    inverter.close()
    moteus.configuration["servo.max_current_A"] = moteus.kept("200")
    inverter = opened(maximum_current=most)
    assert inverter.maximum_current <= most * (1.0 + 1e-6)
    assert inverter.maximum_current == pytest.approx(most, rel=1e-5)


def test_nothing_is_given_back_under_power(opened: Opened, moteus: Any) -> None:
    inverter = opened()
    moteus.set.clear()
    moteus.mode = 9
    inverter.close()
    assert not moteus.set


@pytest.mark.parametrize(
    ("name", "value", "said"),
    [
        ("servo.voltage_mode_control", "1", "it is set to 1, but 0 is needed: its currents are not regulated"),
        ("servo.fixed_voltage_mode", "1", "its currents are at an angle that is not the rotor's"),
        ("servo.fixed_voltage_mode", "1", "conf set servo.fixed_voltage_mode 0, then conf write"),
        ("motor.poles", "0", "motor.poles is 0. Calibrate it for the motor: moteus_tool --calibrate"),
        ("motor.poles", "7", "motor.poles is 7"),
        ("motor_position.output.sign", "0", "Set it to 1 or -1"),
        ("motor_position.rotor_to_output_ratio", "0.000000", "Set it to 1 where the motor has no gear"),
        ("servo.max_current_A", "many", "servo.max_current_A is many"),
    ],
)
def test_what_may_not_be_set_is_refused_with_what_to_do(
    opened: Opened, moteus: Any, name: str, value: str, said: str
) -> None:
    moteus.configuration |= {"servo.fw.enable": "1", name: value}
    with pytest.raises(ReportedError) as caught:
        opened()
    assert name in str(caught.value)
    assert said in str(caught.value)
    # What was set before it was refused is put back.
    assert moteus.configuration["servo.fw.enable"] == "1"
    assert moteus.configuration["servo.max_current_A"] == {**CONFIGURATION, name: value}["servo.max_current_A"]


def test_another_motor_than_the_stations_is_refused(opened: Opened, moteus: Any) -> None:
    with pytest.raises(ReportedError, match=r"motor.poles is 14. The station file says pole_pairs = 4; correct it"):
        opened(pole_pairs=4)
    assert opened(pole_pairs=7).maximum_current == 20.0


def test_older_firmware_has_no_field_weakening_and_gains_of_its_own(opened: Opened, moteus: Any) -> None:
    del moteus.configuration["servo.fw.enable"], moteus.configuration["servo.pid_dq_hz"]
    moteus.configuration |= {"servo.pid_dq.kp": "0.005000", "servo.pid_dq.ki": "30.000000"}
    found = {one.query: one.found for one in opened().found_state}
    assert found["servo.pid_dq.ki"] == "30.000000"
    assert "servo.fw.enable" not in found


def test_one_without_a_needed_value_is_refused(opened: Opened, moteus: Any) -> None:
    del moteus.configuration["motor.poles"]
    with pytest.raises(ReportedError, match=r"it has no motor.poles: ERR error reading"):
        opened()


def test_a_value_that_is_not_kept_is_told(opened: Opened, moteus: Any) -> None:
    answer = moteus._answer
    moteus._answer = lambda line: b"OK\r\n" if line.startswith("conf set") else answer(line)
    with pytest.raises(ReportedError, match=r"is set to 100.000000, but 20.000000 is needed"):
        opened()


def test_a_stream_that_was_left_with_half_a_line_and_old_answers(opened: Opened, moteus: Any) -> None:
    moteus._line, moteus._out = b"conf get mot", b"emit servo_stats\r\n" + bytes(300)
    assert opened().maximum_current == 20.0


def test_a_stream_that_never_ends_is_told(opened: Opened, moteus: Any) -> None:
    stream = moteus._stream
    moteus._stream = lambda kind, rest: (stream(kind, rest), b"\x41\x01\x29" + bytes(41))[1]
    with pytest.raises(CommunicationError, match=r"its diagnostic stream does not end. End the program that uses it"):
        opened()


def test_an_answer_that_does_not_come_is_asked_for_once_more(opened: Opened, moteus: Any) -> None:
    answer, silent = moteus._answer, ["tel get servo_control"]

    def once_silent(line: str) -> bytes:
        if line in silent:
            silent.remove(line)
            return b""
        return bytes(answer(line))

    moteus._answer = once_silent
    inverter = opened()
    with inverter.driving_dq_current(0.0, 1.0):
        assert inverter.measure_dq().d_voltage == -1.25
        silent[:] = ["tel get servo_control"] * 2
        with pytest.raises(CommunicationError, match="no whole answer on its diagnostic stream"):
            inverter.measure_dq()
    assert moteus.mode == 0


def test_telemetry_without_the_voltages_is_told(opened: Opened, moteus: Any, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr("tests.drivers.mjbots.conftest.CONTROL", ("d_X", "q_X", "a", "b"))
    inverter = opened()
    with (
        pytest.raises(CommunicationError, match=r"its telemetry has no number d_V. Update its firmware"),
        inverter.driving_dq_current(0.0, 1.0),
    ):
        inverter.measure_dq()


def test_a_schema_of_every_type_that_the_firmware_uses() -> None:
    fields = (
        ("flag", b"\x02"),
        ("small", b"\x03\x01"),
        ("raw", b"\x04\x02"),
        ("count", b"\x06"),
        ("value", b"\x07"),
        ("precise", b"\x08"),
        ("nothing", b"\x01"),
        ("mode", b"\x11\x04\x01\x01\x00\x04stop"),
        ("three", b"\x13\x03\x04\x01"),
        ("maybe", b"\x15\x01\x03\x08\x00"),
        ("inner", schema(("a", b"\x07"))),
    )
    data = (
        b"\x01\xfe" + struct.pack("<H", 700) + b"\x81\x01" + struct.pack("<fd", 1.5, -2.25) + b"\x05"
        + b"\x01\x02\x03" + b"\x01" + struct.pack("<q", -9) + struct.pack("<f", 0.5)
    )  # fmt: skip
    assert decoder_of(schema(*fields))(data) == {
        "flag": True, "small": -2, "raw": 700, "count": 129, "value": 1.5, "precise": -2.25, "nothing": None,
        "mode": 5, "three": [1, 2, 3], "maybe": -9, "inner": {"a": 0.5},
    }  # fmt: skip
    with pytest.raises(ValueError, match="bytes"):
        decoder_of(schema(*fields))(data[:-1])
    with pytest.raises(ValueError, match="kind 7 of 2"):
        decoder_of(schema(("maybe", b"\x15\x01\x03\x08\x00")))(b"\x07")


@pytest.mark.parametrize("wrong", [b"", b"\x07", schema(("a", b"\x0f")), schema(("a", b"\x03\x03")), b"\x10\0\0\x05ab"])
def test_a_schema_that_is_none_is_refused(wrong: bytes) -> None:
    with pytest.raises(ValueError, match=r"schema|bytes"):
        decoder_of(wrong)


@pytest.mark.parametrize(
    ("key", "value"),
    [
        ("maximum_current", 0.0),
        ("maximum_voltage", -1.0),
        ("pole_pairs", 0),
        ("can_prefix", 8192),
        ("settle_timeout", float("inf")),
        ("current_tolerance", 0.0),
        ("sample_interval", float("nan")),
    ],
)
def test_options_that_cannot_be(key: str, value: Any) -> None:
    with pytest.raises(ValueError, match=f"^{key} = "):
        MoteusOptions(**{"maximum_current": 1.0, key: value})
