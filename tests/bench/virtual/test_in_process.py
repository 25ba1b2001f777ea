"""The real drivers on a virtual bench in this process: the same bytes without wires, threads and waits."""

import threading
from collections.abc import Callable, Iterator

import pytest

from bench.cli.run import load_motor
from bench.safety.station_instruments import StationInstruments
from bench.station.visa_library import StationVisa
from bench.virtual.virtual_station import virtual_station
from drivers.catalogue import Surroundings
from drivers.cia402.inverter import Cia402Inverter
from drivers.cia402.options import Cia402Options
from drivers.interfaces import CommunicationError, Waveform
from drivers.lutron.options import LutronTachometerOptions
from drivers.lutron.tachometer import LutronTachometer
from drivers.transport.can.buses import CanBuses
from drivers.transport.modbus.line import open_line
from procedures.core.bench import Role
from procedures.core.events import Event
from sim_instruments.bench import VirtualBench
from sim_instruments.faults.line_faults import Fault


class Nothing:
    """Records and stores nothing."""

    def record(self, event: Event) -> None:
        """Let it go."""

    def store(self, name: str, waveform: Waveform) -> str:
        """Let it go."""
        return name


Bench = tuple[VirtualBench, StationInstruments]


@pytest.fixture
def make() -> Iterator[Callable[[bool], Bench]]:
    opened: list[Bench] = []
    motor = load_motor("lg-400w")

    def made(sockets: bool = False) -> Bench:
        virtual = VirtualBench(motor.virtual_motor(), seed=5, sockets=sockets)
        nothing = Nothing()
        instruments = StationInstruments(
            virtual_station(virtual.addresses()),
            motor.nameplate,
            virtual.clock,
            nothing,
            nothing,
            StationVisa(virtual.visa_library),
            lambda _: None,
            in_process=virtual,
        )
        opened.append((virtual, instruments))
        return opened[-1]

    yield made
    for virtual, instruments in opened:
        assert not instruments.close()
        virtual.close()


def figures(bench: Bench) -> list[float]:
    """Turn the shaft with the dynamometer, and read it by all that have no VISA; the last is the bench time."""
    virtual, instruments = bench
    dynamometer, tachometer = instruments.get(Role.DYNAMOMETER), instruments.get(Role.TACHOMETER)
    inverter = instruments.get(Role.INVERTER)
    virtual.world.couple_dynamometer()
    with dynamometer.driving_speed(50.0):
        found = [dynamometer.measure() for _ in range(5)]
        speed = tachometer.measure_speed()
    return [
        *(value for reading in found for value in (reading.time, reading.speed, reading.torque)),
        speed.value,
        inverter.measure_frequency().value,
        virtual.clock.now(),
    ]


def test_the_same_figures_as_over_sockets(make: Callable[[bool], Bench]) -> None:
    assert figures(make(False)) == figures(make(True))


def test_no_thread_is_started(make: Callable[..., Bench]) -> None:
    before = threading.active_count()
    figures(make())
    assert threading.active_count() == before


def test_a_silent_instrument_costs_bench_time_only(make: Callable[..., Bench]) -> None:
    virtual, instruments = make()
    dynamometer, inverter = instruments.get(Role.DYNAMOMETER), instruments.get(Role.INVERTER)
    before = virtual.clock.now()
    virtual.faults("dynamometer").add(Fault.on("silence", "read 2 0000H"))
    assert dynamometer.measure().speed == 0.0  # a read is repeated once
    assert virtual.clock.now() - before == pytest.approx(1.0, abs=0.01)
    virtual.faults("dynamometer").add(Fault.on("silence", "read 2 0000H", times=2))
    with pytest.raises(CommunicationError, match="no usable reply"):
        dynamometer.measure()
    virtual.faults("dynamometer").clear()
    assert dynamometer.measure().speed == 0.0
    virtual.faults("inverter").add(Fault.on("silence", "read 606CH"))
    with pytest.raises(CommunicationError, match="No SDO response received"):
        inverter.measure_frequency()
    assert inverter.measure_frequency().value == 0.0
    virtual.faults("tachometer").add(Fault.on("half", "frame"))
    with pytest.raises(CommunicationError, match="no frame"):
        instruments.get(Role.TACHOMETER).measure_speed()
    assert instruments.get(Role.TACHOMETER).measure_speed().value == 0.0


def test_a_late_reply_is_waited_for(make: Callable[..., Bench]) -> None:
    virtual, instruments = make()
    inverter, dynamometer = instruments.get(Role.INVERTER), instruments.get(Role.DYNAMOMETER)
    virtual.faults("inverter").add(Fault.on("late", "read 606CH", delay=0.2))
    before = virtual.clock.now()
    assert inverter.measure_frequency().value == 0.0
    assert virtual.clock.now() - before == pytest.approx(0.2, abs=0.01)
    virtual.faults("dynamometer").add(Fault.on("late", "read 2 0000H", delay=0.3))
    assert dynamometer.measure().speed == 0.0
    assert virtual.clock.now() - before == pytest.approx(0.5, abs=0.02)


def test_a_closed_connection_can_be_opened_again(make: Callable[..., Bench]) -> None:
    virtual, instruments = make()
    inverter, dynamometer = instruments.get(Role.INVERTER), instruments.get(Role.DYNAMOMETER)
    virtual.faults("inverter").add(Fault.on("silence", "6041H"))
    inverter.make_safe()
    virtual.faults("dynamometer").add(Fault.on("silence", "write 1"))
    dynamometer.make_safe()
    assert (inverter.measure_frequency().value, dynamometer.measure().speed) == (0.0, 0.0)


def test_a_pulled_cable_cuts_off_until_it_is_plugged_and_opened_anew(make: Callable[..., Bench]) -> None:
    virtual, instruments = make()
    inverter, dynamometer = instruments.get(Role.INVERTER), instruments.get(Role.DYNAMOMETER)
    for role in ("inverter", "dynamometer"):
        virtual.connection(role).pull()
    for instrument in (inverter, dynamometer):
        with pytest.raises(CommunicationError):
            instrument.make_safe()
    for role in ("inverter", "dynamometer"):
        virtual.connection(role).plug()
    inverter.make_safe()
    dynamometer.make_safe()
    assert (inverter.measure_frequency().value, dynamometer.measure().speed) == (0.0, 0.0)


def test_addresses_in_process_need_a_bench_in_this_process(make: Callable[..., Bench]) -> None:
    virtual, _ = make(True)
    clock = virtual.clock
    for opener in (None, virtual):
        with pytest.raises(
            CommunicationError, match=r"cannot be opened at in-process://dynamometer.*only the virtual bench has these"
        ):
            open_line("in-process://dynamometer", "dynamometer", in_process=opener)
        with pytest.raises(CommunicationError, match="nothing in this process answers at in-process://tachometer"):
            LutronTachometer.open(
                "in-process://tachometer",
                LutronTachometerOptions(),
                Surroundings(clock, in_process=opener),
                "tachometer",
            )
        with pytest.raises(CommunicationError, match="nothing in this process answers at can://in-process/bench"):
            Cia402Inverter.open(
                "can://in-process/bench?node=5",
                Cia402Options(maximum_current=1.0, maximum_frequency=10.0),
                Surroundings(clock, can_buses=CanBuses(opener)),
                "inverter",
            )
