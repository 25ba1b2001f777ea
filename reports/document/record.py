"""The input of a report: one run, as the keeper of its record hands it over."""

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field
from typing import Any, Protocol

import numpy as np
from numpy.typing import NDArray

from drivers.interfaces.text import Text, Translate
from procedures.core.nameplate import Nameplate
from procedures.core.parameter_set import ParameterSet
from procedures.core.result import Notice, ProcedureResult

FloatArray = NDArray[np.float64]


class Trace(Protocol):
    """A stored waveform: time (s) and values (n,), unit, channel (0 if unknown)."""

    @property
    def time(self) -> FloatArray:
        """Time of each sample (s)."""

    @property
    def values(self) -> FloatArray:
        """Samples."""

    @property
    def unit(self) -> str:
        """Unit of the samples."""

    @property
    def channel(self) -> int:
        """Channel of the oscilloscope."""


#: Reads the traces of one record, by channel; what cannot be read is left out.
ReadTraces = Callable[[], Sequence[Trace]]


@dataclass(frozen=True)
class CalibrationRecord:
    """An instrument's calibration entry: dates as ISO 8601, and whether it was overdue on the day of the run."""

    date: str
    due: str
    certificate: str
    overdue: bool


@dataclass(frozen=True)
class InstrumentRecord:
    """One instrument of the station by its role; `identity` is what it said of itself, empty where it was not asked."""

    role: str
    driver: str
    address: str
    identity: str
    calibration: CalibrationRecord | None
    used: bool


@dataclass(frozen=True)
class ReadingsRecord:
    """Values of one quantity from one instrument in one step, in the order they came; `was_set` for what it was told."""

    instrument: str
    quantity: Text
    unit: str
    values: Sequence[float]
    was_set: bool = False


@dataclass(frozen=True)
class ProcedureStepRecord:
    """One passage through a step: bench times (s), what came of it, and what was set and read meanwhile.

    `status` is finished, failed or started. `traces` read the records taken in it, in order.
    """

    identifier: str
    words: Text
    by_hand: bool
    status: str
    started: float
    ended: float | None
    error: str = ""
    readings: Sequence[ReadingsRecord] = ()
    traces: Sequence[ReadTraces] = ()


@dataclass(frozen=True)
class ConnectionRecord:
    """A connection with which something was measured: the steps that did, and what draws it in a language, as SVG.

    `alike` counts further ones that differ in which terminals they are made to.
    """

    steps: Sequence[str]
    draw: Callable[[Translate], str]
    alike: int = 0


@dataclass(frozen=True)
class ProcedureRecord:
    """One procedure as it ran; `settings` are those it ran with, `described` what they are, `cause` why it failed."""

    name: str
    title: Text
    section: str
    settings: Mapping[str, Any]
    steps: Sequence[ProcedureStepRecord]
    result: ProcedureResult | None
    cause: Text | str = ""
    connections: Sequence[ConnectionRecord] = ()
    described: Mapping[str, Text] = field(default_factory=dict)


@dataclass(frozen=True)
class JournalEnd:
    """The end of the record: number of events and SHA-256 of the last; `torn` if a line after it was cut off."""

    events: int
    sha256: str
    torn: bool


@dataclass(frozen=True)
class SignOff:
    """A signature that was given: who, as what, when, a remark, what it means; `holds` where the journal is still that one."""

    person: str
    role: str
    time: str
    words: str
    holds: bool
    meaning: Text


@dataclass(frozen=True)
class RunRecord:
    """One run, whole or cut off.

    `warnings` stand with the procedure each came from, or with none where they concern several. `truth` is that of a
    virtual motor. `status` is completed, failed, aborted or interrupted. Times are ISO 8601, UTC. `photos` are what they show,
    and what draws them.
    """

    name: str
    status: str
    cause: Text | str
    started: str
    ended: str
    nameplate: Nameplate
    motor_file: str
    motor_sha256: str
    station: str
    station_file: str
    station_sha256: str
    operator: str
    performed_by: str
    software: Mapping[str, str]
    instruments: Sequence[InstrumentRecord]
    parameters: ParameterSet
    warnings: Sequence[tuple[str, Notice]]
    truth: Mapping[str, float]
    procedures: Sequence[ProcedureRecord]
    journal: JournalEnd
    bench_time: float = 0.0
    photos: Sequence[tuple[Text, Callable[[Translate], str]]] = ()
    signed: Sequence[SignOff] = ()
