"""The result of every reader of captures, and the error that it raises."""

import re
from collections.abc import Mapping
from dataclasses import dataclass, replace

import numpy as np

from bench.captures.written_digits import FloatArray, steps_and_rounding
from bench.i18n.errors import InputError, at
from drivers.interfaces.text import Text, text

#: Of a deep record so many samples are evaluated at least.
_ENOUGH = 50_000


class CaptureError(InputError):
    """A capture that cannot be used; the message names file and line, what is wrong and what to do."""

    def __init__(self, source: str, what: Text | str, line: int | None = None) -> None:
        self.source = source
        self.line = line
        self.what = what
        super().__init__(at(text("{source}, line {line}", source=source, line=line) if line else source, what))


@dataclass(frozen=True)
class ProbeFactor:
    """The factor of a channel's readings, and the unit (SI) that they then have; "" if the unit stays."""

    factor: float
    unit: str = ""


@dataclass(frozen=True)
class CaptureChannel:
    """One column: `values` (n,) in `unit` (SI; empty where the file does not say); `resolution` one converter step, or 0.

    `full_scale` is the range that was set (SI, the whole screen), 0 where the file does not say.
    `clipped` tells whether readings reached an end of the converter, `coupling` is "dc" or "ac"; None and empty where no one says.
    `rounding` is the half-width, as a share of the large values, of an error that all of them share because the file has few digits.
    """

    name: str
    unit: str
    values: FloatArray
    resolution: float = 0.0
    clipped: bool | None = None
    coupling: str = ""
    full_scale: float = 0.0
    rounding: float = 0.0

    @classmethod
    def written(
        cls,
        name: str,
        unit: str,
        values: FloatArray,
        clipped: bool | None = None,
        coupling: str = "",
        full_scale: float = 0.0,
    ) -> "CaptureChannel":
        """Return a column of a text file, with what its numbers themselves say of the converter's step and of their rounding."""
        step, rounding = steps_and_rounding(values)
        return cls(name, unit, values, step, clipped, coupling, full_scale, rounding)

    @property
    def ends(self) -> tuple[float, float] | None:
        """The least and the largest value that the converter gives, where the file says that it reached them."""
        return (float(np.min(self.values)), float(np.max(self.values))) if self.clipped else None

    def thinned(self, every: int) -> "CaptureChannel":
        """Return it with each `every`-th reading; whether they clipped is left open where none that is left is at an end."""
        left = self.values[::every]
        reached = np.min(left) == np.min(self.values) and np.max(left) == np.max(self.values)
        return replace(self, values=left, clipped=self.clipped if reached else None)


