"""What the maker's manual states of an instrument: a driver's author gives it, so that the driver is compared with it."""

import math
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field
from typing import Any

from drivers.interfaces import Accuracy, Identity, InstrumentError


@dataclass(frozen=True)
class StatedLimits:
    """The lowest and the highest value that `method` takes for `argument`, beside the other arguments in `beside`.

    Both are taken, and what is `beyond` them by so much, a thousandth unless given, is refused with nothing sent. `step` is what
    values are multiples of. `of` makes the argument of a value, where it is no number.
    """

    method: str
    argument: str
    lowest: float
    highest: float
    beside: Mapping[str, Any] = field(default_factory=dict)
    step: float = 0.0
    beyond: float = 0.0
    of: Callable[[float], Any] = lambda value: value


@dataclass(frozen=True)
class Reply:
    """A reply that may come to messages in which the regular expression `message` is found, and the error it is told by.

    Where `error` is None it is a proper one, and everything goes on; a call that meets it returns what `reads` says, by the
    name of what is returned ("value", "resistance.value", "1.clipped"; "" is all of it). It is told `within` so long (s), and the
    error `says` so in its text.
    With `call` it comes in that method only (of a block also "… begins"), and some such message must be sent there; with `after`
    it comes once a message in which that is found was sent in the same call, so many `times` at most. `beside` are replies that
    come with it.
    Messages are SCPI's own, "read 1 2103H 2" (unit, address, count) for Modbus, "read 6041H 0" for CAN, "frame" for a serial
    line. `data` is the reply without its line end, the registers' or the object's bytes, the whole frame.
    """

    message: str
    data: bytes
    error: type[InstrumentError] | None = InstrumentError
    reads: Mapping[str, Any] = field(default_factory=dict)
    call: str = ""
    after: str = ""
    within: float = math.inf
    says: str = ""
    beside: Mapping[str, bytes] = field(default_factory=dict)
    times: float = math.inf


@dataclass(frozen=True)
class NotYet:
    """A reply that says "not yet": it is waited for, up to `patience` (s) where it stays so, and then told.

    With `call` it comes in that method only. A `patience` of NaN is not looked at. Where it is not `told`, everything goes on then.
    """

    message: str
    data: bytes
    patience: float = math.nan
    call: str = ""
    told: bool = True


@dataclass(frozen=True)
class Model:
    """Another instrument, or other options, that the driver opens with: what it says of it then, or the error it opens with.

    `answers` are replies by their message (of SCPI, a regular expression), `states` are properties by their name.
    """

    answers: Mapping[str, bytes] = field(default_factory=dict)
    options: Mapping[str, Any] = field(default_factory=dict)
    states: Mapping[str, Any] = field(default_factory=dict)
    error: type[Exception] | tuple[type[Exception], ...] = ()


@dataclass(frozen=True)
class ProtectionTrip:
    """A fault of the instrument's own: `make` gets the simulated one, and has it switch itself off, with a fault that stays.

    It is told by a ReportedError that `says` so in its text, `within` so long (s) more than the use takes without it. Where
    `make_safe` `resets` it, the next use is right.
    """

    make: Callable[[Any], None]
    says: str = ""
    within: float = math.inf
    resets: bool = True


@dataclass(frozen=True)
class Manual:
    """What the manual states, each where it is given.

    `accuracies` go by the name of the check ("at voltage: voltage reading"), `accuracies_at` by the arguments of `accuracy_at`.
    `identity` is what the driver makes of the simulated instrument's, `defaults` the options that may be left out. `takes` is how
    long (s) a call of a method lasts, at least and at most; `steps` are those to which a setting is rounded that a query (a
    regular expression) reads back; `port` is how a serial line is set up (`baudrate`, `parity` … as pyserial names them).
    """

    identity: Identity | None = None
    defaults: Mapping[str, Any] = field(default_factory=dict)
    accuracies: Mapping[str, Accuracy] = field(default_factory=dict)
    accuracies_at: Mapping[tuple[Any, ...], Accuracy | tuple[Accuracy, ...]] = field(default_factory=dict)
    limits: Sequence[StatedLimits] = ()
    replies: Sequence[Reply] = ()
    not_yet: Sequence[NotYet] = ()
    models: Sequence[Model] = ()
    trip: ProtectionTrip | None = None
    takes: Mapping[str, tuple[float, float]] = field(default_factory=dict)
    steps: Mapping[str, float] = field(default_factory=dict)
    port: Mapping[str, Any] = field(default_factory=dict)
