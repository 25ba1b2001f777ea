"""An oscilloscope that speaks SCPI: channels, edge trigger, acquisition in virtual time; base of simulated oscilloscopes."""

from abc import abstractmethod
from collections.abc import Callable, Generator
from typing import ClassVar

from sim_instruments.catalogue import BenchPlace
from sim_instruments.instruments.errors import ScopeErrors
from sim_instruments.instruments.oscilloscope import pulse
from sim_instruments.instruments.oscilloscope.acquisition import Acquisition
from sim_instruments.instruments.oscilloscope.arming import Setup
from sim_instruments.instruments.oscilloscope.channels import CHANNELS, ChannelSubsystem
from sim_instruments.instruments.oscilloscope.record import Record, WordArray, trace
from sim_instruments.instruments.oscilloscope.trigger import TriggerSubsystem
from sim_instruments.scpi.errors import ScpiError
from sim_instruments.scpi.instrument import ScpiInstrument
from sim_instruments.scpi.settings import ScpiSettings
from sim_instruments.scpi.tree import Handling, bare

_POLL_TIME = 1.0e-3
_SCREEN_POINTS = 62_500
#: Divisions that a trace must go up and down for its edges to be looked at; its noise does not.
LEAST_HEIGHT = 0.3


class SimulatedScpiOscilloscope(ScpiInstrument):
    """An oscilloscope in its place, `identity` its reply to *IDN?; `bits` is its converter's resolution outside high resolution.

    A make adds its own headers in `add_commands` and says where a record lies. `channel_kind` and `trigger_kind` say how channels
    and trigger are spoken to, `averages` the header and the greatest number of averaged records, `queue` the depth of its error queue.
    """

    channels = CHANNELS
    channel_kind: ClassVar[type[ChannelSubsystem]] = ChannelSubsystem
    trigger_kind: ClassVar[type[TriggerSubsystem]]
    averages: ClassVar[tuple[str, int]] = ("ACQuire:AVERages", 1024)
    queue: ClassVar[int] = 30

    def __init__(self, place: BenchPlace, identity: str, *, bits: int = 8) -> None:
        world = place.world
        super().__init__(world.clock, place.generator, identity, queue_depth=self.queue)
        self._errors: ScopeErrors = place.errors or ScopeErrors()
        self._bits = bits
        self.acquisition = Acquisition(
            world.clock.now,
            world.probe_signal,
            world.hold_probes,
            place.generator,
            self._errors.time_base,
            world.disturbances.channel,
        )
        self.settings = ScpiSettings(self.tree, "+.8E")
        self._channels = self.channel_kind(
            self.tree,
            self.settings,
            self._errors,
            self.rearm,
            lambda channel, factor: self._trigger.rescale(channel, factor),
        )
        self._trigger = self.trigger_kind(self.tree, self.settings, self._channels, self.rearm)
        kinds, changed = ("NORMal", "AVERage", "HRESolution", "PEAK"), self.rearm
        self.settings.add_choice("type", "ACQuire:TYPE", kinds, "NORM", changed=changed)
        header, most = self.averages
        self.settings.add_integer("averages", header, 2, most, 8, changed=changed)
        self.tree.add("RUN", command=bare(lambda: self.acquisition.run(self._setup())))
        self.tree.add("STOP", command=bare(lambda: self.acquisition.stop()))
        self.tree.add("SINGle", command=bare(self.single))
        self.add_commands()
        self._stop_listening = world.clock.on_advance(self.acquisition.on_advance)
        self.reset()

    # what a make says

    @abstractmethod
    def add_commands(self) -> None:
        """Add the headers of time base, acquisition, transfer and readings."""

    @abstractmethod
    def span(self) -> float:
        """Return the length of a record (s)."""

    @abstractmethod
    def origin(self) -> float:
        """Return the time from the trigger to the beginning of a record (s)."""

    @abstractmethod
    def available(self) -> int:
        """Return how many samples the next record has."""

    # what its commands are made of

    def single(self) -> None:
        """Arm for one record."""
        self.acquisition.single(self._setup())

    def rearm(self, _: int = 1) -> None:
        """Have a running acquisition go on with the new setting."""
        match self.acquisition.state:
            case "RUN":
                self.acquisition.run(self._setup())
            case "SING":
                self.single()

    def polled(self, reply: Callable[[], str]) -> str | Handling:
        """Have a poll of a running acquisition take the time of a query, so that polling alone lets it end."""
        if self.acquisition.state == "STOP":
            return reply()

        def later() -> Handling:
            yield self.clock.now() + _POLL_TIME
            return reply()

        return later()

    def record(self) -> Record:
        """Return the last complete record. Raises ScpiError -230 where there is none."""
        record = self.acquisition.record()
        if record is None:
            raise ScpiError(-230)
        return record

    def words(self, channel: int, points: int) -> Generator[float, None, WordArray]:
        """Return the samples of a channel, 16 bits left-aligned; made in pieces, others served in between."""
        sampling = self.record().sampling(channel, points)
        while not sampling.done:
            sampling.go_on()
            yield 0.0
        return sampling.words

    def measured(self, what: str, channel: int) -> Generator[float, None, float]:
        """Return FREQ (Hz) or VPP (V or A) of what the screen shows of a channel, 9.9E37 where it shows none."""
        record = self.acquisition.record()
        if record is None:
            return pulse.NOT_MEASURABLE
        points = record.points(_SCREEN_POINTS)
        shown = yield from trace(record, channel, points)
        height = float(shown.max() - shown.min())
        if what == "VPP":
            return height
        period = pulse.period(shown) if height >= LEAST_HEIGHT * record.verticals[channel].scale else 0.0
        return points / record.span / period if 0.0 < period < pulse.NOT_MEASURABLE else pulse.NOT_MEASURABLE

    # the rest

    def close(self) -> None:
        """Stop following the clock."""
        self._stop_listening()

    def reset(self) -> None:
        """Return to the default setup: channel 1, running with automatic trigger."""
        self.settings.reset()
        self._channels.reset()
        self._trigger.reset()
        for channel in range(2, CHANNELS + 1):
            self.settings.put("display", False, channel)
        self.acquisition.run(self._setup())

    def give_up(self, busy: bool) -> None:
        """Give up an acquisition that is waited for, too."""
        if busy:
            self.acquisition.stop()
        super().give_up(busy)

    def catch_up(self) -> bool:
        """Look for the trigger a little further; return whether there is more to look through."""
        return self.acquisition.catch_up()

    def pending(self) -> float | None:
        """Return when to look again whether the single acquisition is done."""
        return self.acquisition.next_look()

    def _averages(self) -> int:
        return round(self.settings.number("averages")) if self.settings.word("type") == "AVER" else 1

    def _setup(self) -> Setup:
        kind, averages = self.settings.word("type"), self._averages()
        verticals = {
            channel: self._channels.vertical(channel, kind, averages, self._bits) for channel in range(1, CHANNELS + 1)
        }
        return Setup(
            self.origin(),
            self.span(),
            self.available(),
            verticals,
            verticals.get(self._trigger.channel),
            self._trigger.channel,
            self._trigger.edge(),
            self._trigger.automatic,
            averages,
            self.settings.number("holdoff"),
            self._trigger.path(),
        )
