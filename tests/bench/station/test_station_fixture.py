"""Station files with a switch matrix, a rotor actuator and an insulation tester: what is refused, and the limits in front."""

from typing import Any

import pytest

from bench.i18n.errors import InputError
from bench.safety.guardian.guarded_instruments import GuardedInstruments
from bench.safety.limits.bounds import limits_of
from bench.safety.limits.guard import guarded
from bench.station.shutdown_sequence import ShutdownAction
from bench.station.station_file import Station, make_station
from drivers.interfaces import SetpointError
from procedures.core.bench import Role
from procedures.core.nameplate import Nameplate, WindingConnection

MATRIX = {"driver": "keysight-34970a", "address": "TCPIP0::192.0.2.20::inst0::INSTR"}
ACTUATOR = {"driver": "cia402-rotor-actuator", "address": "can://socketcan/can0?node=7", "maximum_speed": 6.0}
TESTER = {"driver": "gwinstek-gpt9800", "address": "ASRL/dev/ttyACM0::INSTR"}


def station(**instruments: Any) -> Station:
    return make_station({"station": {"name": "line 1"}, "instruments": instruments}, "line.toml", b"")


def test_a_fixture() -> None:
    made = station(
        switch_matrix={**MATRIX, "crosspoints": {"A:supply+": 111}, "fixed": ["A:channel4~"]},
        rotor_actuator=ACTUATOR,
        insulation_tester=TESTER,
    )
    options: Any = made.entries[Role.SWITCH_MATRIX].options
    assert (options.crosspoints, options.fixed) == ({"A:supply+": 111}, ("A:channel4~",))
    items = [(one.do, one.role) for one in made.way_down.items if one.role in made.entries]
    assert items == [
        (ShutdownAction.OUTPUT_OFF, Role.INSULATION_TESTER),
        (ShutdownAction.DISABLE, Role.ROTOR_ACTUATOR),
        (ShutdownAction.OPEN, Role.SWITCH_MATRIX),
    ]
    assert GuardedInstruments(made, made.entries).roles == set(made.entries)


@pytest.mark.parametrize(
    ("given", "message"),
    [
        ({"A:suply+": 111}, r'line.toml: instruments.switch_matrix.crosspoints."A:suply\+" = 111: there is no such'),
        ({"A:supply+": 11}, r"crosspoints.\"A:supply\+\" = 11: a channel is a number from 100 to 9999"),
        ({"A:supply+": 111, "B:supply+": 111}, r'"B:supply\+" = 111: the channel is "A:supply\+" already'),
        ({"A:supply+": "111"}, r"line.toml: instruments.switch_matrix.crosspoints.A:supply\+ = '111'"),
    ],
)
def test_crosspoints_that_cannot_be(given: dict[str, Any], message: str) -> None:
    with pytest.raises(InputError, match=message):
        station(switch_matrix={**MATRIX, "crosspoints": given})


def test_a_source_left_on_by_a_stations_own_list_is_refused() -> None:
    data = {
        "station": {"name": "line 1"},
        "instruments": {"insulation_tester": TESTER},
        "way_down": [{"do": "output_off", "role": "insulation_tester"}],
    }
    assert len(make_station(data, "line.toml", b"").way_down.items) == 1
    data["instruments"] = {"insulation_tester": TESTER, "rotor_actuator": ACTUATOR}
    with pytest.raises(InputError, match=r"leaves \[instruments.rotor_actuator\] energised"):
        make_station(data, "line.toml", b"")


class Bare:
    """What is behind the limits."""

    maximum_voltage = 1000.0
    maximum_speed = 6.0

    def __init__(self) -> None:
        self.told: list[tuple[float, ...]] = []

    def measure(self, *given: float) -> None:
        self.told.append(given)

    def turn(self, speed: float) -> None:
        self.told.append((speed,))


PLATE = {"name": "m", "connection": WindingConnection.WYE, "rated_current": 1.0}


@pytest.mark.parametrize(
    ("allowed", "by_station", "voltage", "message"),
    [
        (
            500.0,
            {},
            550.0,
            r"voltage = 550 V is outside 0 … 500 V, the limit of the motor \(nameplate.insulation_test_voltage",
        ),
        (
            500.0,
            {"maximum_voltage": 250.0},
            300.0,
            r"250 V, the limit of the station \(instruments.insulation_tester.limits",
        ),
        (None, {}, 50.0, "the motor: its file gives no nameplate.insulation_test_voltage"),
        (500.0, {}, float("nan"), "voltage = nan V"),
    ],
)
def test_no_test_voltage_beyond_the_motors_and_the_stations(
    allowed: float | None, by_station: dict[str, float], voltage: float, message: str
) -> None:
    plate = Nameplate(**PLATE, insulation_test_voltage=allowed)  # type: ignore[arg-type]
    bare: Any = Bare()
    role = Role.INSULATION_TESTER
    tester: Any = guarded(role, bare, "tester", limits_of(role, plate, by_station))
    with pytest.raises(SetpointError, match=message):
        tester.measure(voltage, 1.0)
    assert bare.told == []
    assert tester.maximum_voltage == min(allowed or 0.0, by_station.get("maximum_voltage", 1e4))


def test_within_the_limits_it_is_passed_on() -> None:
    bare: Any = Bare()
    plate = Nameplate(**PLATE, insulation_test_voltage=500.0, maximum_speed_rpm=30.0)  # type: ignore[arg-type]
    tester: Any = guarded(Role.INSULATION_TESTER, bare, "tester", limits_of(Role.INSULATION_TESTER, plate, {}))
    tester.measure(500.0, 1.0)
    actuator: Any = guarded(Role.ROTOR_ACTUATOR, bare, "actuator", limits_of(Role.ROTOR_ACTUATOR, plate, {}))
    actuator.turn(-3.0)
    assert bare.told == [(500.0, 1.0), (-3.0,)]
    assert actuator.maximum_speed == pytest.approx(3.14159, rel=1e-5)
    with pytest.raises(SetpointError, match=r"nameplate\.maximum_speed_rpm"):
        actuator.turn(3.2)
