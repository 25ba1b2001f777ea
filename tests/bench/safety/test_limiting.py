"""Limits of the motor and of the station stand in front of every instrument: beyond them nothing is sent."""

import math
import re
from collections.abc import Callable, Iterator
from typing import Any

import pytest
from hypothesis import given
from hypothesis import strategies as st

from drivers.interfaces import LimitError, SetpointError

Counted = Any
MakeCounted = Callable[..., Any]

#: The least limits of a motor and of a station that a set point can meet, one a row: role, call, what is refused, whose it is.
STATION = {
    "supply": {"maximum_voltage": 4.0, "maximum_current": 6.0},
    "lcr_meter": {"maximum_level": 1.5, "maximum_frequency": 1e5},
    "inverter": {"maximum_current": 20.0, "maximum_frequency": 60.0},
    "dynamometer": {"maximum_speed": 200.0, "maximum_torque": 2.0},
}
MOTOR = {"maximum_voltage": 3.0, "rated_voltage": None, "maximum_current": 5.0, "maximum_speed_rpm": 600.0}


def station_says(role: str, key: str) -> str:
    return f"the station (instruments.{role}.limits.{key})"


def motor_says(key: str) -> str:
    return f"the motor (nameplate.{key})"


SPEED = 600.0 * math.pi / 30.0

CASES: list[tuple[str, str, tuple[float, ...], str, float, str, str]] = [
    # owner, role.call, arguments, parameter and value refused, limit, whose
    ("station", "supply.configure", (4.1, 1.0), "voltage = 4.1 V", 4.0, station_says("supply", "maximum_voltage")),
    (
        "station",
        "supply.energised",
        (1.0, 6.1),
        "current limit = 6.1 A",
        6.0,
        station_says("supply", "maximum_current"),
    ),
    (
        "station",
        "lcr_meter.configure",
        (1e3, 1.6),
        "level = 1.6 V rms",
        1.5,
        station_says("lcr_meter", "maximum_level"),
    ),
    (
        "station",
        "lcr_meter.configure",
        (2e5, 1.0),
        "frequency = 200000 Hz",
        1e5,
        station_says("lcr_meter", "maximum_frequency"),
    ),
    (
        "station",
        "inverter.driving_frequency",
        (-61.0, 1.0),
        "frequency = -61 Hz",
        60.0,
        station_says("inverter", "maximum_frequency"),
    ),
    (
        "station",
        "inverter.driving_frequency",
        (5.0, 20.5),
        "current = 20.5 A",
        20.0,
        station_says("inverter", "maximum_current"),
    ),
    (
        "station",
        "inverter.driving_current",
        (-20.5,),
        "current = -20.5 A",
        20.0,
        station_says("inverter", "maximum_current"),
    ),
    ("station", "inverter.set_current", (20.5,), "current = 20.5 A", 20.0, station_says("inverter", "maximum_current")),
    (
        "station",
        "dynamometer.driving_speed",
        (-201.0,),
        "speed = -201 rad/s",
        200.0,
        station_says("dynamometer", "maximum_speed"),
    ),
    (
        "station",
        "dynamometer.set_speed",
        (201.0,),
        "speed = 201 rad/s",
        200.0,
        station_says("dynamometer", "maximum_speed"),
    ),
    (
        "station",
        "dynamometer.driving_torque",
        (-2.1,),
        "torque = -2.1 N·m",
        2.0,
        station_says("dynamometer", "maximum_torque"),
    ),
    (
        "station",
        "dynamometer.driving_torque",
        (1.0, 201.0),
        "speed limit = 201 rad/s",
        200.0,
        station_says("dynamometer", "maximum_speed"),
    ),
    ("motor", "supply.energised", (3.1, 1.0), "voltage = 3.1 V", 3.0, motor_says("maximum_voltage")),
    ("motor", "supply.configure", (1.0, 5.1), "current limit = 5.1 A", 5.0, motor_says("maximum_current")),
    (
        "motor",
        "lcr_meter.configure",
        (1e3, 2.2),
        "level = 2.2 V rms",
        3.0 / math.sqrt(2.0),
        motor_says("maximum_voltage"),
    ),
    (
        "motor",
        "inverter.driving_frequency",
        (10.5, 1.0),
        "frequency = 10.5 Hz",
        10.0,
        motor_says("maximum_speed_rpm") + ", pole pairs unknown: 1 taken",
    ),
    ("motor", "inverter.driving_current", (5.5,), "current = 5.5 A", 5.0, motor_says("maximum_current")),
    ("motor", "inverter.set_current", (-5.5,), "current = -5.5 A", 5.0, motor_says("maximum_current")),
    ("motor", "dynamometer.driving_speed", (63.0,), "speed = 63 rad/s", SPEED, motor_says("maximum_speed_rpm")),
    ("motor", "dynamometer.set_speed", (-63.0,), "speed = -63 rad/s", SPEED, motor_says("maximum_speed_rpm")),
    (
        "motor",
        "dynamometer.driving_torque",
        (0.1, 63.0),
        "speed limit = 63 rad/s",
        SPEED,
        motor_says("maximum_speed_rpm"),
    ),
]


