"""Every method of every role says what it does, every driver has just these, and limits and journal follow from it."""

import importlib
import inspect
import math
import pkgutil
from collections.abc import Iterator, Mapping
from contextlib import contextmanager
from dataclasses import replace
from types import SimpleNamespace
from typing import Any, Protocol

import pytest
from hypothesis import given
from hypothesis import strategies as st

import drivers
from bench.journal.recording import Recording
from bench.safety.limits.bounds import OVERSHOOT, Limit, Limits
from bench.safety.limits.guard import LimitGuard, guarded
from bench.station.shutdown_sequence import OFF_BY, ShutdownAction, method_of
from bench.station.station_limits import SECTIONS
from drivers.interfaces import Instrument, LimitError, Reading, Regulated, Role, SetpointError, Supply, Voltmeter
from drivers.interfaces.declarations import (
    NO_QUANTITY,
    Amount,
    Declaration,
    DeclarationError,
    Effect,
    Lasting,
    Quantity,
    UndeclaredError,
    declarations,
    energises,
    quantities,
    reading,
    set_point,
)
from drivers.interfaces.role import ROLES
from drivers.interfaces.supply import VOLTAGE
from drivers.interfaces.text import Text
from drivers.manual.supply import ManualSupply
from procedures.core.events import Event

for module in pkgutil.walk_packages(drivers.__path__, "drivers."):
    importlib.import_module(module.name)


def classes_of(kind: type) -> Iterator[type]:
    for one in kind.__subclasses__():
        yield one
        yield from classes_of(one)


def role_of(driver: type) -> Role:
    (role,) = (role for role in Role if role.interface in driver.__mro__)
    return role


DRIVERS = sorted(
    (
        one
        for one in classes_of(Instrument)
        if one.__module__.startswith("drivers.") and Protocol not in one.__bases__ and not inspect.isabstract(one)
    ),
    key=lambda one: one.__qualname__,
)
BOUNDED = [
    (role, name, argument)
    for role in Role
    for name, one in declarations(role.interface).items()
    for argument in one.amounts
]
HELD = [
    (role, name, field) for role in Role for name, one in declarations(role.interface).items() for field in one.readings
]
NUMBERS = st.one_of(
    st.floats(min_value=-1e4, max_value=1e4), st.sampled_from([math.nan, math.inf, -math.inf, 0.0, 1.0, -1.0])
)
#: Limits of some of the quantities.
BOUNDS = st.lists(st.one_of(st.none(), st.floats(min_value=0.0, max_value=1e4)), min_size=7, max_size=7).map(
    lambda values: {
        one: Limit(value, Text("somebody")) for one, value in zip(Quantity, values, strict=True) if value is not None
    }
)
LIMITS = st.builds(Limits, BOUNDS, BOUNDS, BOUNDS)
PAIRS = st.one_of(st.none(), st.integers(min_value=1, max_value=20))


class Told:
    """An instrument that only keeps what is sent to it, in a trace that it shares with the journal."""

    def __init__(self, interface: type, trace: list[str], value: float = 0.0) -> None:
        self.interface = interface
        self.trace = trace
        self.reading = SimpleNamespace(
            value=value, speed=value, torque=value, current_amplitude=value, electrical_frequency=value
        )
        self.sent: list[tuple[tuple[Any, ...], dict[str, Any]]] = []

    def __getattr__(self, name: str) -> Any:
        declaration = declarations(self.interface).get(name)
        if declaration is None or declaration.is_property:
            return 100.0

        def call(*arguments: Any, **named: Any) -> Any:
            self.trace.append(f"sent {name}")
            self.sent.append((arguments, named))
            if declaration.lasting is Lasting.BLOCK:
                return self.block(name)
            return self.reading if declaration.effect is Effect.READING else None

        return call

    @contextmanager
    def block(self, name: str) -> Iterator[None]:
        yield

    def record(self, event: Event) -> None:
        self.trace.append(event.kind)

    def store(self, name: str, waveforms: Mapping[str, Any]) -> Any:
        raise AssertionError(name)


def behind(role: Role, limits: Limits, *, pairs: int | None = None, value: float = 0.0) -> tuple[Any, Told]:
    told = Told(role.interface, [], value)
    guard = guarded(role, told, role.value, limits, pole_pairs=lambda: pairs)  # type: ignore[arg-type]
    return Recording(guard, role.value, told, told), told


