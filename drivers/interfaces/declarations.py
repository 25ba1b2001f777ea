"""Declares at each method of an instrument what it does; limits, journal, rehearsal and prompts follow from the declaration."""

import math
from collections.abc import Callable, Iterator, Mapping
from dataclasses import dataclass, field, replace
from enum import Enum
from functools import cache
from inspect import Parameter
from typing import Any, Final, TypeVar

from drivers.interfaces.errors import InstrumentError
from drivers.interfaces.text import text

MethodT = TypeVar("MethodT", bound=Callable[..., Any])

#: Name of the attribute of a method that holds its Declaration.
_DECLARED = "__declaration__"


class Quantity(Enum):
    """Quantity that a limit bounds."""

    VOLTAGE = "voltage"
    CURRENT = "current"
    FREQUENCY = "frequency"
    SPEED = "speed"
    TORQUE = "torque"
    LEVEL = "level"
    INSULATION_VOLTAGE = "voltage between winding and frame"

    @property
    def limit_key(self) -> str:
        """The key of this quantity's limit in a station file."""
        return f"maximum_{'voltage' if self is Quantity.INSULATION_VOLTAGE else self.value}"


#: Stands for a property of an instrument where the number of pole pairs of the motor is meant.
POLE_PAIRS: Final = "pole pairs"


@dataclass(frozen=True)
class Converted:
    """The limit of another quantity, multiplied by `factor` and by the property `times` of the instrument (or POLE_PAIRS)."""

    quantity: Quantity
    factor: float
    times: str = ""


#: An electrical frequency turns the motor: what the limit of the speed (rad/s) leaves of it (Hz).
ELECTRICAL = (Converted(Quantity.SPEED, 1.0 / (2.0 * math.pi), times=POLE_PAIRS),)


@dataclass(frozen=True)
class Amount:
    """Quantity and unit that an argument sets, or a reading shows.

    It is held against the limit of its quantity and those in `also`. `own` is the property of the instrument that says how
    much it takes itself, `offered` the option that names the only values it takes. A `signed` one may be as large in either
    direction. A `ceiling` is kept by the instrument itself: the limits of readings bound it, and where it is left out the least
    of them and `own` is set. `label` stands for it in messages. Arguments that are components of one vector name it by `vector`:
    its length is held against the same limit.
    """

    quantity: Quantity
    unit: str
    own: str = ""
    signed: bool = False
    ceiling: bool = False
    also: tuple[Converted, ...] = ()
    label: str = ""
    offered: str = ""
    vector: str = ""


#: Declares an argument that sets no quantity: a choice, a duration, an angle.
NO_QUANTITY: Final = None


class Effect(Enum):
    """Effect of a call."""

    READING = "measures"
    QUESTION = "answers from what the driver knows"
    SETTING = "changes what feeds nothing"
    SET_POINT = "sets what the output is to hold"
    ENERGISES = "feeds energy or moves"
    MAKES_SAFE = "takes energy away"
    DISCONNECTS = "lets go of the connection"


class Lasting(Enum):
    """Time for which a call that energises does so."""

    BLOCK = "for the length of a `with` block"
    CALL = "until it returns"
    UNTIL_STOPPED = "until the instrument is stopped"


@dataclass(frozen=True)
class Declaration:
    """Declaration of what one method or property does.

    `amounts` are its bounded arguments, by name; `readings` what it returns, by field ("" for the value itself), `unit` that of
    each Reading and Waveform in what it returns. `lasting` is for a call that energises; `source` then names the method that
    measures what it switches on. `item` is what the call does in a shutdown sequence. `arguments` are those of the method, with
    their defaults (`Parameter.empty` without one). `units` are those of arguments that set no quantity, or of their fields, by
    name. `V|A` is one or the other, of a reading too. `ability` is what not every instrument of the role can do: one that cannot
    refuses the call.
    """

    effect: Effect
    amounts: Mapping[str, Amount] = field(default_factory=dict)
    readings: Mapping[str, Amount] = field(default_factory=dict)
    lasting: Lasting | None = None
    source: str = ""
    item: str = ""
    unit: str = ""
    units: Mapping[str, str] = field(default_factory=dict)
    arguments: Mapping[str, Any] = field(default_factory=dict)
    is_property: bool = False
    ability: Enum | None = None

    @property
    def is_command(self) -> bool:
        """Return whether it is written to the journal before it is sent."""
        return self.effect in (Effect.SET_POINT, Effect.ENERGISES)

    @property
    def vectors(self) -> Mapping[str, Mapping[str, Amount]]:
        """The components of each vector among its bounded arguments, by name."""
        result: dict[str, dict[str, Amount]] = {}
        for name, amount in self.amounts.items():
            if amount.vector:
                result.setdefault(amount.vector, {})[name] = amount
        return result


class DeclarationError(TypeError):
    """A method of an interface or a driver that is not declared, or not as it is."""


class UndeclaredError(InstrumentError, AttributeError):
    """A call that the interface of the instrument's role does not declare; nothing was sent."""

    def __init__(self, instrument: str, interface: type, method: str) -> None:
        super().__init__(
            instrument,
            text("{interface} declares no {method}; nothing was sent", interface=interface.__name__, method=method),
            remedy=text(
                "Declare it in the interface {interface}, as docs/reference/drivers.md says",
                interface=f"{interface.__module__}.{interface.__name__}",
            ),
        )


