"""An oscilloscope that speaks SCPI: channels, edge trigger, acquisition in virtual time; base of simulated oscilloscopes."""

from abc import abstractmethod
from collections.abc import Callable, Generator
from typing import ClassVar, Literal

from sim_instruments.catalogue import BenchPlace, SimulatedInstrument
from sim_instruments.instruments.errors import ScopeErrors
from sim_instruments.instruments.oscilloscope import pulse
from sim_instruments.instruments.oscilloscope.acquisition import Acquisition
from sim_instruments.instruments.oscilloscope.arming import Setup
from sim_instruments.instruments.oscilloscope.channels import CHANNELS, SOURCES, ChannelSubsystem, ChannelWords
from sim_instruments.instruments.oscilloscope.record import Record, WordArray, trace
from sim_instruments.instruments.oscilloscope.transfer import block
from sim_instruments.instruments.oscilloscope.trigger import TriggerSubsystem, TriggerWords
from sim_instruments.scpi.errors import ScpiError
from sim_instruments.scpi.instrument import ScpiInstrument
from sim_instruments.scpi.long_reply import LongReply
from sim_instruments.scpi.parameters import choice, choices, exactly
from sim_instruments.scpi.settings import ScpiSettings
from sim_instruments.scpi.tree import Call, Handling, bare

Phase = Literal["stopped", "running", "filling", "waiting", "triggered"]
_POLL_TIME = 1.0e-3
_SCREEN_POINTS = 62_500
#: What the instrument measures by itself, by its names.
_MEASUREMENTS = choices(("FREQuency", "VPP"))
#: Divisions that a trace must go up and down for its edges to be looked at; its noise does not.
LEAST_HEIGHT = 0.3


class SimulatedScpiOscilloscope(ScpiInstrument):
    """An oscilloscope in its place, `identity` its reply to *IDN?; `bits` is its converter's resolution outside high resolution.

    A make adds its own headers in `add_commands`. `channel_words` and `trigger_words` say how channels and trigger are spoken to,
    `channel_kind` and `trigger_kind` what else they have, `averages` the header and the greatest number of averaged records, `queue` the
    depth of its error queue.
    """

    channels = CHANNELS
    channel_kind: ClassVar[type[ChannelSubsystem]] = ChannelSubsystem
    channel_words: ClassVar[ChannelWords] = ChannelWords()
    trigger_kind: ClassVar[type[TriggerSubsystem]] = TriggerSubsystem
    trigger_words: ClassVar[TriggerWords]
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
            self.channel_words,
            self.rearm,
            lambda channel, factor: self._trigger.rescale(channel, factor),
        )
        self._trigger = self.trigger_kind(self.tree, self.settings, self._channels, self.trigger_words, self.rearm)
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
    def available(self) -> int:
        """Return how many samples the next record has."""

    # what its commands are made of

    def add_time_base(self, scale: str, offset: str, divisions: int, scales: tuple[float, float]) -> None:
        """Add the headers of the time a division (s, within `scales`) and of the time from the trigger to the screen's centre."""
        self._divisions = divisions
        changed = self.rearm
        self.settings.add_number("scale", scale, *scales, 1.0e-6, unit="S", changed=changed)
        widest = 100.0 * scales[1]
        self.settings.add_number("offset", offset, -widest, widest, 0.0, unit="S", changed=changed)

    def span(self) -> float:
        """Return the length of a record (s)."""
        return self._divisions * self.settings.number("scale")

    def origin(self) -> float:
        """Return the time from the trigger to the beginning of a record (s)."""
        return self.settings.number("offset") - self.span() / 2.0

    def shown(self) -> int:
        """Return how many channels are shown, at least one."""
        return max(1, len(self._channels.shown()))

    def add_source(self, header: str) -> None:
        """Add the header of the channel whose record is transferred."""
        names = [f"CHANnel{n}" for n in range(1, CHANNELS + 1)]
        self.settings.add_choice("source", header, names, "CHAN1")

    def add_measurements(self, header: str) -> None:
        """Add the query of the instrument's own measurement of a channel: FREQ or VPP, and the channel, are its data elements."""

        def measure(call: Call) -> Handling:
            exactly(call.arguments, 2)
            what, channel = choice(call.arguments[0], _MEASUREMENTS), choice(call.arguments[1], SOURCES)
            return f"{(yield from self.measured(what, int(channel[-1]))):.6e}"

        self.tree.add(header, query=measure)

    def transferred(self) -> tuple[Record, int]:
        """Return the last complete record and the channel that is transferred. Raises ScpiError -230 where there is none."""
        return self.record(), int(self.settings.word("source")[-1])

    def single(self) -> None:
        """Arm for one record."""
        self.acquisition.single(self._setup())

    def rearm(self, _: int = 1) -> None:
        """Restart a running acquisition with the new setting."""
        match self.acquisition.state:
            case "RUN":
                self.acquisition.run(self._setup())
            case "SING":
                self.single()

    def polled(self, reply: Callable[[], str]) -> str | Handling:
        """Delay the reply to a poll of a running acquisition by the time of a query, so that polling alone lets it end."""
        if self.acquisition.state == "STOP":
            return reply()

        def later() -> Handling:
            yield self.clock.now() + _POLL_TIME
            return reply()

        return later()

    def phase(self) -> Phase:
        """Return what the acquisition is at: stopped, running on, filling the part before the trigger, waiting for it, or after it."""
        acquisition = self.acquisition
        if acquisition.state != "SING":
            return "stopped" if acquisition.state == "STOP" else "running"
        if acquisition.waiting():
            return "waiting"
        return "triggered" if acquisition.eligible() else "filling"

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

    def bytes_between(self, first: int, last: int) -> Generator[float, None, LongReply]:
        """Return samples of the transferred channel, from the first to the last of a whole record's, as a block of bytes.

        Raises ScpiError -221 for those that the record has not.
        """
        record, channel = self.transferred()
        if not 0 <= first <= last < record.available:
            raise ScpiError(-221)
        words = yield from self.words(channel, record.available)
        return block(last - first + 1, [(words[first : last + 1] >> 8).astype("u1").tobytes()])

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


def simulated_oscilloscope(
    name: str, kind: Callable[[BenchPlace, str], SimulatedScpiOscilloscope], identity: str
) -> SimulatedInstrument:
    """Return a simulated oscilloscope of a make: its class, and who answers *IDN?."""
    return SimulatedInstrument(name, "oscilloscope", "visa", lambda place: kind(place, identity))