def call(instrument: Any, name: str, declaration: Declaration, arguments: dict[str, Any]) -> None:
    made = getattr(instrument, name)(**arguments)
    if declaration.lasting is Lasting.BLOCK:
        with made:
            pass


def least(limits: Limits, amount: Amount, pairs: int | None, source_impedance: float = 100.0) -> float:
    """The bound of a set point, worked out from the quantities' meaning."""
    motor = limits.readings if amount.ceiling else limits.set_points
    bound = {
        quantity: min((each[quantity].value for each in (motor, limits.station) if quantity in each), default=math.inf)
        for quantity in Quantity
    }
    if amount.quantity is Quantity.LEVEL:
        peak = min(bound[Quantity.VOLTAGE], bound[Quantity.CURRENT] * source_impedance)
        return min(bound[Quantity.LEVEL], peak / math.sqrt(2.0))
    if amount.also:
        return min(bound[amount.quantity], bound[Quantity.SPEED] * (pairs or 1) / (2.0 * math.pi))
    return bound[amount.quantity]


@pytest.mark.parametrize("role", Role)
def test_a_role_has_a_row_and_an_interface_that_declares_everything(role: Role) -> None:
    assert set(ROLES) == set(Role)
    public = {name for name in dir(role.interface) if not name.startswith("_")}
    assert set(declarations(role.interface)) == public
    assert {"identity", "close", "make_safe"} <= public
    assert method_of(ShutdownAction(ROLES[role].off_by), role) in public
    assert (role in OFF_BY) is role.feeds


@pytest.mark.parametrize("role", SECTIONS)
def test_a_station_limits_what_the_interface_declares(role: Role) -> None:
    assert set(SECTIONS[role].model_fields) == {quantity.limit_key for quantity in quantities(role.interface)}


@pytest.mark.parametrize("driver", DRIVERS, ids=lambda driver: driver.__qualname__)
def test_a_driver_has_what_its_interface_declares_and_nothing_else(driver: type) -> None:
    interface = role_of(driver).interface
    own = {name for name in dir(driver) if not name.startswith("_")}
    # What a class says of its make, and what opens an instrument, are no methods of one.
    assert own - {"data", "answers", "driver", "open"} == set(declarations(interface))
    for name, declaration in declarations(interface).items():
        member = inspect.getattr_static(driver, name)
        assert isinstance(member, property) is declaration.is_property, name
        if not declaration.is_property:
            taken = inspect.signature(getattr(driver, name)).parameters.values()
            assert {one.name: one.default for one in list(taken)[1:]} == dict(declaration.arguments), name
            assert all(one.kind is inspect.Parameter.POSITIONAL_OR_KEYWORD for one in taken), name


def test_every_role_has_a_driver() -> None:
    assert {role_of(driver) for driver in DRIVERS} == set(Role)


@given(limits=LIMITS, value=NUMBERS, pairs=PAIRS, which=st.sampled_from(BOUNDED))
def test_a_set_point_is_written_before_it_is_sent_and_refused_beyond_its_limit(
    limits: Limits, value: float, pairs: int | None, which: tuple[Role, str, str]
) -> None:
    role, name, argument = which
    declaration = declarations(role.interface)[name]
    amount = declaration.amounts[argument]
    # What else the call takes is within every limit.
    arguments = dict.fromkeys(declaration.arguments, 0.0) | {argument: value}
    instrument, told = behind(role, limits, pairs=pairs)
    bound = least(limits, amount, pairs)
    allowed = math.isfinite(value) and (-bound if amount.signed else 0.0) <= value <= bound
    if allowed:
        call(instrument, name, declaration, arguments)
        assert told.sent == [((), arguments)]
        written, *rest = told.trace
        assert written in ("commanding", "energising")
        assert rest[0] == f"sent {name}"
    else:
        with pytest.raises(SetpointError) as refused:
            call(instrument, name, declaration, arguments)
        assert told.sent == []
        assert f"{role.value}: {amount.label} = " in str(refused.value)
        assert amount.unit in str(refused.value)


