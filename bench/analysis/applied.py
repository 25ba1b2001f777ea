"""The stated accuracy put on what an analysis found."""

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, replace

import numpy as np
from GTC.lib import UncertainReal

from bench.analysis.statements import Statement
from bench.captures import Capture
from bench.captures.capture import same_name
from bench.captures.written_digits import FloatArray
from drivers.interfaces import Accuracy
from drivers.interfaces.full_scale import gain_of_full_scale
from drivers.interfaces.text import Text, text, word
from procedures.core.budget import Uncertainties

#: What a budget's rows say of where the limits come from.
_SOURCE = "as stated"
#: A trace that fills less of its range than the largest step of 1, 2, 5 leaves would have had a finer one.
_FINEST = 2.5


@dataclass(frozen=True)
class _Kind:
    unit: str
    instrument: str
    said: Text


_KINDS: Mapping[str, _Kind] = {
    "voltage": _Kind("V", "voltage channels", text("voltage")),
    "current": _Kind("A", "current channels", text("current")),
    "speed": _Kind("rad/s", "speed", text("speed")),
    "torque": _Kind("N·m", "torque", text("torque")),
    "inductance": _Kind("H", "inductance meter", text("inductance")),
    "time": _Kind("", "time base", text("time")),
}


@dataclass(frozen=True)
class ErrorInput:
    """One error that is common to an instrument's channels of one kind: its `gain`, or its `offset`.

    `limits` are the channels' half-widths, relative for a gain, else in SI.
    """

    kind: str
    instrument: str
    gain: bool
    limits: Mapping[str, float]

    def on(self, kind: str, channel: str, values: FloatArray, by: float) -> FloatArray:
        """Return a channel's values (SI) off by this error at its limit times `by`; as they are where it is not theirs."""
        if kind != self.kind or channel not in self.limits:
            return values
        limit = by * self.limits[channel]
        return values * (1.0 + limit) if self.gain else values + limit

    def __str__(self) -> str:
        """Return it as messages name it."""
        return f"{self.kind}, {'gain' if self.gain else 'offset'} ±{max(self.limits.values()):g}"


