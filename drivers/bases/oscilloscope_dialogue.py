"""Dialogue with an oscilloscope: what each make defines, and the parts of its commands."""

from abc import ABC, abstractmethod
from collections.abc import Iterable, Mapping
from enum import Enum
from typing import ClassVar

import numpy as np

from drivers.bases.found_state import WantedSetting
from drivers.bases.oscilloscope_data import OscilloscopeData, Probe
from drivers.bases.scpi_driver import ScpiDriver
from drivers.bases.waveform import Codes, Preamble, parse_preamble
from drivers.interfaces import AcquisitionType, ChannelSettings, CommunicationError, ProbeKind, Slope, Trigger
from drivers.interfaces.text import text
from drivers.recognition import ScpiIdentity
from drivers.transport.visa.replies import is_overrange

_UNIT = {ProbeKind.VOLTAGE: "VOLT", ProbeKind.CURRENT: "AMP"}


class Acquiring(Enum):
    """Progress of one record: the part before the trigger is filled, then it is triggered, then it is complete."""

    FILLING = "filling"
    ARMED = "armed"
    DONE = "done"


_EDGES = text("the trigger signal is filtered, so the edge is distorted")


def channel_rows(channel: int, unlimited: str) -> tuple[WantedSetting, ...]:
    """Return the required settings of a channel with a probe; `unlimited` is the answer for a bandwidth limit that is off."""
    head = f":CHAN{channel}"
    return (
        WantedSetting(f"{head}:INV?", ("0",), text("the trace is inverted"), f"{head}:INV {{value}}"),
        WantedSetting(f"{head}:BWL?", (unlimited,), text("edges are rounded off"), f"{head}:BWL {{value}}"),
    )


def hidden_row(channel: int) -> WantedSetting:
    """Return that a channel without a probe is not shown."""
    why = text("another channel takes half of the memory")
    return WantedSetting(f":CHAN{channel}:DISP?", ("0",), why, f":CHAN{channel}:DISP {{value}}")


def trigger_row(header: str, wanted: str) -> WantedSetting:
    """Return that the filters in the trigger path must be set as required."""
    return WantedSetting(f"{header}?", (wanted,), _EDGES, f"{header} {{value}}")


class OscilloscopeDialogue(ScpiDriver, ABC):
    """A make's oscilloscope by its data (`data`, `answers`) and dialogue; a make implements the abstract methods.

    What is not abstract is as several makes have it: Keysight, and Rigol after it. `_offset_sign` is −1 where the offset that is set is
    added to the trace. `_single` arms for one record, `_force` then triggers one that is to start by itself where the automatic sweep
    does not, `_stop` ends an acquisition; `_transfer` is sent before records are fetched.
    """

    data: ClassVar[OscilloscopeData]
    answers: ClassVar[ScpiIdentity]
    _offset_sign: ClassVar[float] = 1.0
    _slopes: ClassVar[Mapping[Slope, str]] = {slope: slope.value for slope in Slope}
    _single: ClassVar[str] = ":SING"
    _force: ClassVar[str] = ""
    _stop: ClassVar[str] = ":STOP"
    _transfer: ClassVar[tuple[str, ...]] = ()

    def _wanted(self) -> Iterable[WantedSetting]:
        """Return what the last user may have left that would change a figure; called once the instrument is identified."""
        return ()

    def _channel_commands(self, channel: int, probe: Probe, settings: ChannelSettings) -> Iterable[str]:
        """Return what shows a channel, DC coupled, with its probe's unit and factor, range and value at mid-screen."""
        return (
            f":CHAN{channel}:DISP ON",
            f":CHAN{channel}:COUP DC",
            f":CHAN{channel}:UNIT {_UNIT[probe.kind]}",
            f":CHAN{channel}:PROB {probe.attenuation:.6g}",
            f":CHAN{channel}:RANG {settings.range:.6g}",
            f":CHAN{channel}:OFFS {self._offset_sign * settings.offset or 0.0:.6g}",
        )

    def _full_scale(self, channel: int) -> float:
        """Return the range of a channel (V or A at the tip, the whole screen) that the instrument has set."""
        return self._number(f":CHAN{channel}:RANG?")

    def _mid_screen(self, channel: int) -> float:
        """Return the value at mid-screen (V or A at the tip) that the instrument has set."""
        return self._offset_sign * self._number(f":CHAN{channel}:OFFS?")

    def _trigger_commands(self, trigger: Trigger) -> Iterable[str]:
        """Return what sets the edge trigger; without a channel the record starts by itself."""
        if trigger.channel is None:
            return (":TRIG:SWE AUTO",)
        return (
            ":TRIG:MODE EDGE",
            f":TRIG:EDGE:SOUR CHAN{trigger.channel}",
            f":TRIG:EDGE:LEV {trigger.level:.6g}",
            f":TRIG:EDGE:SLOP {self._slopes[trigger.slope]}",
            ":TRIG:SWE NORM",
        )

    @abstractmethod
    def _acquisition_commands(
        self, record_time: float, points: int, pre_trigger: float, acquisition: AcquisitionType
    ) -> Iterable[str]:
        """Return what sets a record: it begins `pre_trigger` of `record_time` (s) before the trigger."""

    @abstractmethod
    def _state(self) -> Acquiring:
        """Return how far the record is."""

    @abstractmethod
    def _record(self, channel: int, points: int) -> tuple[Codes, Preamble]:
        """Return the codes of a channel's record, which is complete and of `points` at least, and their scaling."""

    @abstractmethod
    def _measurement(self, what: str, channel: int) -> str:
        """Return the query of the instrument's own measurement FREQ or VPP of a channel."""

    def _send(self, commands: Iterable[str]) -> None:
        """Send settings, each of which the instrument takes before the next one goes out."""
        for command in commands:
            self._session.write(command)

    def _number(self, query: str) -> float:
        """Return the number that a query is answered with; raises CommunicationError where it stands for none."""
        value = self._session.query_number(query)
        if is_overrange(value):
            raise CommunicationError(self._name, text("no value (9.9E37)"), command=query)
        return value

    def _preamble(self, query: str, form: int, word: str) -> Preamble:
        """Return the scaling that a query is answered with in ten numbers; `form` is the number of the format `word`."""
        reply = self._session.query(query)
        try:
            return parse_preamble(reply, form, word)
        except ValueError as error:
            raise self._unusable(query, error) from error

    def _codes(self, query: str, kind: str, points: int) -> Codes:
        """Return the `points` codes in the block that a query is answered with, each of a `kind` as numpy has it (`<u2`), not copied."""
        block = self._session.query_block(query)
        try:
            codes: Codes = np.frombuffer(block, dtype=kind)
        except ValueError as error:
            raise self._unusable(query, error) from error
        if codes.size != points:
            words = text("{size} samples instead of {points} announced", size=codes.size, points=points)
            raise CommunicationError(self._name, words, command=query)
        return codes

    def _unusable(self, query: str, error: ValueError) -> CommunicationError:
        return CommunicationError(self._name, text("unusable record ({error})", error=error), command=query)