@pytest.fixture(scope="module")
def benches(counted_bench_of: MakeCounted) -> Iterator[dict[str, Counted]]:
    with counted_bench_of(limits=STATION) as station, counted_bench_of(**MOTOR) as motor:
        # Every connection is open, so that a refusal is not mistaken for a first look at the instrument.
        for bench in (station, motor):
            for role in STATION:
                bench[role].identity  # noqa: B018
        yield {"station": station, "motor": motor}


@pytest.mark.parametrize(("owner", "call", "arguments", "what", "limit", "whose"), CASES)
def test_beyond_a_limit_nothing_reaches_the_instrument(
    benches: dict[str, Counted],
    owner: str,
    call: str,
    arguments: tuple[float, ...],
    what: str,
    limit: float,
    whose: str,
) -> None:
    bench = benches[owner]
    role, _, method = call.partition(".")
    instrument = bench[role]
    before = bench.messages
    with pytest.raises(SetpointError) as refused:
        getattr(instrument, method)(*arguments)
    assert bench.messages == before
    said = str(refused.value)
    assert said.startswith(f"{role}: {what} is outside ")
    assert f"{limit:g} " in said
    assert f"the limit of {whose}; nothing was sent" in said
    assert refused.value.high == pytest.approx(limit)


#: How many arguments a call takes, and which of them a station and a motor bound.
CALLS = {
    "supply.configure": (2, {"station": (0, 1), "motor": (0, 1)}),
    "supply.energised": (2, {"station": (0, 1), "motor": (0, 1)}),
    "lcr_meter.configure": (2, {"station": (0, 1), "motor": (1,)}),
    "inverter.driving_frequency": (2, {"station": (0, 1), "motor": (0, 1)}),
    "inverter.driving_current": (1, {"station": (0,), "motor": (0,)}),
    "inverter.set_current": (1, {"station": (0,), "motor": (0,)}),
    "dynamometer.driving_speed": (1, {"station": (0,), "motor": (0,)}),
    "dynamometer.set_speed": (1, {"station": (0,), "motor": (0,)}),
    "dynamometer.driving_torque": (2, {"station": (0, 1), "motor": (1,)}),
}
#: Beyond every limit of both benches, or no number at all.
BEYOND = st.one_of(
    st.floats(min_value=1.001e5), st.floats(max_value=-1.001e5), st.sampled_from([math.nan, math.inf, -math.inf])
)


@given(data=st.data(), call=st.sampled_from(sorted(CALLS)), owner=st.sampled_from(["station", "motor"]))
def test_whatever_is_asked_for_beyond_the_limits_nothing_is_sent(
    benches: dict[str, Counted], data: st.DataObject, call: str, owner: str
) -> None:
    bench = benches[owner]
    role, _, method = call.partition(".")
    count, bounded = CALLS[call]
    arguments = [0.5] * count
    arguments[data.draw(st.sampled_from(bounded[owner]))] = data.draw(BEYOND)
    before, energised = bench.messages, bench.world.truth()["energised"]
    with pytest.raises(SetpointError):
        getattr(bench[role], method)(*arguments)
    assert bench.messages == before
    assert (energised, bench.world.truth()["energised"]) == (False, False)


@given(share=st.floats(min_value=1.0 + 1e-9, max_value=10.0), sign=st.sampled_from([1.0, -1.0]))
def test_a_hair_beyond_is_beyond(benches: dict[str, Counted], share: float, sign: float) -> None:
    bench = benches["station"]
    before = bench.messages
    with pytest.raises(SetpointError):
        bench["inverter"].driving_current(sign * 20.0 * share)
    with pytest.raises(SetpointError):
        bench["supply"].energised(4.0 * share, 1.0)
    assert bench.messages == before


def test_what_may_be_asked_for_is_the_least_of_all(benches: dict[str, Counted]) -> None:
    station, motor = benches["station"], benches["motor"]
    assert (station["supply"].maximum_voltage, station["supply"].maximum_current) == (4.0, 6.0)
    assert (motor["supply"].maximum_voltage, motor["supply"].maximum_current) == (3.0, 5.0)
    assert (station["inverter"].maximum_current, station["inverter"].maximum_frequency) == (20.0, 60.0)
    assert (motor["inverter"].maximum_current, motor["inverter"].maximum_frequency) == (5.0, 10.0)
    assert (station["dynamometer"].maximum_speed, station["dynamometer"].maximum_torque) == (200.0, 2.0)
    assert motor["dynamometer"].maximum_speed == pytest.approx(SPEED)


def test_a_set_point_on_its_limit_passes(counted: MakeCounted) -> None:
    bench = counted(limits=STATION)
    with bench["supply"].energised(4.0, 6.0):
        assert bench.world.truth()["output_on"]
    assert not bench.world.truth()["energised"]
    assert [(point.parameter, point.value, point.bound, point.allowed) for point in bench.heard] == [
        ("voltage", 4.0, 4.0, True),
        ("current limit", 6.0, 6.0, True),
    ]


