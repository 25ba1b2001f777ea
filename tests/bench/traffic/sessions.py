"""Sessions on the virtual bench, recorded."""

from collections.abc import Callable
from contextlib import contextmanager, suppress
from typing import Any

from bench.journal.unrecorded import Unrecorded
from bench.motor.motor_file import load_motor
from bench.safety.station_instruments import StationInstruments
from bench.station.visa_library import StationVisa
from bench.traffic.recorder import TrafficRecorder
from bench.traffic.traffic_file import SessionRecording
from bench.virtual.virtual_station import virtual_station
from drivers.interfaces import Aperture, ChannelSettings, InstrumentError, Role, Trigger
from sim_instruments.bench import VirtualBench

Instruments = dict[Role, Any]


def recorded(
    use: Callable[[VirtualBench, Instruments], None], *roles: Role, identifiable: bool = False
) -> SessionRecording:
    """Return the recording of what `use` does with the instruments of a bench with a fixture, all of them where no roles are given."""
    motor = load_motor("lg-400w")
    with VirtualBench(motor.virtual_motor(), seed=5, sockets=False, fixture=True) as bench:
        recorder, station = TrafficRecorder(bench.clock.now), virtual_station(bench.addresses())
        instruments = StationInstruments(
            station,
            motor.nameplate,
            bench.clock,
            Unrecorded(),
            Unrecorded(),
            StationVisa(bench.visa_library),
            lambda _: None,
            in_process=bench,
            traffic_recorder=recorder,
        )
        for role in roles or station.entries:
            instruments.open(role)
        use(bench, dict(instruments.opened()))
        instruments.close()
        return recorder.recording(station, identifiable=identifiable)


@contextmanager
def failing() -> Any:
    """Let what an instrument refuses be, and what the block raises."""
    with suppress(InstrumentError, RuntimeError):
        yield


def everything(_: VirtualBench, instruments: Instruments) -> None:
    """Use every instrument as procedures do, with an overload and a block that ends in an error among it."""
    supply = instruments[Role.SUPPLY]
    supply.configure(1.0, 0.5)
    with supply.energised(1.0, current_limit=0.5):
        supply.measure_current()
        supply.output_mode()
    bridge = instruments[Role.LCR_METER]
    bridge.configure(100.0, aperture=Aperture.LONG)
    with failing():
        bridge.measure()
    meter = instruments[Role.VOLTMETER]
    meter.configure(0.1)
    meter.measure_voltage()
    scope, dynamometer = instruments[Role.OSCILLOSCOPE], instruments[Role.DYNAMOMETER]
    for channel in (1, 2):
        scope.configure_channel(channel, ChannelSettings(10.0))
    scope.configure_acquisition(0.02, 1000)
    scope.configure_trigger(Trigger(None))
    with failing(), dynamometer.driving_speed(50.0):
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
