"""The :WAVeform subsystem of the InfiniiVision: transfer of records with what it takes to scale them."""

from collections.abc import Callable

from sim_instruments.instruments.oscilloscope.acquisition import Acquisition
from sim_instruments.instruments.oscilloscope.channels import SOURCES
from sim_instruments.instruments.oscilloscope.record import Record, Vertical
from sim_instruments.instruments.oscilloscope.transfer import (
    TEXT_WIDTH,
    as_bytes,
    as_text,
    as_words,
    block,
)
from sim_instruments.scpi.errors import ScpiError
from sim_instruments.scpi.parameters import choice, exactly, integer
from sim_instruments.scpi.settings import ScpiSettings
from sim_instruments.scpi.tree import Call, CommandTree, Handling, bare

_FORMAT_CODES = {"BYTE": 0, "WORD": 1, "ASC": 4}
_TYPE_CODES = {"NORM": 0, "PEAK": 1, "AVER": 2, "HRES": 0}
_NORMAL_POINTS = 62_500
_COUNTS = (
    100, 250, 500, 1000, 2000, 5000, 10_000, 20_000, 50_000, 100_000, 200_000, 500_000,
    1_000_000, 2_000_000, 4_000_000, 8_000_000,
)  # fmt: skip


class WaveformSubsystem:
    """Adds its headers to a tree and answers them from the last record of an acquisition; `available` says how long the next is."""

    def __init__(
        self, tree: CommandTree, settings: ScpiSettings, acquisition: Acquisition, available: Callable[[], int]
    ) -> None:
        self._settings = settings
        self._available = available
        self._acquisition = acquisition
        settings.add_choice("wav_points_mode", "WAVeform:POINts:MODE", ("NORMal", "MAXimum", "RAW"), "NORM")
        settings.add_choice("wav_order", "WAVeform:BYTeorder", ("LSBFirst", "MSBFirst"), "MSBF")
        settings.add_flag("wav_unsigned", "WAVeform:UNSigned", True)
        settings.add_choice("wav_view", "WAVeform:VIEW", ("MAIN", "ALL"), "MAIN")
        settings.add_choice("wav_format", "WAVeform:FORMat", ("BYTE", "WORD", "ASCii"), "BYTE")
        self._source = "CHAN1"
        self._points: int | None = None
        add = tree.add
        add("WAVeform:SOURce", command=self._set_source, query=bare(lambda: self._source))
        add("WAVeform:POINts", command=self._set_points, query=bare(lambda: f"{self._offered():+d}"))
        add("WAVeform:TYPE", query=bare(lambda: settings.word("type")))
        add("WAVeform:COUNt", query=bare(lambda: f"{len(self._record().triggers):+d}"))
        add("WAVeform:PREamble", query=bare(lambda: self._preamble()))
        add("WAVeform:DATA", query=bare(lambda: self._data()))
        add("WAVeform:XINCrement", query=bare(lambda: f"{self._increment():+.8E}"))
        add("WAVeform:XORigin", query=bare(lambda: f"{self._record().origin:+.8E}"))
        add("WAVeform:XREFerence", query=bare(lambda: "+0"))
        add("WAVeform:YINCrement", query=bare(lambda: f"{self._step():+.8E}"))
        add("WAVeform:YORigin", query=bare(lambda: f"{self._vertical().offset:+.8E}"))
        add("WAVeform:YREFerence", query=bare(lambda: f"{self._reference():+d}"))

    def reset(self) -> None:
        """Return to channel 1 and all points."""
        self._source, self._points = "CHAN1", None

    def _set_source(self, call: Call) -> None:
        exactly(call.arguments, 1)
        self._source = choice(call.arguments[0], SOURCES)

    def _set_points(self, call: Call) -> None:
        exactly(call.arguments, 1)
        argument = call.arguments[0]
        if argument.kind == "word" and argument.text in ("MAX", "MAXIMUM"):
            self._points = None
            return
        wanted = integer(argument, _COUNTS[0], _COUNTS[-1])
        # The instrument offers a list of counts and takes the nearest one below.
        self._points = max(count for count in _COUNTS if count <= wanted)

    def _record(self) -> Record:
        record = self._acquisition.record()
        if record is None:
            raise ScpiError(-230)
        return record

    def _vertical(self) -> Vertical:
        return self._record().verticals[int(self._source[-1])]

    def _offered(self) -> int:
        """Return how many points a transfer gives, or would give of a record that is still to come."""
        return min(self._limit, self._available()) if self._acquisition.record() is None else self._transferred()

    @property
    def _limit(self) -> int:
        mode = self._settings.word("wav_points_mode")
        stopped = self._acquisition.state == "STOP"
        limit = _NORMAL_POINTS if mode == "NORM" or not stopped else _COUNTS[-1]
        return min(limit, self._points or limit)

    def _transferred(self) -> int:
        return self._record().points(self._limit)

    def _increment(self) -> float:
        return self._record().span / self._transferred()

    def _step(self) -> float:
        step = self._vertical().step
        return step / 256.0 if self._settings.word("wav_format") == "WORD" else step

    def _reference(self) -> int:
        if self._settings.word("wav_format") == "ASC" or not self._settings.flag("wav_unsigned"):
            return 0
        return 32768 if self._settings.word("wav_format") == "WORD" else 128

    def _preamble(self) -> str:
        record = self._record()
        kind = self._settings.word("type")
        return (
            f"{_FORMAT_CODES[self._settings.word('wav_format')]:+d},{_TYPE_CODES[kind]:+d},"
            f"{self._transferred():+d},{len(record.triggers):+d},"
            f"{self._increment():+.8E},{record.origin:+.8E},+0,"
            f"{self._step():+.8E},{self._vertical().offset:+.8E},{self._reference():+d}"
        )

    def _data(self) -> Handling:
        record, vertical, channel = self._record(), self._vertical(), int(self._source[-1])
        points, settings = self._transferred(), self._settings
        form, unsigned = settings.word("wav_format"), settings.flag("wav_unsigned")
        least_first = settings.word("wav_order") == "LSBF"
        sampling = record.sampling(channel, points)
        while not sampling.done:
            sampling.go_on()
            yield 0.0
        words = sampling.words
        match form:
            case "WORD":
                return block(2 * points, as_words(words, unsigned=unsigned, least_first=least_first))
            case "BYTE":
                return block(points, as_bytes(words, unsigned=unsigned))
            case _:
                return block(TEXT_WIDTH * points - 1, as_text(words, vertical))
