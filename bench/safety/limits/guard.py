"""Limiter in front of every instrument, built from its interface's declarations: refuses set points beyond a limit."""

import math
from collections.abc import Callable, Iterator, Mapping
from contextlib import AbstractContextManager
from dataclasses import replace
from functools import cache, partial
from inspect import Parameter
from types import TracebackType
from typing import Any, cast

from bench.safety.limits.bounds import Limit, Limits, Observer, check_reading, check_set_point, nobody
from bench.safety.limits.units import unit_check
from drivers.interfaces import Instrument, Role, SetpointError
from drivers.interfaces.declarations import (
    POLE_PAIRS,
    Amount,
    Converted,
    Declaration,
    Effect,
    Lasting,
    Quantity,
    UndeclaredError,
    declarations,
)
from drivers.interfaces.text import text

#: Gives the number of pole pairs, None where nobody knows it yet.
PolePairs = Callable[[], int | None]


def _unknown() -> None:
    return None


def guarded(
    role: Role,
    instrument: Instrument,
    name: str,
    limits: Limits,
    *,
    pole_pairs: PolePairs = _unknown,
    observe: Observer = nobody,
    driver: str = "",
) -> Instrument:
    """Return the instrument of a role with its limits in front; `name` stands for it in messages, `driver` for its driver.

    `observe` is called with every set point before it is judged.
    """
    return cast("Instrument", LimitGuard(role.interface, instrument, name, limits, pole_pairs, observe, driver))


