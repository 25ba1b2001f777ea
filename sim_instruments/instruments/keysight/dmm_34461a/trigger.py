"""Triggers, samples and reading memory of the 34461A (Truevolt guide, triggering): which readings are due, and which there are."""

import math
from collections import deque
from collections.abc import Callable

from sim_instruments.scpi.errors import ScpiError
from sim_instruments.scpi.exchange import InstrumentClock
from sim_instruments.scpi.settings import ScpiSettings
from sim_instruments.scpi.tree import Call, CommandTree, Handling, bare

_MEMORY = 10_000
MEASURING, WAITING = 0x10, 0x20


class ReadingTrigger:
    """`timing` gives how long (s) a reading looks at its input and how long it takes; `convert` makes the one that ends at a time (s).

    `measures` says whether there is a function to measure. The memory keeps the latest readings.
    """

    def __init__(
        self,
        clock: InstrumentClock,
        settings: ScpiSettings,
        timing: Callable[[], tuple[float, float]],
        convert: Callable[[float], float],
        measures: Callable[[], bool],
    ) -> None:
        self._clock = clock
        self._settings = settings
        self._timing = timing
        self._convert = convert
        self._measures = measures
        self._readings: deque[float] = deque(maxlen=_MEMORY)
        self._triggers = self._left = 0
        self._cycle = self._next_end = 0.0
        self._busy_until = -math.inf
        put = settings
        put.add_choice("source", "TRIGger:SOURce", ("IMMediate", "BUS", "EXTernal"), "IMM", changed=self.idle)
        put.add_integer("triggers", "TRIGger:COUNt", 1, 1_000_000, 1, changed=self.idle)
        put.add_number("delay", "TRIGger:DELay", 0.0, 3600.0, 0.0, unit="S", changed=self._delayed)
        put.add_flag("auto delay", "TRIGger:DELay:AUTO", True, changed=self._automatic)
        put.add_choice("slope", "TRIGger:SLOPe", ("POSitive", "NEGative"), "NEG")
        put.add_integer("samples", "SAMPle:COUNt", 1, 1_000_000, 1, changed=self.idle)

    def add_headers(self, tree: CommandTree) -> None:
        """Add what starts, ends and fetches readings."""
        tree.add("INITiate[:IMMediate]", command=bare(lambda: self._initiate()))
        tree.add("ABORt", command=bare(lambda: self.abort()))
        tree.add("READ", query=bare(lambda: self.read()))
        tree.add("FETCh", query=bare(lambda: self._fetch()))
        tree.add("DATA:POINts", query=self._points)

    def reset(self) -> None:
        """Set one reading at an immediate trigger, as CONFigure does, and clear the memory."""
        for name in ("source", "triggers", "delay", "auto delay", "slope", "samples"):
            self._settings[name].reset()
        self.idle()

    def idle(self, _: int = 1) -> None:
        """Leave whatever is being measured, and forget the readings: a new setting makes them stale."""
        self.abort()
        self._readings.clear()

    def abort(self) -> None:
        """Leave whatever is being measured."""
        self._triggers = self._left = 0
        self._busy_until = -math.inf

    def trigger(self) -> None:
        """Take the samples of one trigger, as *TRG does. Raises ScpiError -211 where no trigger is awaited."""
        if self._settings.word("source") != "BUS" or not self._triggers or self._measuring():
            raise ScpiError(-211)
        self._collect()
        self._start(1)

    def condition(self) -> int:
        """Return the bits of the operation register."""
        return MEASURING if self._measuring() else WAITING if self._triggers else 0

    def pending(self) -> float | None:
        """Return when the readings that have been triggered are done; None where none are on their way."""
        return self._busy_until if self._measuring() else None

    def read(self) -> Handling:
        """Start, and return the readings. Raises ScpiError where the trigger could not come meanwhile."""
        if self._settings.word("source") == "BUS":
            # The trigger could not come while the query waits for its readings.
            raise ScpiError(-214)
        self._initiate()
        return self._fetch()

    def _delayed(self, channel: int) -> None:
        self._settings.put("auto delay", False)
        self.idle(channel)

    def _automatic(self, channel: int) -> None:
        if self._settings.flag("auto delay"):
            self._settings["delay"].reset()
        self.idle(channel)

    def _initiate(self) -> None:
        if not self._measures():
            raise ScpiError(-221)
        if self._triggers or self._measuring():
            raise ScpiError(-213)
        self.idle()
        self._triggers = round(self._settings.number("triggers"))
        if self._settings.word("source") == "IMM":
            self._start(self._triggers)

    def _start(self, triggers: int) -> None:
        self._triggers -= triggers
        self._left = triggers * round(self._settings.number("samples"))
        (integration, duration), delay = self._timing(), self._settings.number("delay")
        self._cycle = delay + duration
        # Input first, then the unit's own zero.
        self._next_end = self._clock.now() + delay + integration
        self._busy_until = self._clock.now() + self._left * self._cycle

    def _measuring(self) -> bool:
        return self._clock.now() < self._busy_until

    def _fetch(self) -> Handling:
        while self._left:
            yield self._next_end
            self._collect()
        if self._measuring():
            yield self._busy_until
        if self._triggers:
            yield math.inf
        if not self._readings:
            raise ScpiError(-230)
        return ",".join(f"{reading:+.8E}" for reading in self._readings)

    def _points(self, call: Call) -> str:
        if call.arguments:
            raise ScpiError(-108)
        self._collect()
        return f"{len(self._readings):+d}"

    def _collect(self) -> None:
        """Convert what has been integrated by now."""
        while self._left and self._next_end <= self._clock.now():
            end = self._next_end
            self._left -= 1
            self._next_end += self._cycle
            self._readings.append(self._convert(end))
