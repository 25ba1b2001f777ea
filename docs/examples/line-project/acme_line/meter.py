"""A meter of its own: driver, and the same meter simulated, by its manual."""

from dataclasses import dataclass
from typing import Any

from drivers.bases.scpi_driver import ScpiDriver
from drivers.bases.set_points import check_setpoint
from drivers.catalogue import Driver, Surroundings
from drivers.interfaces import Accuracy, MeasurementError, OverloadError, Reading, Role, Voltmeter
from drivers.recognition import ScpiIdentity
from drivers.transport.visa.opening import identify, open_driver, open_session
from drivers.transport.visa.replies import is_overrange
from sim_instruments.catalogue import BenchPlace, SimulatedInstrument
from sim_instruments.scpi.instrument import ScpiInstrument
from sim_instruments.scpi.parameters import exactly, number

RANGE = 60.0  # V, the only one
IDENTITY = ScpiIdentity(makers=("acme",), models=("DM5",))
STATED = Accuracy(gain=2e-4, offset=50e-6, resolution=1e-6, source="Acme DM5 manual, section 3")


@dataclass(frozen=True)
class MeterOptions:
    """What a station file may say of the meter."""

    serial_number: str | None = None


class AcmeMeter(ScpiDriver, Voltmeter):
    """An Acme DM5 as a DC voltmeter."""

    def __init__(self, session: Any, clock: Any, options: MeterOptions, name: str) -> None:
        super().__init__(session, clock, name)
        self._identity = identify(session, IDENTITY, options.serial_number)
        self._full_scale = 0.0
        session.check_left_errors()

    def configure(self, full_scale: float, power_line_cycles: float = 10.0) -> None:
        """Set the integration time (power-line cycles); the one range holds up to 60 V. Raises SetpointError beyond either."""
        check_setpoint(self._name, "full scale", full_scale, "V", 0.0, RANGE, "the model")
        check_setpoint(self._name, "integration time", power_line_cycles, "power-line cycles", 1.0, 1000.0, "the model")
        self._session.write(f"CYCLES {power_line_cycles:g}")
        self._full_scale = full_scale

    @property
    def maximum_voltage(self) -> float:
        return 1000.0

    def measure_voltage(self) -> Reading:
        """Return one reading (V). Raises MeasurementError before `configure`, OverloadError beyond the range."""
        if not self._full_scale:
            raise MeasurementError(self._name, "no range set", remedy="Call configure() first")
        value = self._session.query_number("VOLTS?")
        if is_overrange(value) or abs(value) > 1.2 * self._full_scale:
            raise OverloadError(self._name, "overload", command="VOLTS?", remedy="Check the sense leads")
        return Reading(value, "V", STATED, self._clock.now())

    def accuracy_at(self, voltage: float) -> Accuracy:
        """Return what the manual states at a voltage (V). Raises MeasurementError beyond the range."""
        if not abs(voltage) <= RANGE:
            raise MeasurementError(self._name, f"nothing is stated at {voltage:g} V", remedy="Stay within 60 V")
        return STATED

    def make_safe(self) -> None:
        """Do nothing: a voltmeter only listens."""


def open_meter(address: str, options: MeterOptions, surroundings: Surroundings, name: str) -> AcmeMeter:
    session = open_session(address, surroundings, name)
    return open_driver(session, lambda session: AcmeMeter(session, surroundings.clock, options, name))


DRIVER = Driver("acme-dm5", Role.VOLTMETER, MeterOptions, open_meter, simulated="acme-dm5", recognised_by=(IDENTITY,))


class SimulatedMeter(ScpiInstrument):
    """The same meter, by its manual: CYCLES n, VOLTS?."""

    def __init__(self, place: BenchPlace) -> None:
        super().__init__(place.world.clock, place.generator, "Acme,DM5,4712,2.0")
        self._world, self._random, self._cycles = place.world, place.generator, 10.0
        self.tree.add("CYCLES", command=self._set)
        self.tree.add("VOLTS", query=self._read)

    def _set(self, call: Any) -> None:
        exactly(call.arguments, 1)
        self._cycles = number(call.arguments[0], 1.0, 1000.0)

    def _read(self, _: Any) -> Any:
        yield self.clock.now() + self._cycles / 50.0
        true = self._world.voltmeter_voltage(self._cycles / 50.0)
        return f"{true + float(self._random.normal(0.0, 1e-6)):.6f}"


SIMULATED = SimulatedInstrument("acme-dm5", "voltmeter", "visa", SimulatedMeter)