@given(limits=LIMITS, value=NUMBERS, pairs=PAIRS, which=st.sampled_from(HELD))
def test_a_reading_beyond_its_limit_is_refused_once_it_is_taken(
    limits: Limits, value: float, pairs: int | None, which: tuple[Role, str, str]
) -> None:
    role, name, field = which
    amount = declarations(role.interface)[name].readings[field]
    bound = limits.reading_bound(amount.quantity).value
    if amount.also and pairs is not None:
        bound = min(bound, limits.reading_bound(Quantity.SPEED).value / (2.0 * math.pi) * pairs)
    instrument, told = behind(role, limits, pairs=pairs, value=0.0)
    setattr(told.reading, field or "value", value)
    if math.isfinite(bound) and abs(value) > OVERSHOOT * bound:
        with pytest.raises(LimitError, match=rf"{amount.label} = .* {amount.unit} is beyond"):
            getattr(instrument, name)()
        assert told.trace == [f"sent {name}", "instrument_error"]
    else:
        getattr(instrument, name)()
        assert told.trace == [f"sent {name}", "reading"]


@given(limits=LIMITS, pairs=PAIRS, which=st.sampled_from([one for one in BOUNDED if one[0] is not Role.LCR_METER]))
def test_what_an_instrument_takes_is_what_its_limits_leave_of_it(
    limits: Limits, pairs: int | None, which: tuple[Role, str, str]
) -> None:
    role, name, argument = which
    amount = declarations(role.interface)[name].amounts[argument]
    instrument, _ = behind(role, limits, pairs=pairs)
    bound = least(limits, replace(amount, ceiling=False), pairs)
    assert getattr(instrument, amount.own) == pytest.approx(min(100.0, bound))


@pytest.mark.parametrize(
    ("limits", "arguments", "sent"),
    [
        (Limits(readings={Quantity.SPEED: Limit(60.0, "the motor")}), (1.0,), ((1.0,), {"speed_limit": 60.0})),
        (Limits(readings={Quantity.SPEED: Limit(60.0, "the motor")}), (1.0, None), ((1.0, 60.0), {})),
        (Limits(readings={Quantity.SPEED: Limit(600.0, "the motor")}), (1.0, None), ((1.0, 100.0), {})),
        (Limits(), (1.0, None), ((1.0, None), {})),
    ],
)
def test_a_ceiling_that_is_left_out_is_the_least_limit(limits: Limits, arguments: Any, sent: Any) -> None:
    instrument, told = behind(Role.DYNAMOMETER, limits)
    with instrument.driving_torque(*arguments):
        pass
    assert told.sent == [sent]


def test_a_default_is_sent_as_it_was_judged() -> None:
    instrument, told = behind(Role.LCR_METER, Limits())
    instrument.configure(1e3)
    assert told.sent == [((1e3,), {"level": 1.0})]


def test_a_block_sends_nothing_before_it_is_entered_and_judges_its_source_first() -> None:
    limits = Limits(readings={Quantity.VOLTAGE: Limit(20.0, "the motor")})
    instrument, told = behind(Role.DRIVE, limits, value=24.0)
    block = instrument.running()
    assert told.trace == []
    with pytest.raises(SetpointError, match=r"drive: DC link voltage = 24 V"), block:
        pytest.fail("the drive runs")
    assert told.trace == ["energising", "sent measure_bus_voltage", "de_energised"]


def test_arguments_that_are_not_declared_are_refused() -> None:
    instrument, told = behind(Role.SUPPLY, Limits())
    for arguments, named in (
        ((1.0, 1.0, Regulated.VOLTAGE, 48.0), {}),
        ((1.0, 1.0), {"boost": 48.0}),
        ((1.0, 1.0), {"voltage": 48.0}),
        ((1.0,), {}),
    ):
        with pytest.raises(TypeError, match=r"Supply\.configure"):
            instrument.configure(*arguments, **named)
    assert told.sent == []


class WithRamp:
    """A supply's driver of no interface, with a method that nobody declared."""

    def __init__(self) -> None:
        self.voltage = 0.0

    def ramp(self, voltage: float) -> None:
        self.voltage = voltage


@pytest.mark.parametrize("wrap", ["guard", "recording"])
def test_a_method_that_is_not_declared_cannot_be_reached(wrap: str) -> None:
    driver: Any = WithRamp()
    told = Told(Supply, [])
    instrument: Any = guarded(Role.SUPPLY, driver, "left supply", Limits())
    if wrap == "recording":
        instrument = Recording(driver, "supply", told, told)
    with pytest.raises(
        UndeclaredError, match=r"supply: Supply declares no ramp; nothing was sent\. Declare it in the interface"
    ):
        instrument.ramp(48.0)
    assert not hasattr(instrument, "ramp")
    assert driver.voltage == 0.0
    assert told.trace == []