def reading(
    unit: str = "", quantity: Quantity | None = NO_QUANTITY, *, also: tuple[Converted, ...] = (), label: str = ""
) -> Callable[[MethodT], MethodT]:
    """Declare that a method measures; the value in `unit` is held against the limit of `quantity`, where one is given."""
    held = {} if quantity is NO_QUANTITY else {"": Amount(quantity, unit, also=also, label=label or quantity.value)}
    return _declared(Declaration(Effect.READING, readings=held, unit=unit))


def readings(**fields: Amount) -> Callable[[MethodT], MethodT]:
    """Declare that a method measures several quantities at once, each a field of what it returns."""
    return _declared(Declaration(Effect.READING, readings=_labelled(fields)))


def question(method: MethodT) -> MethodT:
    """Declare that a method or property only answers a question: nothing is sent that changes the instrument."""
    return _declared(Declaration(Effect.QUESTION))(method)


def setting(method: MethodT) -> MethodT:
    """Declare that a method changes a setting that feeds no energy: a range, a trigger, a relay, a brake."""
    return _declared(Declaration(Effect.SETTING))(method)


def set_point(**arguments: Amount | None) -> Callable[[MethodT], MethodT]:
    """Declare that a method sets what an output is to hold, and the quantity of each of its arguments."""
    return _commanding(Declaration(Effect.SET_POINT), arguments)


def energises(
    lasting: Lasting = Lasting.BLOCK, source: str = "", **arguments: Amount | None
) -> Callable[[MethodT], MethodT]:
    """Declare that a method feeds energy or moves the shaft, how long, and the quantity of each of its arguments.

    Where no argument says how much, `source` names the method whose reading is judged before it is switched on.
    """
    return _commanding(Declaration(Effect.ENERGISES, lasting=lasting, source=source), arguments)


def _amending(name: str, amended: Callable[[Declaration], Declaration]) -> Callable[[MethodT], MethodT]:
    def declare(method: MethodT) -> MethodT:
        found = declared(method)
        if found is None:
            raise DeclarationError(f"{method.__qualname__}: {name} stands above what declares what it does")
        setattr(method, _DECLARED, amended(found))
        return method

    return declare


def in_units(**units: str) -> Callable[[MethodT], MethodT]:
    """Declare the units of arguments that set no quantity, of a method that is declared already."""
    return _amending("in_units", lambda found: replace(found, units=units))


def gives_unit(unit: str) -> Callable[[MethodT], MethodT]:
    """Declare the unit of the readings in what a method returns that is declared already, as one that feeds while it measures."""
    return _amending("gives_unit", lambda found: replace(found, unit=unit))


def by_ability(ability: Enum) -> Callable[[MethodT], MethodT]:
    """Declare what an instrument must be able to do for a method that is declared already; one that cannot inherits its refusal."""
    return _amending("by_ability", lambda found: replace(found, ability=ability))


def makes_safe(item: str = "") -> Callable[[MethodT], MethodT]:
    """Declare that a method takes energy away; `item` is the name of what it does in a shutdown sequence."""
    return _declared(Declaration(Effect.MAKES_SAFE, item=item))


def disconnects(method: MethodT) -> MethodT:
    """Declare that a method closes the connection."""
    return _declared(Declaration(Effect.DISCONNECTS))(method)


def _labelled(amounts: Mapping[str, Amount]) -> dict[str, Amount]:
    return {name: replace(one, label=one.label or name.replace("_", " ")) for name, one in amounts.items()}


def _declared(declaration: Declaration) -> Callable[[MethodT], MethodT]:
    def declare(method: MethodT) -> MethodT:
        function: Any = method
        code, defaults = function.__code__, function.__defaults__ or ()
        names = code.co_varnames[1 : code.co_argcount]
        values = (*(Parameter.empty for _ in names[len(defaults) :]), *defaults)
        setattr(method, _DECLARED, replace(declaration, arguments=dict(zip(names, values, strict=True))))
        return method

    return declare


def _commanding(declaration: Declaration, quantities: Mapping[str, Amount | None]) -> Callable[[MethodT], MethodT]:
    amounts = _labelled({name: one for name, one in quantities.items() if one is not None})

    def declare(method: MethodT) -> MethodT:
        _declared(replace(declaration, amounts=amounts))(method)
        arguments = declared(method).arguments  # type: ignore[union-attr]  # it was declared in the line above
        if undeclared := [name for name in arguments if name not in quantities]:
            raise DeclarationError(
                f"{method.__qualname__}: no quantity is declared for {', '.join(undeclared)}; "
                "give each argument an Amount, or NO_QUANTITY"
            )
        if absent := [name for name in quantities if name not in arguments]:
            raise DeclarationError(
                f"{method.__qualname__} has no argument {', '.join(absent)}, for which a quantity is declared"
            )
        return method

    return declare


def declared(member: object) -> Declaration | None:
    """Return the declaration of a method or property; None if it has none."""
    return getattr(member.fget if isinstance(member, property) else member, _DECLARED, None)


@cache
def declarations(interface: type) -> Mapping[str, Declaration]:
    """Return what every public method and property of an interface does, by name."""
    result: dict[str, Declaration] = {}
    for base in reversed(interface.__mro__):
        for name, member in vars(base).items():
            if (one := declared(member)) is not None:
                result[name] = replace(one, is_property=isinstance(member, property))
    return result


def quantities(interface: type) -> frozenset[Quantity]:
    """Return every quantity that an interface sets or holds its readings against."""
    return frozenset(one.quantity for each in declarations(interface).values() for one in _amounts(each))


def _amounts(declaration: Declaration) -> Iterator[Amount]:
    yield from declaration.amounts.values()
    yield from declaration.readings.values()
