"""A DC supply with one output that speaks SCPI, its ratings and headers as data: base of simulated supplies, and generic."""

from collections.abc import Callable
from dataclasses import dataclass
from functools import partial
from typing import Any, Literal

from sim_instruments.catalogue import BenchPlace, Options, SimulatedInstrument
from sim_instruments.instruments.errors import SupplyErrors
from sim_instruments.scpi.errors import ScpiError
from sim_instruments.scpi.instrument import ScpiInstrument
from sim_instruments.scpi.parameters import boolean, exactly, number
from sim_instruments.scpi.tree import Call, Handling, bare
from sim_instruments.world.machine_data import SupplyStage

_MEASURING_TIME = 0.02  # one power-line cycle
Quantity = Literal["voltage", "current"]


@dataclass(frozen=True)
class SupplyRating:
    """The ratings of a supply: largest voltage (V) and current (A), over-voltage level (V), resolution and noise of both
    readings.

    What of an output's errors is set and read lies within `errors`, those of a healthy unit unless a bench draws others.
    """

    voltage: float
    current: float
    over_voltage: float = 0.0
    resolution: tuple[float, float] = (1.0e-3, 1.0e-3)
    noise: tuple[float, float] = (1.0e-4, 1.0e-4)

    @property
    def stage(self) -> SupplyStage:
        """The output stage on the bench."""
        return SupplyStage(
            maximum_voltage=1.01 * self.voltage, maximum_current=1.01 * self.current, output_resistance=2.0e-4
        )

    @property
    def highest_over_voltage(self) -> float:
        """The highest level of the over-voltage protection (V)."""
        return self.over_voltage or 1.1 * self.voltage


@dataclass(frozen=True)
class SupplyHeaders:
    """Headers as the instrument knows them, in the notation of its manual; an empty one is a protection it has not.

    A supply with a `remote` takes no setting before it, nor after `local`; an empty one takes settings at any time.
    """

    voltage: str = "[SOURce]:VOLTage[:LEVel][:IMMediate][:AMPLitude]"
    current: str = "[SOURce]:CURRent[:LEVel][:IMMediate][:AMPLitude]"
    output: str = "OUTPut[:STATe]"
    measure_voltage: str = "MEASure[:SCALar][:VOLTage][:DC]"
    measure_current: str = "MEASure[:SCALar]:CURRent[:DC]"
    over_voltage: str = "[SOURce]:VOLTage:PROTection[:LEVel]"
    over_current: str = "[SOURce]:CURRent:PROTection:STATe"
    over_voltage_tripped: str = "[SOURce]:VOLTage:PROTection:TRIPped"
    over_current_tripped: str = "[SOURce]:CURRent:PROTection:TRIPped"
    clear: str = "OUTPut:PROTection:CLEar"
    remote: str = ""
    local: str = ""


