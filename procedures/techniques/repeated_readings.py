"""Readings that are repeated: one that contradicts its siblings is read again before they are averaged."""

import math
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from statistics import median
from typing import Any, Generic, Protocol, TypeVar

from drivers.interfaces import Accuracy, ImpedanceReading, Reading, Wanted
from drivers.interfaces.text import Text, text
from procedures.core.actions import DoubtReading, LinePair
from procedures.core.bench import Bench
from procedures.core.events import RepeatsTaken, RepeatStarted
from procedures.core.procedure import Procedure
from procedures.estimation.fitting.misfit import Answer, Cause, Finding, Misfit
from procedures.estimation.fitting.repeats import odd_reading, stands_out

#: A reading that is typed is asked about beyond this share of its siblings, one of an instrument read again beyond that.
TYPED_SHARE, READ_SHARE = 0.03, 0.1
#: Readings among which one that is odd can be told.
_ENOUGH = 4
#: How often a person is asked about the readings between two terminals.
_QUESTIONS = 5
_POWERS = {
    -3: text("a thousandth of"),
    -2: text("a hundredth of"),
    -1: text("a tenth of"),
    1: text("ten times"),
    2: text("a hundred times"),
    3: text("a thousand times"),
}


Read = TypeVar("Read")


class Repeated(Protocol[Read]):
    """A reading that is repeated under one condition, for parameters of these names; `terminals` is the place."""

    @property
    def terminals(self) -> str:
        """Between which terminals, or at which load."""

    @property
    def parameters(self) -> tuple[str, ...]:
        """The parameters that are made of it."""

    @property
    def name(self) -> Text:
        """The quantity's name for readers."""

    @property
    def unit(self) -> str:
        """Its unit."""

    def read(self, bench: Bench) -> Read:
        """Take one reading."""

    def typed(self, bench: Bench) -> bool:
        """Tell whether a person reads and types it."""

    def value(self, reading: Read) -> float:
        """Return the quantity's value in a reading."""

    def accuracy(self, reading: Read) -> Accuracy:
        """Return its accuracy."""


@dataclass(frozen=True)
class RepeatedReading:
    """An instrument's reading that is repeated at one load, for parameters of these names."""

    terminals: str
    name: Text
    unit: str
    parameters: tuple[str, ...]
    take: Callable[[], Reading]
    by_hand: bool

    def read(self, bench: Bench) -> Reading:
        """Take one reading."""
        return self.take()

    def typed(self, bench: Bench) -> bool:
        """Tell whether a person reads and types it."""
        return self.by_hand

    def value(self, reading: Reading) -> float:
        """Return a reading's value."""
        return reading.value

    def accuracy(self, reading: Reading) -> Accuracy:
        """Return its accuracy."""
        return reading.accuracy


@dataclass(frozen=True)
class RepeatedQuantity:
    """A quantity that the bridge reads several times between `terminals` (as A–B), for parameters of these names."""

    terminals: str
    wanted: Wanted
    parameters: tuple[str, ...]

    @property
    def name(self) -> Text:
        """The quantity's name for readers."""
        return text("resistance") if self.wanted is Wanted.RESISTANCE else text("inductance")

    @property
    def unit(self) -> str:
        """Its unit."""
        return "Ω" if self.wanted is Wanted.RESISTANCE else "H"

    def read(self, bench: Bench) -> ImpedanceReading:
        """Take one reading."""
        return bench.lcr_meter.measure(self.wanted)

    def typed(self, bench: Bench) -> bool:
        """Tell whether a person reads and types it."""
        return bench.lcr_meter.read_by_hand

    def value(self, reading: ImpedanceReading) -> float:
        """Return the quantity's value in a reading."""
        return reading.resistance if self.wanted is Wanted.RESISTANCE else reading.inductance

    def accuracy(self, reading: ImpedanceReading) -> Accuracy:
        """Return its accuracy."""
        resistive = self.wanted is Wanted.RESISTANCE
        return reading.resistance_accuracy if resistive else reading.inductance_accuracy


def between(pair: LinePair) -> str:
    """Return a pair of terminals as readers write it."""
    return f"{pair[0].value}–{pair[1].value}"


def repeated_readings(procedure: Procedure[Any], quantity: Repeated[Read], count: int) -> list[Read]:
    """Take `count` readings and return those to be averaged.

    A person is asked about a typed one that contradicts its siblings: it is typed again, or confirmed and kept. Where it was an
    instrument's, one more is read: it bears out the siblings, and the odd one is left out; or it does not, and all are kept. What is
    kept although it contradicts, and what is left out, is told.
    """
    repeats = _Repeats(procedure, quantity)
    repeats.take(range(count), count)
    left_out = repeats.ask() if quantity.typed(procedure.bench) else repeats.read_once_more()
    values = [quantity.value(reading) for reading in repeats.readings]
    procedure.bench.recorder.record(
        RepeatsTaken(
            terminals=quantity.terminals,
            quantity=str(quantity.name),
            unit=quantity.unit,
            taken=values,
            left_out=left_out,
        )
    )
    return repeats.readings