@dataclass(frozen=True)
class Capture:
    """Channels on a common time axis (s, shape (n,)); `time` is None for a table without one, as angle and inductance.

    `source` names the file(s), `description` format and instrument, `assumptions` what the file left open.
    `first_line` is the file's line of the first sample, 0 where it has no lines; `time_unit_open` tells that nobody said the time's unit,
    which is taken to be s.
    """

    channels: tuple[CaptureChannel, ...]
    time: FloatArray | None
    source: str
    description: str
    assumptions: tuple[Text, ...] = ()
    first_line: int = 0
    time_unit_open: bool = False

    def line_of(self, sample: int) -> int | None:
        """Return the file's line of a sample, None where it has none."""
        return self.first_line + sample if self.first_line else None

    def channel(self, name: str) -> CaptureChannel:
        """Return a channel by name; "CHAN3", "CH3" and "C3" are one. Raises CaptureError for an unknown name."""
        for channel in self.channels:
            if same_name(channel.name, name):
                return channel
        raise CaptureError(
            self.source,
            text("no channel '{name}'; there are {names}", name=name, names=[c.name for c in self.channels]),
        )

    def scaled(self, factors: Mapping[str, float | ProbeFactor]) -> "Capture":
        """Return the capture with channels multiplied by factors, by name.

        Raises CaptureError for an unknown name, and for a current's factor of a channel that is not in volts.
        """
        given = [(self.channel(name), factor) for name, factor in factors.items()]
        for channel, factor in given:
            if isinstance(factor, ProbeFactor) and factor.unit and channel.unit not in ("V", ""):
                raise CaptureError(
                    self.source,
                    text(
                        "--scale of channel '{name}' converts volts to amperes, but the file states its unit as "
                        "{unit}; give the factor without a unit",
                        name=channel.name,
                        unit=channel.unit,
                    ),
                )
        units = {c.name: f.unit for c, f in given if isinstance(f, ProbeFactor) and f.unit}
        wanted = {c.name: f.factor if isinstance(f, ProbeFactor) else f for c, f in given}
        for name, factor in wanted.items():
            if not 1e-12 <= abs(factor) <= 1e12:
                raise CaptureError(
                    self.source,
                    text(
                        "scale of channel '{name}' is {factor:g}; it must be a number other than 0, from 1e-12 to 1e12 in size",
                        name=name,
                        factor=factor,
                    ),
                )
        changed = tuple(
            replace(
                c,
                unit=units.get(c.name, c.unit),
                values=c.values * wanted[c.name],
                resolution=c.resolution * abs(wanted[c.name]),
                full_scale=c.full_scale * abs(wanted[c.name]),
            )
            if c.name in wanted
            else c
            for c in self.channels
        )
        notes = tuple(
            text("channel {name} in volts multiplied by {factor:g} A/V: it is a current", name=name, factor=factor)
            if name in units
            else text("channel {name} multiplied by {factor:g}", name=name, factor=factor)
            for name, factor in wanted.items()
        )
        return replace(self, channels=changed, assumptions=self.assumptions + notes)

    def times(self) -> FloatArray:
        """Return the time axis (s). Raises CaptureError where the capture has none."""
        if self.time is None:
            raise CaptureError(
                self.source,
                text(
                    "there is no time column; name the first column 'time (s)', or say which one it is with --time-column"
                ),
                self.line_of(-1),
            )
        return self.time

    def evenly_sampled(self) -> "Capture":
        """Return the capture with the rounding of its time column removed. Raises CaptureError at a gap."""
        time = self.times()
        steps = np.diff(time)
        if not steps.size:
            raise CaptureError(self.source, text("holds one sample only; export the whole record"), self.line_of(0))
        typical = float(np.median(steps))
        gaps = np.flatnonzero(steps > 1.9 * typical)
        if gaps.size:
            raise CaptureError(
                self.source,
                text(
                    "gap in time: {step:g} s to the sample before, elsewhere {typical:g} s; export the record whole",
                    step=steps[gaps[0]],
                    typical=typical,
                ),
                self.line_of(int(gaps[0]) + 1),
            )
        # By all times: those of the ends alone are off by up to their last digit.
        places = np.arange(time.size) - 0.5 * (time.size - 1)
        rate = float(places @ (time - time[0])) / float(places @ places)
        even = np.mean(time) + rate * places
        off = np.abs(time - even)
        if np.max(off) > 0.75 * typical:
            raise CaptureError(
                self.source,
                text(
                    "samples are not evenly spaced: {off:g} s off; export with a fixed sampling rate", off=np.max(off)
                ),
                self.line_of(int(np.argmax(off))),
            )
        return replace(self, time=even)

    def thinned(self) -> "Capture":
        """Return the capture with every n-th sample where it has many more than a fit needs: each would cost it time and memory.

        A sample is left as it is, on the converter's steps; means would not be.
        """
        every = (self.time.size if self.time is not None else 0) // _ENOUGH
        if self.time is None or every < 2:
            return self
        note = text(
            "the record has {count} samples; one of every {every} is evaluated", count=self.time.size, every=every
        )
        return replace(
            self,
            channels=tuple(channel.thinned(every) for channel in self.channels),
            time=self.time[::every],
            assumptions=(*self.assumptions, note),
            first_line=0,
        )


def same_name(one: str, other: str) -> bool:
    """Tell whether two spellings name one channel, as "CHAN3" and "CH3"."""
    return _key(one) == _key(other)


def _key(name: str) -> str:
    """Return what two spellings of a channel's name have in common."""
    numbered = re.fullmatch(r"(?:c|ch|chan|channel)\s*(\d+)", name.strip().lower())
    return f"c{numbered[1]}" if numbered else name.strip().lower()