def test_a_method_that_is_not_declared_is_refused_when_its_class_is_made() -> None:
    def ramp(self: Any, voltage: float) -> None:
        self.voltage = voltage

    with pytest.raises(
        DeclarationError, match=r"Ramping\.ramp does not declare what it does; declare it in the interface"
    ):
        type("Ramping", (Supply, Protocol), {"ramp": ramp})
    with pytest.raises(DeclarationError, match=r"Ramping\.ramp does not declare"):
        type("Ramping", (ManualSupply,), {"ramp": ramp})
    with pytest.raises(DeclarationError, match=r"Ramping\.ramp does not declare"):
        type("Ramping", (WithRamp, ManualSupply), {})
    with pytest.raises(DeclarationError, match=r"Ramping\.highest does not declare"):
        type("Ramping", (ManualSupply,), {"highest": property(lambda _: 48.0)})


def test_a_declared_ramp_is_held_against_the_limit_and_written_before_it_is_sent(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    class RampingSupply(Supply, Protocol):
        @set_point(voltage=VOLTAGE)
        def ramp(self, voltage: float) -> None:
            """Go to a voltage (V) slowly."""

    class RampingByHand(ManualSupply, RampingSupply):
        trace: list[str]

        def ramp(self, voltage: float) -> None:
            self.trace.append(f"ramps to {voltage:g} V")

    told = Told(RampingSupply, [])
    driver = RampingByHand(told, told, SimpleNamespace(maximum_voltage=60.0))  # type: ignore[arg-type]
    driver.trace = told.trace
    monkeypatch.setitem(ROLES, Role.SUPPLY, replace(ROLES[Role.SUPPLY], interface=RampingSupply))  # type: ignore[arg-type]
    limits = Limits({Quantity.VOLTAGE: Limit(12.0, "the motor (nameplate.maximum_voltage)")})
    instrument: Any = Recording(guarded(Role.SUPPLY, driver, "supply", limits), "supply", told, told)
    with pytest.raises(SetpointError, match=r"supply: voltage = 48 V is outside 0 … 12 V, the limit of the motor"):
        instrument.ramp(48.0)
    assert told.trace == ["commanding", "instrument_error"]
    told.trace.clear()
    instrument.ramp(10.0)
    assert told.trace == ["commanding", "ramps to 10 V", "setting"]


def test_an_interface_that_leaves_a_method_out_makes_no_instrument() -> None:
    half = type("Half", (Supply,), {"output_off": lambda _: None})
    with pytest.raises(TypeError, match=r"abstract.*configure"):
        half()


def test_what_a_declaration_names_must_be_there() -> None:
    with pytest.raises(
        DeclarationError, match="no quantity is declared for voltage; give each argument an Amount, or NO_QUANTITY"
    ):

        @set_point()
        def ramp(self: Any, voltage: float) -> None: ...

    with pytest.raises(DeclarationError, match="has no argument current, for which a quantity is declared"):

        @energises(voltage=NO_QUANTITY, current=VOLTAGE)
        def drive(self: Any, voltage: float) -> None: ...

    @energises(source="measure_source")
    def run(self: Any) -> None: ...

    with pytest.raises(DeclarationError, match=r"run is declared by measure_source, which Running has not"):
        type("Running", (Instrument, Protocol), {"run": run})

    @set_point(voltage=Amount(Quantity.VOLTAGE, "V", own="maximum_voltage"))
    def raise_to(self: Any, voltage: float) -> None: ...

    with pytest.raises(DeclarationError, match=r"raise_to is declared by maximum_voltage, which Raising has not"):
        type("Raising", (Instrument, Protocol), {"raise_to": raise_to})


def test_a_guard_is_made_of_any_interface() -> None:
    class Meter(Instrument, Protocol):
        @reading("V", Quantity.VOLTAGE)
        def measure(self) -> Any: ...

    told = Told(Meter, [], value=13.0)
    guard = LimitGuard(Meter, told, "meter", Limits(readings={Quantity.VOLTAGE: Limit(12.0, "the motor")}))
    with pytest.raises(LimitError, match="meter: voltage = 13 V is beyond 12 V"):
        guard.measure()


def test_a_driver_declares_no_other_unit_than_its_interface() -> None:
    with pytest.raises(
        DeclarationError, match=r"Millivolts\.measure_voltage declares the unit 'mV', its interface 'V'"
    ):

        class Millivolts(Voltmeter):
            @reading("mV")
            def measure_voltage(self) -> Reading:
                raise NotImplementedError
