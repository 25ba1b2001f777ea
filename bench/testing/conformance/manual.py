"""What the maker's manual states of an instrument: a driver's author gives it, so that the driver is compared with it."""

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from typing import Any

from drivers.interfaces import Accuracy, Identity, InstrumentError


@dataclass(frozen=True)
class Limits:
    """The lowest and the highest value that `method` takes for `argument`, beside the other arguments in `beside`.

    Both are taken, and what is a thousandth beyond them is refused with nothing sent. `step` is what values are multiples of.
    """

    method: str
    argument: str
    lowest: float
    highest: float
    beside: Mapping[str, Any] = field(default_factory=dict)
    step: float = 0.0


@dataclass(frozen=True)
class Reply:
    """A reply that may come to messages in which the regular expression `message` is found, and the error it is told by.

    Where `error` is None it is a proper one, and everything goes on; a call that meets it returns what `reads` says, by the
    name of what is returned ("value", "resistance.value"). With `call` it comes in that method only (of a block also "… begins").
    Messages are SCPI's own, "read 1 2103H 2" (unit, address, count) for Modbus, "read 6041H 0" for CAN, "frame" for a serial
    line. `data` is the reply without its line end, the registers' or the object's bytes, the whole frame.
    """

    message: str
    data: bytes
    error: type[InstrumentError] | None = InstrumentError
    reads: Mapping[str, float] = field(default_factory=dict)
    call: str = ""


@dataclass(frozen=True)
class NotYet:
    """A reply that says "not yet": it is waited for, up to `patience` (s) where it stays so, and then told.

    With `call` it comes in that method only. A `patience` of NaN is not looked at.
    """

    message: str
    data: bytes
    patience: float = math.nan
    call: str = ""


@dataclass(frozen=True)
class Manual:
    """What the manual states, each where it is given.

    `accuracies` go by the name of the check ("at voltage: voltage reading"), `accuracies_at` by the arguments of `accuracy_at`.
    `identity` is what the driver makes of the simulated instrument's, `defaults` the options that may be left out.
    """

    identity: Identity | None = None
    defaults: Mapping[str, Any] = field(default_factory=dict)
    accuracies: Mapping[str, Accuracy] = field(default_factory=dict)
    accuracies_at: Mapping[tuple[Any, ...], Accuracy | tuple[Accuracy, ...]] = field(default_factory=dict)
    limits: Sequence[Limits] = ()
    replies: Sequence[Reply] = ()
    not_yet: Sequence[NotYet] = ()
