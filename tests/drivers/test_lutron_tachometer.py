"""Lutron tachometer: frames to the byte, and what may arrive instead."""

import math
from typing import Any

import pytest
import serial
from hypothesis import given
from hypothesis import strategies as st

from drivers.catalogue import Surroundings
from drivers.interfaces import Accuracy, CommunicationError, InstrumentError, MeasurementError
from drivers.lutron.frame import parse_frame
from drivers.lutron.options import LutronTachometerOptions
from drivers.lutron.tachometer import LutronTachometer

RPM = 2 * math.pi / 60
FRAME = b"\x024122010001600" + b"5\r"  # 1600.5 rpm: point 1, digits 00016005


class Port:
    """A port that gets what it is given when the clock moves."""

    def __init__(self, clock: Any, arrivals: list[bytes], waiting: bytes = b"") -> None:
        self.waiting = waiting
        self.arrivals = list(arrivals)
        self.closed = 0
        clock.on_sleep = self.arrive

    def arrive(self) -> None:
        if self.arrivals:
            self.waiting += self.arrivals.pop(0)

    def reset_input_buffer(self) -> None:
        self.waiting = b""

    def read_until(self, expected: bytes = b"\n", size: int | None = None) -> bytes:
        end = self.waiting.find(expected) + len(expected) or len(self.waiting)
        end = min(end or len(self.waiting), size or len(self.waiting))
        taken, self.waiting = self.waiting[:end], self.waiting[end:]
        return taken

    def close(self) -> None:
        self.closed += 1


def tachometer(clock: Any, *arrivals: bytes, waiting: bytes = b"", **options: Any) -> LutronTachometer:
    return LutronTachometer(Port(clock, list(arrivals), waiting), clock, LutronTachometerOptions(**options))


def test_the_frame_has_sixteen_characters() -> None:
    assert len(FRAME) == 16


def test_a_frame_in_radians_per_second(clock: Any) -> None:
    reading = tachometer(clock, FRAME).measure_speed()
    assert reading.value == pytest.approx(1600.5 * RPM)
    assert reading.unit == "rad/s"
    assert reading.time == clock.now() == pytest.approx(1.02)
    assert reading.accuracy.offset == pytest.approx(RPM)
    assert "typical of its class" in reading.accuracy.source
    assert reading.accuracy.resolution == pytest.approx(0.1 * RPM)


def test_an_old_frame_is_thrown_away(clock: Any) -> None:
    old = FRAME.replace(b"1600", b"0900")
    assert tachometer(clock, FRAME, waiting=old).measure_speed().value == pytest.approx(1600.5 * RPM)


def test_the_tail_of_a_frame_is_passed_over(clock: Any) -> None:
    assert tachometer(clock, FRAME[9:], FRAME).measure_speed().value == pytest.approx(1600.5 * RPM)
    assert clock.now() == pytest.approx(2.04)


def test_the_sign_is_not_the_direction(clock: Any) -> None:
    negative = FRAME[:5] + b"1" + FRAME[6:]
    assert tachometer(clock, negative).measure_speed().value == pytest.approx(1600.5 * RPM)


def test_stations_accuracy_and_annunciator(clock: Any) -> None:
    frame = FRAME[:3] + b"18" + FRAME[5:]
    accuracy = Accuracy(gain=5e-4, source="certificate")
    found = tachometer(clock, frame, annunciator="18", accuracy=accuracy).measure_speed().accuracy
    # What the station states holds; the display's last digit is the frame's to tell.
    assert (found.gain, found.offset, found.source) == (5e-4, 0.0, "certificate")
    assert found.resolution == pytest.approx(0.1 * RPM)


def test_a_stated_resolution_holds(clock: Any) -> None:
    accuracy = Accuracy(gain=5e-4, resolution=0.5, source="certificate")
    assert tachometer(clock, FRAME, accuracy=accuracy).measure_speed().accuracy is accuracy


@pytest.mark.parametrize(
    ("frame", "finding"),
    [
        (b"", "sends nothing"),
        (FRAME[:-1], "15 characters"),
        (b"\x03" + FRAME[1:], "no frame between"),
        (b"\x0242" + FRAME[3:], "display b'42'"),
        (FRAME[:3] + b" 2" + FRAME[5:], "annunciator"),
        (FRAME[:5] + b"2" + FRAME[6:], "polarity b'2'"),
        (FRAME[:6] + b"4" + FRAME[7:], "decimal point b'4'"),
        (FRAME[:7] + b" " + FRAME[8:], "digits"),
        (FRAME[:-1] + b"00\r", "18 characters"),
    ],
)
def test_broken_frames_name_the_field(clock: Any, frame: bytes, finding: str) -> None:
    with pytest.raises(CommunicationError, match=finding):
        tachometer(clock, frame).measure_speed()


def test_another_unit_is_no_speed(clock: Any) -> None:
    with pytest.raises(MeasurementError, match=r"annunciator 23 instead of 22.*Select rpm"):
        tachometer(clock, FRAME[:3] + b"23" + FRAME[5:]).measure_speed()


def test_beyond_the_range(clock: Any) -> None:
    with pytest.raises(MeasurementError, match=r"1600\.5 rpm is beyond"):
        tachometer(clock, FRAME, speed_limit=100.0).measure_speed()


@given(st.integers(0, 99_999_999), st.integers(0, 3), st.booleans())
def test_every_number_a_display_can_show(digits: int, point: int, negative: bool) -> None:
    raw = b"\x024122" + (b"1" if negative else b"0") + b"%d%08d\r" % (point, digits)
    frame = parse_frame(raw)
    assert frame.value == digits / 10**point
    assert frame.step == 1 / 10**point


@given(st.binary(max_size=40) | st.binary(min_size=13, max_size=13).map(lambda middle: b"\x0241" + middle + b"\r"))
def test_whatever_arrives_only_instrument_errors_come_out(data: bytes) -> None:
    class Still:
        on_sleep = None

        def now(self) -> float:
            return 0.0

        def sleep(self, seconds: float) -> None:
            self.on_sleep()

    try:
        reading = tachometer(Still(), data).measure_speed()
    except InstrumentError:
        return
    assert math.isfinite(reading.value)


def test_over_a_pyserial_url(clock: Any) -> None:
    traffic: list[Any] = []
    meter = LutronTachometer.open(
        "loop://",
        LutronTachometerOptions(),
        Surroundings(clock, traffic=lambda *entry: traffic.append(entry)),
        "tachometer",
    )
    port = meter._port
    assert isinstance(port, serial.SerialBase)
    clock.on_sleep = lambda: port.write(FRAME)
    assert meter.measure_speed().value == pytest.approx(1600.5 * RPM)
    assert traffic == [("read", repr(FRAME))]
    meter.make_safe()
    meter.close()
    meter.close()
    with pytest.raises(CommunicationError, match="the port fails"):
        meter.measure_speed()


def test_nothing_at_the_address(clock: Any) -> None:
    with pytest.raises(CommunicationError, match="cannot be opened at /dev/nothing"):
        LutronTachometer.open("/dev/nothing", LutronTachometerOptions(), Surroundings(clock), "tachometer")