class AppliedAccuracy:
    """The accuracy stated for the channels that one analysis uses.

    The channels of a kind share one gain and one offset error, as those of one scope do, unless a file names other
    instruments: averaging them does not reduce it.
    """

    def __init__(
        self, statements: Sequence[Statement], uses: Mapping[str, Sequence[str]], captures: Sequence[Capture]
    ) -> None:
        """Take the statements for `uses`, names of channels by kind. Raises InputError for one that is about none of them."""
        #: Names of the channels that the analysis uses.
        self.channels = frozenset(name for names in uses.values() for name in names)
        self._limits: dict[tuple[str, str], Statement] = {}
        self._captures = captures
        self._assumed_ranges: dict[str, str] = {}
        self._ranges = _stated_ranges([s for s in statements if s.range_only], uses)
        statements = [s for s in statements if not s.range_only]
        kinds = [s for s in statements if s.name in _KINDS]
        for statement in kinds:
            if statement.name not in uses:
                raise statement.error(
                    text("this analysis uses no {name}; {allowed}", name=statement.name, allowed=_allowed(uses))
                )
            for channel in uses[statement.name]:
                self._take(statement.name, channel, statement)
        for statement in statements:
            if statement in kinds:
                continue
            meant = [(kind, c) for kind, names in uses.items() for c in names if same_name(c, statement.name)]
            if not meant:
                there = any(same_name(c.name, statement.name) for capture in captures for c in capture.channels)
                allowed = _allowed(uses)
                if there:
                    raise statement.error(
                        text("'{name}' is not used here; {allowed}", name=statement.name, allowed=allowed)
                    )
                raise statement.error(
                    text("the capture has no channel '{name}'; {allowed}", name=statement.name, allowed=allowed)
                )
            for kind, channel in meant:
                self._take(kind, channel, statement)
        self._limits = {
            (k, n): self._limits[k, n] for k, names in uses.items() for n in names if (k, n) in self._limits
        }
        self._missing = [kind for kind, names in uses.items() if any((kind, n) not in self._limits for n in names)]

    @property
    def stated(self) -> bool:
        """True if any limit was stated."""
        return bool(self._limits)

    def inputs(self) -> Iterator[ErrorInput]:
        """Give every common error once."""
        for gain in (True, False):
            groups: dict[tuple[str, str], dict[str, float]] = {}
            for (kind, channel), statement in self._limits.items():
                limit = statement.gain if gain else statement.offset
                if limit:
                    groups.setdefault((kind, _instrument(kind, statement)), {})[channel] = limit
            for (kind, instrument), limits in groups.items():
                yield ErrorInput(kind, instrument, gain, limits)

    def gain(self, kind: str, channel: str) -> float:
        """Return the half-width of a channel's gain error (relative); 0 where none was stated."""
        statement = self._limits.get((kind, channel))
        return statement.gain if statement else 0.0

    def offset(self, kind: str, channel: str) -> float:
        """Return the half-width of a channel's offset (SI); 0 where none was stated."""
        statement = self._limits.get((kind, channel))
        return statement.offset if statement else 0.0

    def on(
        self,
        uncertainties: Uncertainties,
        quantity: UncertainReal,
        kind: str,
        channel: str,
        *,
        gain: float = 0.0,
        offset: float = 0.0,
    ) -> UncertainReal:
        """Return the quantity with a channel's errors put on: it goes with the `gain`-th power of the channel, and with
        `offset` times the channel's offset.
        """
        statement = self._limits.get((kind, channel))
        if statement is None:
            return quantity
        accuracy = Accuracy(gain=gain * statement.gain, offset=offset * statement.offset, source=_SOURCE)
        return uncertainties.instrument(_instrument(kind, statement), quantity, accuracy)

    @staticmethod
    def change(uncertainties: Uncertainties, quantity: UncertainReal, error: ErrorInput, by: float) -> UncertainReal:
        """Return the quantity with an error put on that changes it `by` so much at its limit."""
        if not by:
            return quantity
        accuracy = (
            Accuracy(gain=by / float(quantity.x), source=_SOURCE) if error.gain else Accuracy(offset=by, source=_SOURCE)
        )
        return uncertainties.instrument(error.instrument, quantity, accuracy)

    def sentences(self) -> list[Text]:
        """Return what a result says about its uncertainties."""
        by_statement: dict[str, tuple[str, list[str], Statement]] = {}
        for (kind, channel), statement in self._limits.items():
            by_statement.setdefault(f"{statement.given}, {kind}, {statement.gain:g}", (kind, [], statement))[1].append(
                channel
            )
        messages: list[Text] = []
        for kind, channels, statement in by_statement.values():
            whose = _KINDS[kind].said
            if kind != "time":
                whose = text("{kind} ({channels})", kind=whose, channels=list(dict.fromkeys(channels)))
            messages.append(
                text(
                    "accuracy of {whose} as stated: {limits}, rectangular (Type B)",
                    whose=whose,
                    limits=_shown(statement, _KINDS[kind].unit),
                )
            )
        together: dict[str, list[str]] = {}
        for (kind, channel), statement in self._limits.items():
            together.setdefault(_instrument(kind, statement), []).append(channel)
        for instrument, channels in together.items():
            if len(channels) > 1:
                messages.append(
                    text(
                        "{instrument} ({channels}): errors assumed common to these channels, because one "
                        "instrument reads them; averaging the channels does not reduce the errors",
                        instrument=word(instrument),
                        channels=channels,
                    )
                )
        for channel, assumed in self._assumed_ranges.items():
            messages.append(
                text(
                    "the range of {channel} is not stated. It is assumed to be {assumed}, {finest:g} times the "
                    "span of the signal, because a finer step of 1, 2, 5 would have held the signal. State the "
                    "range with --full-scale {channel}=RANGE",
                    channel=channel,
                    assumed=assumed,
                    finest=_FINEST,
                )
            )
        if self._missing:
            messages.append(
                text(
                    "accuracy of {kinds} not stated: assumed exact, except for errors that the fit detects",
                    kinds=[_KINDS[kind].said for kind in self._missing],
                )
            )
        return messages

    def _take(self, kind: str, channel: str, statement: Statement) -> None:
        if kind == "time" and statement.offset:
            raise statement.error(text("a time base has a gain only; allowed is a number in % or ppm, as in 25ppm"))
        unit = _KINDS[kind].unit
        if statement.unit and statement.unit != unit:
            raise statement.error(
                text(
                    "an offset in {unit}; allowed for {kind} is one in {allowed}",
                    unit=statement.unit,
                    kind=kind,
                    allowed=unit,
                )
            )
        self._limits[kind, channel] = self._of_reading(kind, channel, statement)

    def _of_reading(self, kind: str, channel: str, statement: Statement) -> Statement:
        """Return the statement with its share of full scale as a limit of gain of the channel's trace."""
        if not statement.full_scale_share:
            return statement
        seen = [c for capture in self._captures for c in capture.channels if c.name == channel and c.values.size]
        if kind == "time" or not any(np.any(c.values) for c in seen):
            raise statement.error(
                text("'{name}' has no readings that could be compared with a full scale", name=channel)
            )
        low, high = min(float(c.values.min()) for c in seen), max(float(c.values.max()) for c in seen)
        stated, own = self._ranges.get((kind, channel)), max(c.full_scale for c in seen)
        full_scale = stated.full_scale if stated else statement.full_scale or own
        if (stated or statement.full_scale) and high - low > 1.01 * full_scale:
            raise (stated or statement).error(
                text(
                    "'{name}' spans {span:.4g}, beyond the full scale of {full:.4g} {unit}; give the range that was set (limits hold for "
                    "the values after --scale)",
                    name=channel,
                    span=high - low,
                    full=full_scale,
                    unit=_KINDS[kind].unit,
                )
            )
        if not full_scale:
            full_scale = _FINEST * max(high - low, abs(low), abs(high))
            self._assumed_ranges[channel] = f"{full_scale:.3g} {_KINDS[kind].unit}"
        gain = gain_of_full_scale(statement.full_scale_share, full_scale, low, high)
        return replace(statement, gain=statement.gain + gain, full_scale=full_scale)


