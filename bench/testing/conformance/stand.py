"""One driver with its simulated instrument on a virtual bench; all messages on its line can be observed."""

import math
import re
from collections.abc import Callable, Iterator, Mapping
from contextlib import contextmanager
from dataclasses import dataclass, field, fields, replace
from typing import Any

import numpy as np

from bench.motor.motor_file import load_motor
from bench.testing.conformance.report import Checks
from drivers.catalogue import Driver, Surroundings
from drivers.interfaces import Clock, Instrument, Role, Traffic
from drivers.transport.can.buses import CanBuses
from drivers.transport.in_process import ByteStream
from drivers.transport.wire import Wire
from sim_instruments.bench import VirtualBench
from sim_instruments.catalogue import FIXTURE, SimulatedInstrument, SimulatedUnit
from sim_instruments.faults.line_faults import Faults, MessageWatch
from sim_instruments.instruments.errors import DynamometerErrors, Errors
from sim_instruments.physics.motor.motor import VirtualMotor
from sim_instruments.scpi.exchange import ReadEnd

#: A transducer that was not zeroed shows so much (N·m).
_TORQUE_OFFSET = 0.05
#: What an instrument is changed by before its driver finds it: it gets the simulated instrument.
Found = Callable[[Any], None]


@dataclass(frozen=True)
class DriverUnderTest:
    """A driver under test with its options, its simulated counterpart, and the state in which it may be found."""

    driver: Driver
    options: Any
    simulated: SimulatedInstrument
    station: Mapping[str, Any] = field(default_factory=dict)
    found: Found | None = None

    @property
    def role(self) -> Role:
        """The role of the driver."""
        return self.driver.role


def station_of(options: Any) -> Mapping[str, Any]:
    """Return what a station file says of an instrument, by its driver's options."""
    return {one.name: value for one in fields(options) if (value := getattr(options, one.name)) is not None}


class _NotedStream:
    """A connection of which one knows whether it was closed."""

    def __init__(self, stream: ByteStream) -> None:
        self._stream, self.closed = stream, False
        self.write, self.reset_input_buffer = stream.write, stream.reset_input_buffer
        self.read: Callable[[int, float], bytes] = stream.read

    def close(self) -> None:
        """Close it."""
        self.closed = True
        self._stream.close()


