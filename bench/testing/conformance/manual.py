"""The maker's statements about an instrument, which a driver's author gives, so that the driver is compared with them."""

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
    line. `data` is the reply without its line end, the registers' or the object's bytes, the whole frame; None is silence.
    """

    message: str
    data: bytes | None
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
    `between` (a regular expression) is what may be sent again while it is waited for.
    """

    message: str
    data: bytes
    patience: float = math.nan
    call: str = ""
    told: bool = True
    between: str = "ERR"


@dataclass(frozen=True)
class Model:
    """An instrument, another one by its answers, or other options: what the driver says of it then, or the error it opens with.

    `answers` are replies by their message (a regular expression; as in a `Reply`), None where it has no such thing and says so.
    `states` are properties by their name, or what a method called with nothing returns ("measure_frequency.value"), or with arguments
    (`("attenuation", 1)`). `refuses` are calls, named in the same way, that it cannot do, by their error. Each error `says` so in its
    text. `holds` is what the instrument itself has after a use, past the driver: the reply to a query, or what a message named as in a
    `Reply` reads: registers, or an object's number.
    """

    answers: Mapping[str, bytes | None] = field(default_factory=dict)
    options: Mapping[str, Any] = field(default_factory=dict)
    states: Mapping[str | tuple[Any, ...], Any] = field(default_factory=dict)
    error: type[Exception] | tuple[type[Exception], ...] = ()
    says: str = ""
    holds: Mapping[str, Any] = field(default_factory=dict)
    refuses: Mapping[str | tuple[Any, ...], type[Exception]] = field(default_factory=dict)


@dataclass(frozen=True)
class Left:
    """A setting as the last user may have left it, and what becomes of it when the driver opens the instrument.

    `leave` are program messages, or gets the simulated instrument and leaves it so. `now` gets it and returns the setting as it is at
    present; of SCPI, `query` asks for it. The row of `found_state` whose query begins with `query` tells it as `found`; with `wanted`
    it is set to that while it is in use, told as changed, and put back by close(). Instead of that, with `error` it is not opened, and
    left alone; the error `says` so in its text. One that is `watched` is told where somebody changes it during use. What is only told
    and `alters` figures is for a person: what is measured then is not looked at. One that is not `told`, such as the mode that each
    use sets anyway, is only put back. `options` are those beside the others.
    """

    query: str
    leave: Callable[[Any], Any] | str
    found: str = ""
    wanted: str = ""
    now: Callable[[Any], Any] | None = None
    error: type[Exception] | None = None
    says: str = ""
    watched: bool = False
    alters: bool = False
    told: bool = True
    options: Mapping[str, Any] = field(default_factory=dict)


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
    """The maker's statements about an instrument; all are optional.

    `accuracies` go by the name of the check ("at voltage: voltage reading"), `accuracies_at` by the arguments of `accuracy_at`, with the
    error where it states none.
    `identity` is what the driver makes of the simulated instrument's, `defaults` the options that may be left out. `takes` is how
    long (s) a call of a method lasts, at least and at most; `steps` are those to which a setting is rounded that a query (a
    regular expression) reads back; `port` is how a serial line is set up (`baudrate`, `parity` … as pyserial names them). `left` are
    settings that a last user may have left. `lacks` are messages (regular expressions) that others of its family refuse: the driver
    does without them, and tells where any other of its questions at opening is refused. `others` are replies to the question that it
    is recognised by, of instruments that are none of its. `trip` is a fault of its own, `stopped` what somebody else may do to it
    while it feeds, as another master that takes its enable away. `local` is the message (a regular expression) that gives the front
    panel back, the last that close() sends. `full_scale_gain` is an oscilloscope's limit of gain as a share of full scale.
    `running` gets the simulated instrument and leaves it running, as another program has: it is then used at once, without
    make_safe() before.
    """

    identity: Identity | None = None
    defaults: Mapping[str, Any] = field(default_factory=dict)
    accuracies: Mapping[str, Accuracy] = field(default_factory=dict)
    accuracies_at: Mapping[tuple[Any, ...], Accuracy | tuple[Accuracy, ...] | type[InstrumentError]] = field(
        default_factory=dict
    )
    limits: Sequence[StatedLimits] = ()
    replies: Sequence[Reply] = ()
    not_yet: Sequence[NotYet] = ()
    models: Sequence[Model] = ()
    trip: ProtectionTrip | None = None
    stopped: ProtectionTrip | None = None
    takes: Mapping[str, tuple[float, float]] = field(default_factory=dict)
    steps: Mapping[str, float] = field(default_factory=dict)
    port: Mapping[str, Any] = field(default_factory=dict)
    left: Sequence[Left] = ()
    lacks: Sequence[str] | None = None
    others: Sequence[Any] = ()
    local: str = ""
    full_scale_gain: float | None = None
    running: Callable[[Any], None] | None = None