def test_a_measured_number_of_pole_pairs_widens_what_a_frequency_may_be(counted: MakeCounted) -> None:
    bench = counted(maximum_speed_rpm=600.0, pole_pairs=4)
    assert bench["inverter"].maximum_frequency == pytest.approx(40.0)
    with pytest.raises(SetpointError, match=re.escape("(nameplate.maximum_speed_rpm), 4 pole pairs")):
        bench["inverter"].driving_frequency(40.1, 1.0)


def test_a_small_motor_bounds_the_bridge_by_its_current(counted: MakeCounted) -> None:
    bench = counted(rated_current=0.005, maximum_current=None, rated_voltage=None)
    with pytest.raises(SetpointError, match=r"level = 1 V rms .* the motor \(nameplate\.rated_current\)"):
        bench["lcr_meter"].configure(1e3, 1.0)
    bench["lcr_meter"].configure(1e3, 0.3)


def test_a_rated_voltage_bounds_where_no_maximum_is_given(counted: MakeCounted) -> None:
    bench = counted(rated_voltage=2.0)
    with pytest.raises(SetpointError, match=r"voltage = 2\.5 V .* the motor \(nameplate\.rated_voltage\)"):
        bench["supply"].configure(2.5, 1.0)


@pytest.mark.parametrize("torque", [1.0, -1.0])
@pytest.mark.parametrize("turns_before", [False, True])
def test_a_speed_reading_beyond_the_motors_maximum_ends_the_block(
    counted: MakeCounted, torque: float, turns_before: bool
) -> None:
    bench = counted(maximum_speed_rpm=600.0)
    bench.world.couple_dynamometer()
    dynamometer, clock = bench["dynamometer"], bench.bench.clock
    if turns_before:
        # Whoever turned the shaft told the driver no direction: what it reads is a magnitude.
        turned = bench.world.dynamometer
        turned.set_mode("speed")
        turned.command(math.copysign(20.0, torque))
        turned.enable(True)
        clock.sleep(1.0)
        turned.enable(False)

    def run_away() -> None:
        with dynamometer.driving_torque(torque):
            # A drive that keeps the limit it was told lets no speed beyond it: here its keypad takes the limit away (11-36).
            bench.bench.instrument("dynamometer").units[1].write(0x0B24, [0])
            clock.sleep(3.0)
            dynamometer.measure()

    with pytest.raises(LimitError, match=r"dynamometer: speed = .* is beyond 62\.8319 rad/s, the limit of the motor"):
        run_away()
    assert not bench.world.truth()["energised"]


def test_a_torque_drive_is_told_the_motors_highest_speed(counted: MakeCounted) -> None:
    bench = counted(maximum_speed_rpm=600.0)
    with bench["dynamometer"].driving_torque(0.01):
        frequency = bench.bench.instrument("dynamometer").units[1].read(0x2001, 1)[0]
    assert frequency == round(100.0 * 600.0 / 60.0 * 2)  # 0.01 Hz, two pole pairs


@pytest.mark.parametrize(
    ("nameplate", "limits", "whose"),
    [
        ({"maximum_voltage": 23.0}, {}, r"the motor \(nameplate\.maximum_voltage\)"),
        ({}, {"drive": {"maximum_voltage": 20.0}}, r"the station \(instruments\.drive\.limits\.maximum_voltage\)"),
    ],
)
def test_a_drive_does_not_run_on_too_high_a_voltage(
    counted: MakeCounted, nameplate: dict[str, Any], limits: dict[str, Any], whose: str
) -> None:
    bench = counted("92bl-30-25l", limits, **nameplate)
    bench.world.connect({"A": "drive_1", "B": "drive_2", "C": "drive_3"})
    with pytest.raises(SetpointError, match=rf"DC link voltage = .* V is outside .* {whose}"), bench["drive"].running():
        pytest.fail("the drive runs")
    assert not bench.world.truth()["energised"]


def test_a_drive_is_switched_off_when_a_reading_is_beyond_a_limit(counted: MakeCounted) -> None:
    bench = counted("92bl-30-25l", {"drive": {"maximum_frequency": 20.0}})
    bench.world.connect({"A": "drive_1", "B": "drive_2", "C": "drive_3"})

    def run() -> None:
        with bench["drive"].running():
            bench.bench.clock.sleep(1.0)
            assert bench.world.truth()["energised"]
            bench["drive"].measure_frequency()

    with pytest.raises(LimitError, match=r"frequency = .* Hz is beyond 20 Hz, the limit of the station"):
        run()
    assert not bench.world.truth()["energised"]


def test_what_puts_nothing_out_has_no_limits(counted: MakeCounted) -> None:
    bench = counted()
    assert bench["oscilloscope"].identity.model.startswith("DSO")
    assert bench.heard == []


def test_every_role_that_energises_or_moves_is_limited() -> None:
    from bench.station.station_limits import SECTIONS
    from drivers.interfaces import Role
    from drivers.interfaces.declarations import quantities

    assert {role for role in Role if quantities(role.interface)} == {*SECTIONS, Role.TACHOMETER}
    assert {role for role in Role if role.feeds} <= set(SECTIONS)