@dataclass
class OneInstrumentBench:
    """A virtual bench with the instrument of one driver. `calls` are the calls that it made to the world, by name."""

    subject: DriverUnderTest
    bench: VirtualBench
    random: np.random.Generator
    calls: dict[str, list[tuple[Any, ...]]] = field(default_factory=dict)
    messages: list[tuple[str, bool]] = field(default_factory=list)
    streams: list[_NotedStream] = field(default_factory=list)

    def __post_init__(self) -> None:
        self._can_ends: list[Any] = []
        self._can_buses = CanBuses(self)
        #: The clock that the driver is given.
        self.clock: Clock = self.bench.clock

    @property
    def world(self) -> Any:
        """The world of the bench."""
        return self.bench.world

    @property
    def simulated(self) -> Any:
        """The simulated instrument."""
        return self.bench.instrument(self.subject.role.value)

    @property
    def transport(self) -> str:
        """The transport of its line."""
        return self.bench.transport(self.subject.role.value)

    @property
    def faults(self) -> Faults:
        """The faults of its line."""
        return self.bench.faults(self.subject.role.value)

    @property
    def energised(self) -> bool:
        """True if an instrument of a role that feeds energy does so."""
        world = self.world
        if not self.subject.role.feeds:
            return False
        return bool(
            world.supply.is_on
            or world.inverter.enabled
            or (world.six_step is not None and world.six_step.enabled)
            or world.dynamometer.enabled
            or (world.insulation is not None and world.insulation.on)
            or world.truth()["shaft_holder"] in ("turning", "pulling")
        )

    @property
    def connections(self) -> int:
        """The number of open connections to instruments: streams, ends of a CAN bus, and resources of VISA."""
        visa = self.bench.visa_library.sessions if self.transport == "visa" else 0
        ends = sum(not end.is_shut_down for end in self._can_ends)
        return visa + ends + sum(not stream.closed for stream in self.streams)

    def open(
        self,
        *,
        guarding: bool = False,
        elsewhere: bool = False,
        traffic: Traffic | None = None,
        wire: Wire | None = None,
        address: str = "",
    ) -> Instrument:
        """Open the driver's instrument, or as another process would: on a CAN bus, by a connection of its own.

        At another `address` than on the bench, where that is given.
        """
        import pyvisa

        bench = self.bench
        surroundings = Surroundings(
            self.clock,
            visa=lambda: pyvisa.ResourceManager(bench.visa_library),
            can_buses=CanBuses(self) if elsewhere else self._can_buses,
            in_process=self,
            traffic=traffic,
            guarding=guarding,
            wire=wire,
        )
        place = address or bench.address(self.subject.role.value)
        if not isinstance(place, str):
            place = f"can://{place['interface']}/{place['channel']}?node={place['node_id']}"
        return self.subject.driver.open(place, self.subject.options, surroundings)

    def answer(self, answers: Mapping[str, bytes | None]) -> None:
        """Answer messages (SCPI, by a regular expression) in place of the simulated instrument, which does not receive them.

        It queues an error instead for those that are answered by None.
        """
        taken, given, waiting = self.simulated.write, self.simulated.read, list[bytes]()

        def write(data: bytes, *end: Any) -> None:
            said = data.strip().decode("latin-1")
            found = [reply for pattern, reply in answers.items() if re.search(pattern, said)]
            if not found or found[0] is None:
                taken(data if not found else b"NO:SUCH:HEADER\n", *end)
            waiting.extend(reply + b"\n" for reply in found[:1] if reply)

        def read(*how: Any) -> Any:
            return (waiting.pop(0), ReadEnd.MESSAGE) if waiting else given(*how)

        self.simulated.write, self.simulated.read = write, read

    def stream(self, address: str) -> ByteStream:
        """Return a connection in process, of which note is taken."""
        self.streams.append(_NotedStream(self.bench.stream(address)))
        return self.streams[-1]

    def can_bus(self, channel: str) -> Any:
        """Return an end of a bus in process, of which note is taken."""
        self._can_ends.append(self.bench.can_bus(channel))
        return self._can_ends[-1]

    def take_bus_down(self) -> None:
        """Take down every CAN bus that the driver has open: it can only be opened anew."""
        for end in self._can_ends:
            end.shutdown()

    def find(self) -> None:
        """Bring the instrument into the state in which it may be found."""
        if self.subject.found is not None:
            self.subject.found(self.simulated)

    def off(self, checks: Checks) -> None:
        """Check that nothing is energised."""
        remedy = "Switch it off in a finally clause"
        checks.that("off at the end of a block", not self.energised, "it is on", remedy)

    def wait(self, seconds: float) -> None:
        """Wait for bench time (s)."""
        self.bench.clock.sleep(seconds)

    def between(self, low: float, high: float) -> float:
        """Return a random number, four digits long: what is sent and shown can hold it."""
        return float(f"{self.random.uniform(low, high):.4g}")

    @contextmanager
    def sampling(self, read: Callable[[], float]) -> Iterator[list[float]]:
        """Give what is read of the world at every message within the block."""
        found: list[float] = []

        def hears(*_: Any) -> bool:
            found.append(read())
            return False

        watch = MessageWatch(hears, lambda: None)
        self.faults.watch(watch)
        try:
            yield found
        finally:
            self.faults.unwatch(watch)

    def listen(self) -> None:
        """Take note of every message on the line, and whether something is energised when it comes."""

        def hears(_: int, message: str) -> bool:
            self.messages.append((message, self.energised))
            return False

        self.faults.watch(MessageWatch(hears, lambda: None))

    def watch(self, owner: Any, name: str) -> None:
        """Take note of what a method of the world is called with."""
        method = getattr(owner, name)
        noted = self.calls.setdefault(name, [])

        def called(*arguments: Any, **named: Any) -> Any:
            noted.append((*arguments, *named.values()))
            return method(*arguments, **named)

        setattr(owner, name, called)


def motor_for(role: Role, generator: np.random.Generator) -> tuple[VirtualMotor, Any]:
    """Return a motor whose values differ with each generator, and the six-step drive for that role."""
    if role is Role.DRIVE:
        motor = load_motor("92bl-30-25l")
        return motor.virtual_motor(), motor.six_step
    nominal = load_motor("lg-400w").virtual_motor()
    resistance = float(generator.uniform(0.8, 1.5))
    return (
        replace(
            nominal,
            phase_resistances=(resistance, 1.1 * resistance, 1.2 * resistance),
            d_axis_inductance=float(generator.uniform(0.8e-3, 1.0e-3)),
            q_axis_inductance=float(generator.uniform(1.2e-3, 1.5e-3)),
            flux_linkage=float(generator.uniform(8e-3, 9e-3)),
            insulation_resistance=float(generator.uniform(2e8, 4e8)),
            thermal_resistance=0.0,
        ),
        None,
    )


@contextmanager
def stand(
    subject: DriverUnderTest, seed: int = 0, *, sockets: bool = False, hostile: int | None = None
) -> Iterator[OneInstrumentBench]:
    """Give a bench with the subject's instrument, in the state in which it is found; on real `sockets` where asked for.

    With `hostile`, a seed, it is found as its simulated counterpart's own table says that a last user may have left it.
    """
    generator = np.random.default_rng([seed, 7])
    motor, six_step = motor_for(subject.role, generator)
    unit = SimulatedUnit(subject.simulated, options=subject.station)
    fixture = subject.role.value in FIXTURE
    errors = Errors(dynamometer=DynamometerErrors(torque_offset=_TORQUE_OFFSET))
    with VirtualBench(
        motor, [unit], seed=seed, errors=errors, six_step=six_step, sockets=sockets, fixture=fixture, hostile=hostile
    ) as bench:
        made = OneInstrumentBench(subject, bench, generator)
        made.find()
        yield made


def rounded(value: float) -> float:
    """Return a number of three digits, not larger than it was."""
    if value == 0.0 or not math.isfinite(value):
        return value
    scale = 10.0 ** (2 - math.floor(math.log10(abs(value))))
    return math.floor(value * scale) / scale