def _stated_ranges(
    statements: Sequence[Statement], uses: Mapping[str, Sequence[str]]
) -> dict[tuple[str, str], Statement]:
    """Return what `--full-scale` states, by kind and channel. Raises UsageError for one that is about none of them."""
    result = {}
    # A channel's own statement overrules its kind's.
    for statement in sorted(statements, key=lambda each: each.name not in uses):
        meant = [
            (kind, c)
            for kind, names in uses.items()
            for c in names
            if kind != "time" and (kind == statement.name or same_name(c, statement.name))
        ]
        if not meant:
            raise statement.error(
                text("this analysis has no channel '{name}'; {allowed}", name=statement.name, allowed=_allowed(uses))
            )
        for kind, channel in meant:
            if statement.unit != _KINDS[kind].unit:
                raise statement.error(
                    text(
                        "a full scale in {unit}; allowed for {kind} is one in {allowed}",
                        unit=statement.unit,
                        kind=kind,
                        allowed=_KINDS[kind].unit,
                    )
                )
            result[kind, channel] = statement
    return result


def _instrument(kind: str, statement: Statement) -> str:
    return f"{statement.instrument}, {kind}" if statement.instrument else _KINDS[kind].instrument


def _allowed(uses: Mapping[str, Sequence[str]]) -> Text:
    channels = dict.fromkeys(name for kind, names in uses.items() if kind != "time" for name in names)
    return text(
        "allowed are {kinds} (all of a kind) and its channels {channels}", kinds=list(uses), channels=list(channels)
    )


def _shown(statement: Statement, unit: str) -> Text | str:
    gain: Text | str = f"±{100 * statement.gain:.4g} %" if statement.gain >= 1e-4 else f"±{1e6 * statement.gain:g} ppm"
    if statement.full_scale_share:
        gain = text(
            "{gain} (with ±{share:g} % of full scale, {full:g} {unit}: {reading})",
            gain=gain,
            share=100 * statement.full_scale_share,
            full=statement.full_scale,
            unit=unit,
            reading=text("a difference of any two points on the screen has at most this error"),
        )
    offset = f"±{statement.offset:g} {unit}"
    if statement.gain and statement.offset:
        return text("{gain} and {offset}", gain=gain, offset=offset)
    return gain if statement.gain else offset if statement.offset else text("exact")