class _Repeats(Generic[Read]):
    def __init__(self, procedure: Procedure[Any], quantity: Repeated[Read]) -> None:
        self._procedure = procedure
        self._quantity = quantity
        self.readings: list[Read] = []

    @property
    def values(self) -> list[float]:
        return [self._quantity.value(reading) for reading in self.readings]

    def take(self, places: Sequence[int], count: int) -> None:
        """Take the readings of these places anew, in order."""
        bench = self._procedure.bench
        for place in places:
            bench.recorder.record(
                RepeatStarted(
                    terminals=self._quantity.terminals,
                    number=place + 1,
                    count=count,
                    again=place < len(self.readings),
                )
            )
            self.readings[place : place + 1] = [self._quantity.read(bench)]

    def ask(self) -> list[float]:
        """Ask a person about readings that contradict the others, until none does or they are confirmed; return the values typed
        instead.
        """
        replaced: list[float] = []
        confirmed: list[int] = []
        for _ in range(_QUESTIONS):
            odd = self._odd(TYPED_SHARE)
            if odd is None:
                return replaced
            if odd in confirmed or not self._procedure.bench.doubted(DoubtReading(self._contradiction(odd))):
                break
            # Of two nobody can tell which is wrong.
            places = [0, 1] if len(self.readings) == 2 else [odd]
            replaced += [self.values[place] for place in places]
            self.take(places, len(self.readings))
        self._tell_kept()
        return replaced

    def read_once_more(self) -> list[float]:
        """Read again where an instrument's reading contradicts its siblings; return what is left out."""
        if self._odd(READ_SHARE) is None:
            return []
        count = len(self.readings)
        # Of two it takes two more to tell which is the odd one.
        wanted = max(count + 1, _ENOUGH)
        for place in range(count, wanted):
            self.take([place], wanted)
        odd = self._odd(READ_SHARE)
        if odd is None or odd >= count:
            # The new one contradicts too, or the two camps are as large: nothing bears out either.
            self._tell_kept()
            return []
        rest = [value for place, value in enumerate(self.values) if place != odd]
        if not stands_out(self.values, odd) or odd_reading(rest, READ_SHARE) is not None:
            # Readings that scatter are all of one kind: without the farthest their mean would seem better than it is.
            self._tell_kept()
            return []
        said = self._contradiction(odd)
        left = self.readings.pop(odd)
        self._procedure.notice(
            Cause.REPEATS_DIFFER.value,
            text(
                "{contradiction}; a repeated reading agrees with the others, so this one is left out",
                contradiction=said,
            ),
        )
        return [self._quantity.value(left)]

    def _odd(self, share: float) -> int | None:
        accuracy = self._quantity.accuracy(self.readings[0])
        values = self.values
        limit = accuracy.gain * abs(median(values)) + accuracy.offset
        return odd_reading(values, share, limit)

    def _contradiction(self, odd: int) -> Text:
        values = self.values
        others = [value for place, value in enumerate(values) if place != odd]
        return text(
            "{quantity} {terminals}, reading {number} of {count}: it is {ratio} the other readings, {value:.4g} "
            "{unit} against {others} {unit}",
            quantity=self._quantity.name,
            terminals=self._quantity.terminals,
            number=odd + 1,
            count=len(values),
            ratio=_ratio(values[odd], median(others)),
            value=values[odd],
            unit=self._quantity.unit,
            others=[f"{value:.4g}" for value in others],
        )

    def _tell_kept(self) -> None:
        """Say that readings contradict each other and are averaged all the same; their scatter is in the interval."""
        values = self.values
        figures: dict[str, float | str] = {
            "terminals": self._quantity.terminals,
            "least": min(values),
            "most": max(values),
            "count": float(len(values)),
            "unit": self._quantity.unit,
        }
        finding = Finding(Cause.REPEATS_DIFFER, Answer.WIDENED, self._quantity.parameters, figures=figures)
        self._procedure.tell_misfit(Misfit((finding,)))


def _ratio(value: float, other: float) -> Text:
    """Return in words how a reading compares with its siblings."""
    ratio = abs(value / other) if other else math.inf
    if value * other > 0.0 and math.isfinite(ratio) and ratio > 0.0:
        power = round(math.log10(ratio))
        if power in _POWERS and abs(ratio / 10.0**power - 1.0) < 0.05:
            return _POWERS[power]
    return text("not like")