class LimitGuard:
    """An instrument behind its limits; what its interface does not declare cannot be called.

    Raises SetpointError before anything is sent for a set point beyond a limit, LimitError for such a reading, InstrumentError for
    a reading in another unit than is declared, UndeclaredError for a method or property that the interface does not declare.
    """

    def __init__(
        self,
        interface: type,
        instrument: Any,
        name: str,
        limits: Limits,
        pole_pairs: PolePairs = _unknown,
        observe: Observer = nobody,
        driver: str = "",
    ) -> None:
        self._interface = interface
        self._declarations = declarations(interface)
        self._instrument = instrument
        self._name = name
        self._set_point_bounds = {quantity: limits.bound(quantity) for quantity in Quantity}
        self._reading_bounds = {quantity: limits.reading_bound(quantity) for quantity in Quantity}
        self._pole_pairs = pole_pairs
        self._observe = observe
        self._driver = driver or type(instrument).__name__

    def judge(self, method: str, *arguments: Any, **named: Any) -> None:
        """Raise SetpointError for a call with a set point beyond its limit or beyond what the instrument takes; nothing is sent."""
        declaration = self._declarations[method]
        arguments, named = self._checked(method, declaration)(arguments, named)
        given = {**dict(zip(declaration.arguments, arguments, strict=False)), **named}
        set_points = [(amount, given[argument]) for argument, amount in declaration.amounts.items()]
        set_points += [
            (_length_of(vector, components), math.hypot(*(given[argument] for argument in components)))
            for vector, components in declaration.vectors.items()
        ]
        for amount, value in set_points:
            if amount.own and value is not None:
                highest = getattr(self._instrument, amount.own)
                lowest = -highest if amount.signed else 0.0
                if not lowest <= value <= highest:
                    raise SetpointError(
                        self._name, amount.label, value, amount.unit, lowest, highest, text("the instrument")
                    )

    def __getattr__(self, attribute: str) -> Any:
        declaration = self._declarations.get(attribute)
        if declaration is None:
            raise UndeclaredError(self._name, self._interface, attribute)
        if declaration.is_property:
            value = getattr(self._instrument, attribute)
            within = _amounts_within(self._interface, attribute)
            # How much the instrument takes of a quantity is at most what its limits leave of it.
            return min([value, *(self._set_point_bound(one).value for one in within)]) if within else value
        call = self._call(attribute, declaration)
        # Found in the instance from now on: it is made once.
        self.__dict__[attribute] = call
        return call

    def _call(self, name: str, declaration: Declaration) -> Callable[..., Any]:
        if declaration.effect is Effect.READING and (declaration.readings or declaration.unit):
            return self._reading(name, declaration)
        if declaration.is_command:
            return self._command(name, declaration)
        # Looked up at each call: an instrument that was closed is another one when it has been opened again.
        return lambda *arguments, **named: getattr(self._instrument, name)(*arguments, **named)

    def _reading(self, name: str, declaration: Declaration) -> Callable[..., Any]:
        # The unit first: a limit says nothing of a number in another one.
        checks = [unit_check(self._name, self._driver, name, declaration.unit)] if declaration.unit else []
        checks += [check for found in declaration.readings.items() for check in self._reading_checks(*found)]

        def read(*arguments: Any, **named: Any) -> Any:
            result = getattr(self._instrument, name)(*arguments, **named)
            for check in checks:
                check(result)
            return result

        return read

    def _reading_checks(self, field: str, amount: Amount) -> Iterator[Callable[[Any], None]]:
        """Yield what holds one quantity of a reading against its limits; one without a limit needs nothing."""
        field = field or "value"

        def within(limit: Limit, result: Any) -> None:
            check_reading(self._name, amount, getattr(result, field), limit)

        def within_converted(rule: Converted, result: Any) -> None:
            # Without the number of pole pairs nobody knows which speed a frequency means.
            if rule.times != POLE_PAIRS or self._pole_pairs() is not None:
                within(self._converted(rule, self._reading_bounds), result)

        for rule in amount.also:
            if math.isfinite(self._reading_bounds[rule.quantity].value):
                yield partial(within_converted, rule)
        if math.isfinite((limit := self._reading_bounds[amount.quantity]).value):
            yield partial(within, limit)

    def _command(self, name: str, declaration: Declaration) -> Callable[..., Any]:
        checked = self._checked(name, declaration)
        check_unit = unit_check(self._name, self._driver, name, declaration.unit) if declaration.unit else None

        def command(*arguments: Any, **named: Any) -> Any:
            arguments, named = checked(arguments, named)
            result = getattr(self._instrument, name)(*arguments, **named)
            if check_unit is not None:
                check_unit(result)
            return result

        def block(*arguments: Any, **named: Any) -> AbstractContextManager[Any]:
            arguments, named = checked(arguments, named)
            check = partial(self._check_source, name, declaration.source) if declaration.source else None
            return _Block(check, partial(getattr(self._instrument, name), *arguments, **named))

        return block if declaration.lasting is Lasting.BLOCK else command

    def _checked(self, name: str, declaration: Declaration) -> Callable[..., tuple[tuple[Any, ...], dict[str, Any]]]:
        """Return what holds the arguments of a call against their limits and returns those to be sent."""
        defaults = declaration.arguments
        names = tuple(defaults)
        amounts = [
            (names.index(argument), argument, one, None if one.also else self._set_point_bound(one))
            for argument, one in declaration.amounts.items()
        ]
        lengths = [
            (_length_of(vector, components), tuple(map(names.index, components)), tuple(components))
            for vector, components in declaration.vectors.items()
        ]

        def checked(arguments: tuple[Any, ...], named: dict[str, Any]) -> tuple[tuple[Any, ...], dict[str, Any]]:
            count = len(arguments)
            if count > len(names) or not all(argument in names[count:] for argument in named):
                raise TypeError(f"{self._interface.__name__}.{name} takes {', '.join(names)}, as it is declared")
            for position, argument, amount, fixed in amounts:
                is_positional = position < count
                value = arguments[position] if is_positional else named.get(argument, defaults[argument])
                if value is Parameter.empty:
                    raise TypeError(f"{self._interface.__name__}.{name} needs {argument}")
                bound = fixed or self._set_point_bound(amount)
                if value is None and amount.ceiling:
                    if math.isinf(bound.value):
                        continue
                    value = min(bound.value, getattr(self._instrument, amount.own))
                else:
                    check_set_point(self._name, name, amount, value, bound, self._observe)
                # What is sent is what was judged, a default too.
                if not is_positional:
                    named = {**named, argument: value}
                elif value is not arguments[position]:
                    arguments = (*arguments[:position], value, *arguments[position + 1 :])
            for amount, positions, components in lengths:
                places = zip(positions, components, strict=True)
                length = math.hypot(*(arguments[place] if place < count else named[one] for place, one in places))
                check_set_point(self._name, name, amount, length, self._set_point_bound(amount), self._observe)
            return arguments, named

        return checked

    def _check_source(self, name: str, source: str) -> None:
        """Raise SetpointError where what is about to be switched on measures more than a limit."""
        for field, amount in self._declarations[source].readings.items():
            limit = self._reading_bounds[amount.quantity]
            if math.isfinite(limit.value):
                value = getattr(getattr(self._instrument, source)(), field or "value")
                check_set_point(self._name, name, amount, value, limit, self._observe)

    def _set_point_bound(self, amount: Amount) -> Limit:
        bounds = self._reading_bounds if amount.ceiling else self._set_point_bounds
        own = bounds[amount.quantity]
        if not amount.also:
            return own
        return min([own, *(self._converted(rule, bounds) for rule in amount.also)], key=lambda limit: limit.value)

    def _converted(self, rule: Converted, bounds: Mapping[Quantity, Limit]) -> Limit:
        limit = bounds[rule.quantity]
        if rule.times != POLE_PAIRS:
            return Limit(
                limit.value * rule.factor * (getattr(self._instrument, rule.times) if rule.times else 1.0), limit.owner
            )
        # With a single pole pair a frequency means the highest speed that it can, so that is taken where the number is not known.
        pairs = self._pole_pairs()
        if pairs is None:
            return Limit(limit.value * rule.factor, text("{owner}, pole pairs unknown: 1 taken", owner=limit.owner))
        owner = text("{owner}, {pairs} pole pairs", owner=limit.owner, pairs=pairs)
        return Limit(limit.value * rule.factor * pairs, owner)


class _Block(AbstractContextManager[Any]):
    """An energised block: nothing is asked of the instrument before it is entered, and what is switched on is judged first."""

    def __init__(self, check: Callable[[], None] | None, call: Callable[[], AbstractContextManager[Any]]) -> None:
        self._check = check
        self._call = call

    def __enter__(self) -> Any:
        if self._check is not None:
            self._check()
        self._inner = self._call()
        return self._inner.__enter__()

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
    ) -> bool | None:
        return self._inner.__exit__(kind, error, trace)


def _length_of(vector: str, components: Mapping[str, Amount]) -> Amount:
    """Return what the length of a vector is held against: what each of its components is."""
    return replace(next(iter(components.values())), signed=False, label=vector, vector="")


@cache
def _amounts_within(interface: type, name: str) -> tuple[Amount, ...]:
    """Return the set points that an instrument takes up to a property of it, each once."""
    every = (one for each in declarations(interface).values() for one in each.amounts.values())
    return tuple(dict.fromkeys(one for one in every if one.own == name and not one.ceiling))
