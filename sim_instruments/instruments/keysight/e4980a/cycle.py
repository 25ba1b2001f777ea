"""The measurement cycle of an E4980A: continuous measurements, or measurements begun by a trigger (user's guide, trigger system)."""

import math
from collections.abc import Callable, Generator

from sim_instruments.instruments.keysight.e4980a.list import SweepList
from sim_instruments.instruments.keysight.e4980a.measurement import BridgeResult, Conditions
from sim_instruments.scpi.errors import ScpiError
from sim_instruments.scpi.exchange import InstrumentClock
from sim_instruments.scpi.settings import ScpiSettings
from sim_instruments.scpi.tree import CommandTree, bare

#: The pages on which the bridge measures, the LIST page aside.
_MEASURING_PAGES = ("MEAS", "BNUM", "BCO", "MLAR")


class MeasuringCycle:
    """`conditions` gives what the bridge is set to, `read` the reading that ends at a time (s).

    On the LIST page a trigger takes the list's points.
    """

    def __init__(
        self,
        tree: CommandTree,
        clock: InstrumentClock,
        settings: ScpiSettings,
        sweep_list: SweepList,
        conditions: Callable[[], Conditions],
        read: Callable[[Conditions, float], BridgeResult],
    ) -> None:
        self._clock, self._settings, self._list = clock, settings, sweep_list
        self._conditions, self._read = conditions, read
        self._waiting = False
        #: When the measurement that has been triggered is done (s).
        self.due: float | None = None
        self._reading: BridgeResult | None = None
        self._sweep: list[BridgeResult] = []
        self._triggered: list[Conditions] = []
        self._free = True
        self._since = 0.0
        sources = ("INTernal", "HOLD", "EXTernal", "BUS")
        settings.add_choice("trigger", "TRIGger:SOURce", sources, "INT", changed=self.forget)
        settings.add_number("delay", "TRIGger:DELay", 0.0, 999.0, 0.0, unit="S", changed=self.forget)
        settings.add_flag("continuous", "INITiate:CONTinuous", True, changed=self._continue)
        tree.add("TRIGger[:IMMediate]", command=bare(self._start))
        tree.add("INITiate[:IMMediate]", command=bare(self._initiate))
        tree.add("ABORt", command=bare(self.abort))

    def forget(self, _: int = 1) -> None:
        """Forget what has been measured, and begin anew: a setting has changed."""
        self._reading, self.due, self._sweep = None, None, []
        self._since = self._clock.now()

    def _continue(self, _: int) -> None:
        """Run freely, or stop with what the last full cycle gave."""
        continuous = self._settings.flag("continuous")
        if self._free and not continuous and self._runs and self._clock.now() > self._since:
            conditions, now = self._conditions(), self._clock.now()
            if now - self._since >= conditions.duration:
                self._reading = self._read(conditions, now)
        elif continuous and not self._free:
            self._since = self._clock.now()
        self._free = continuous

    def turn_page(self, _: int) -> None:
        """Give up what is being measured: another page of the display is shown."""
        # Readings go from page to page, but no measurement does.
        self.due = None
        self._sweep = []
        self._list.rewind()
        self._since = self._clock.now()

    @property
    def page(self) -> str:
        """The page of the display, in its short form."""
        return self._settings.word("page")

    @property
    def _runs(self) -> bool:
        """Return whether the internal trigger starts one measurement after the other."""
        return self._settings.word("trigger") == "INT" and self.page in _MEASURING_PAGES

    @property
    def measuring(self) -> bool:
        """True while a triggered measurement is in progress."""
        return self.due is not None and self._clock.now() < self.due

    def _initiate(self) -> None:
        if self._settings.flag("continuous") or self._waiting:
            raise ScpiError(-213)
        self._waiting = True
        if self._runs:
            self._begin_measurement()

    def abort(self) -> None:
        """Await no trigger, and give up the measurement that one began."""
        self._waiting = False
        self.due = None

    def bus_trigger(self) -> None:
        """Act on *TRG. Raises ScpiError -211 where no trigger of the bus is awaited."""
        if self._settings.word("trigger") != "BUS":
            raise ScpiError(-211)
        self._start()

    def _start(self) -> None:
        """Act on a trigger of the bus or TRIGger:IMMediate."""
        if self._settings.word("trigger") != "BUS" and self._settings.word("trigger") != "HOLD":
            raise ScpiError(-211)
        if not (self._settings.flag("continuous") or self._waiting):
            raise ScpiError(-211)
        if self.measuring or self.page not in (*_MEASURING_PAGES, "LIST"):
            raise ScpiError(-211)
        self._begin_measurement()

    def _begin_measurement(self) -> None:
        self._waiting = False
        self._reading, self._sweep = None, []
        conditions = self._conditions()
        self._triggered = self._list.triggered(conditions) if self.page == "LIST" else [conditions]
        self.due = self._clock.now() + sum(conditions.duration for conditions in self._triggered)

    def result(self) -> Generator[float, None, BridgeResult | None]:
        """Wait for the measurement that is under way, and return the last reading, None where there is none."""
        if self._runs and self._settings.flag("continuous"):
            # Free running: the reading of the last full cycle, at once where there is one.
            cycle = self._conditions().duration
            done = self._since + cycle * max(1, math.floor((self._clock.now() - self._since) / cycle + 1e-9))
            if self._reading is None or done > self._reading.time:
                yield done
                self._reading = self._read(self._conditions(), done)
        elif self.due is not None:
            yield self.due
            results = [self._read(conditions, self._clock.now()) for conditions in self._triggered]
            self._reading = results[-1] if results else None
            self._sweep = results if self.page == "LIST" else []
            self.due = None
        return self._reading

    def swept(self) -> list[tuple[Conditions, BridgeResult | None]]:
        """Return the points of the list with their readings, with None where they have not been measured."""
        if self._sweep:
            return list(zip(self._triggered, self._sweep, strict=True))
        return [(at, None) for at in self._list.waiting(self._conditions())]