class SimulatedScpiSupply(ScpiInstrument):
    """A supply in its place; one that is not connected to the motor feeds nothing and reads its own settings."""

    def __init__(
        self, place: BenchPlace, identity: str, rating: SupplyRating, headers: SupplyHeaders | None = None
    ) -> None:
        super().__init__(place.world.clock, place.generator, identity)
        self._supply = place.world.supply if place.connected else None
        self._lock = place.world.lock
        self._random = place.generator
        self._unit: SupplyErrors = place.errors or SupplyErrors()
        self._rating = rating
        headers = headers or SupplyHeaders()
        self._local = bool(headers.remote)
        self._add_commands(headers)
        self.reset()

    def reset(self) -> None:
        """Switch off and return to the defaults."""
        self._levels = {
            "voltage": 0.0,
            "current": self._rating.current,
            "over_voltage": self._rating.highest_over_voltage,
        }
        self._flags = {"over_current": False, "on": False}
        if self._supply is not None:
            with self._lock:
                self._supply.switch(False)
                self._supply.clear_trip()
        self._apply()

    def inhibit(self, inhibited: bool) -> None:
        """Take the output off by the inhibit input, latched: allowed again, it stays off until it is switched on anew."""
        with self._lock:
            if inhibited:
                self._flags["on"] = False
            if self._supply is not None:
                self._supply.inhibit(inhibited)

    def _add_commands(self, headers: SupplyHeaders) -> None:
        rating, add = self._rating, self.tree.add
        for name, header, highest in (
            ("voltage", headers.voltage, rating.voltage),
            ("current", headers.current, rating.current),
            ("over_voltage", headers.over_voltage, rating.highest_over_voltage),
        ):
            if header:
                query = partial(self._get, self._levels_of(name), "{:+.8E}")
                add(header, command=partial(self._set_level, name, highest), query=query)
        for name, header in (("over_current", headers.over_current), ("on", headers.output)):
            if header:
                flag = partial(self._flag, name)
                add(header, command=partial(self._set_flag, name), query=partial(self._get, flag, "{:d}"))
        for quantity, header in (
            ("voltage", headers.over_voltage_tripped),
            ("current", headers.over_current_tripped),
        ):
            if header:
                add(header, query=partial(self._get, partial(self._tripped, quantity), "{:d}"))
        if headers.clear:
            add(headers.clear, command=self._clear)
        for header, local in ((headers.remote, False), (headers.local, True)):
            if header:
                add(header, command=bare(partial(self._lock_panel, local)))
        add(headers.measure_voltage, query=partial(self._measure, "voltage"))
        add(headers.measure_current, query=partial(self._measure, "current"))

    def _lock_panel(self, local: bool) -> None:
        self._local = local

    def _take(self, call: Call, elements: int) -> None:
        """Raise ScpiError where settings are the front panel's now, or for another number of data elements."""
        if self._local:
            raise ScpiError(-203)
        exactly(call.arguments, elements)

    def _levels_of(self, name: str) -> Callable[[], float]:
        return lambda: self._levels[name]

    @staticmethod
    def _get(value: Callable[[], Any], form: str, call: Call) -> str:
        exactly(call.arguments, 0)
        return form.format(value())

    def _set_level(self, name: str, highest: float, call: Call) -> None:
        self._take(call, 1)
        self._levels[name] = number(call.arguments[0], 0.0, highest, default=0.0)
        self._apply()

    def _set_flag(self, name: str, call: Call) -> None:
        self._take(call, 1)
        value = boolean(call.arguments[0])
        if name == "on" and value and self._supply is not None and self._supply.tripped is not None:
            # A latched protection holds the output off until it is cleared.
            raise ScpiError(-221)
        self._flags[name] = value
        self._apply()

    def _flag(self, name: str) -> bool:
        wanted, supply = self._flags[name], self._supply
        if name != "on" or supply is None:
            return wanted
        if supply.tripped is not None:
            return False
        return supply.stuck_output.shown(wanted and not supply.inhibited, supply.is_on)

    def _tripped(self, quantity: str) -> bool:
        return self._supply is not None and self._supply.tripped == quantity

    def _clear(self, call: Call) -> None:
        self._take(call, 0)
        if self._supply is not None:
            self._supply.clear_trip()
            self._apply()

    def _apply(self) -> None:
        supply, unit, levels = self._supply, self._unit, self._levels
        if supply is None:
            return
        with self._lock:
            voltage = levels["voltage"] * (1.0 + unit.set_voltage_gain) + unit.set_voltage_offset
            current = levels["current"] * (1.0 + unit.set_current_gain) + unit.set_current_offset
            # The offset of the setting does not drive an output that is set to nothing.
            highest = supply.stage.maximum_voltage
            supply.set_voltage(min(max(voltage, 0.0), highest) if levels["voltage"] > 0.0 else 0.0)
            supply.set_current_limit(min(max(current, 0.0), supply.stage.maximum_current))
            supply.set_over_voltage(levels["over_voltage"])
            supply.set_over_current(self._flags["over_current"])
            on = self._flags["on"]
            if on != supply.is_on or on != supply.stuck_output.wanted:
                supply.switch(on)

    def _measure(self, quantity: Quantity, call: Call) -> Handling:
        exactly(call.arguments, 0)
        yield self.clock.now() + _MEASURING_TIME
        index, unit = (0 if quantity == "voltage" else 1), self._unit
        if self._supply is None:
            true = self._levels["voltage"] if index == 0 and self._flags["on"] else 0.0
        else:
            true = self._supply.voltage(_MEASURING_TIME) if index == 0 else self._supply.current(_MEASURING_TIME)
        gain, offset = (
            (unit.voltage_gain, unit.voltage_offset) if index == 0 else (unit.current_gain, unit.current_offset)
        )
        value = true * (1.0 + gain) + offset + float(self._random.normal(0.0, self._rating.noise[index]))
        resolution = self._rating.resolution[index]
        return f"{round(value / resolution) * resolution:+.8E}"


def simulated_supply(
    name: str, identity: str, rating: SupplyRating, headers: SupplyHeaders | None = None
) -> SimulatedInstrument:
    """Return a simulated supply of a make: who answers *IDN?, its ratings, and its headers where they are not the usual ones."""
    return SimulatedInstrument(
        name,
        "supply",
        "visa",
        lambda place: SimulatedScpiSupply(place, identity, rating, headers),
        machine=lambda _: rating.stage,
        ratings=lambda _: {"maximum_voltage": rating.voltage, "maximum_current": rating.current},
    )


def _generic_rating(options: Options) -> SupplyRating:
    return SupplyRating(float(options["maximum_voltage"]), float(options["maximum_current"]))


#: Stands for a supply that has no simulated counterpart, with the ratings of its driver.
GENERIC = SimulatedInstrument(
    "generic-supply",
    "supply",
    "visa",
    lambda place: SimulatedScpiSupply(place, "motorbench,generic supply,0,1", _generic_rating(place.options)),
    machine=lambda options: _generic_rating(options).stage,
    ratings=lambda options: {key: float(options[key]) for key in ("maximum_voltage", "maximum_current")},
)
