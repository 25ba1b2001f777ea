"""A session on the virtual bench, recorded and replayed through the same drivers: the same, byte for byte."""

from collections.abc import Iterator
from typing import Any

import pytest

from bench.motor.motor_file import load_motor
from bench.safety.station_instruments import StationInstruments
from bench.station.visa_library import StationVisa
from bench.traffic.recorder import TrafficRecorder
from bench.traffic.replay import replay
from bench.traffic.traffic_file import Recording, parse_recording
from bench.virtual.virtual_station import virtual_station
from drivers.interfaces import Aperture, ChannelSettings, InstrumentError, Role, Trigger
from sim_instruments.bench import VirtualBench


class Nothing:
    """Records and stores nothing."""

    def record(self, event: Any) -> None:
        """Let it go."""

    def store(self, name: str, waveforms: Any) -> str:
        """Let it go."""
        return name


def measured(instruments: dict[Role, Any]) -> None:
    """Use every instrument of a bench with a fixture as procedures do; what an open winding refuses is recorded, too."""
    supply = instruments[Role.SUPPLY]
    supply.configure(1.0, 0.5)
    with supply.energised(1.0, current_limit=0.5):
        supply.measure_current()
        supply.output_mode()
    bridge = instruments[Role.LCR_METER]
    bridge.configure(100.0, aperture=Aperture.LONG)
    with pytest.raises(InstrumentError):
        bridge.measure()
    meter = instruments[Role.VOLTMETER]
    meter.configure(0.1)
    meter.measure_voltage()
    scope, dynamometer = instruments[Role.OSCILLOSCOPE], instruments[Role.DYNAMOMETER]
    for channel in (1, 2):
        scope.configure_channel(channel, ChannelSettings(10.0))
    scope.configure_acquisition(0.02, 1000)
    scope.configure_trigger(Trigger(None))
    with pytest.raises(RuntimeError), dynamometer.driving_speed(50.0):
        dynamometer.measure()
        instruments[Role.TACHOMETER].measure_speed()
        scope.initiate()
        scope.fetch([1, 2], 2.0)
        raise RuntimeError
    matrix, inverter = instruments[Role.SWITCH_MATRIX], instruments[Role.INVERTER]
    matrix.connect(frozenset({"A:inverter_u", "B:inverter_v", "C:inverter_w"}))
    with inverter.driving_frequency(2.0, 1.0):
        inverter.measure_frequency()
        inverter.measure_current()
    matrix.closed()
    instruments[Role.ROTOR_ACTUATOR].angle()
    instruments[Role.INSULATION_TESTER].measure(100.0, 1.0)


@pytest.fixture(scope="module")
def recording() -> Iterator[Recording]:
    motor = load_motor("lg-400w")
    with VirtualBench(motor.virtual_motor(), seed=5, sockets=False, fixture=True) as bench:
        nothing, recorder = Nothing(), TrafficRecorder(bench.clock.now)
        station = virtual_station(bench.addresses())
        instruments = StationInstruments(
            station,
            motor.nameplate,
            bench.clock,
            nothing,
            nothing,
            StationVisa(bench.visa_library),
            lambda _: None,
            in_process=bench,
            traffic_recorder=recorder,
        )
        for role in station.entries:
            instruments.open(role)
        measured(dict(instruments.opened()))
        assert not instruments.close()
        yield recorder.recording(station)


def test_equal(recording: Recording) -> None:
    __import__("pathlib").Path("/tmp/rec.traffic").write_text(recording.text())
    again = parse_recording(recording.text(), "again.traffic")
    assert {one.role for one in replay(again)} == set(Role) - {Role.DRIVE}
    for one in replay(again):
        assert one.difference is None, one.difference
        said = [(line.kind, line.content) for line in one.lines]
        assert said == [(line.kind, line.content) for line in again.of(one.role)], one.role
