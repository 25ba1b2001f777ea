"""Events of a run as a whole: its sessions, its procedures, and its record."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from typing import Annotated, Any

from pydantic import BeforeValidator

from bench.journal.events.safety import UNTOLD, GuardianEnd, GuardianStart, InterlocksStart
from bench.journal.stored_result import Sentence, restore, restore_notice, restore_sentence
from procedures.core.events import Event, optional
from procedures.core.result import Notice, ProcedureResult

#: Version of the journal's schema: it counts up when what stands for an existing kind changes.
SCHEMA = 2
#: From this version on a result says what was withheld.
TELLS_WITHHELD = 2

StoredNotice = Annotated[Notice, BeforeValidator(restore_notice)]
StoredSentence = Annotated[Sentence, BeforeValidator(restore_sentence)]
StoredResult = Annotated[ProcedureResult, BeforeValidator(restore)]


@dataclass(frozen=True)
class MotorReference:
    """The motor file of a run, and what its nameplate calls the motor."""

    name: str
    serial_number: str = ""
    source: str = ""
    sha256: str = ""


@dataclass(frozen=True)
class CalibrationReference:
    """A calibration: its date and when the next is due (ISO 8601), and its certificate."""

    date: str
    due: str
    certificate: str


@dataclass(frozen=True)
class InstrumentEntry:
    """An instrument as the station file names it."""

    driver: str
    address: str
    calibration: CalibrationReference | None


@dataclass(frozen=True)
class StationReference:
    """The station file of a run and its instruments by role."""

    name: str = ""
    source: str = ""
    sha256: str = ""
    instruments: Mapping[str, InstrumentEntry] = field(default_factory=dict)


class RunBegun(Event):
    """A session of a run begins: with what, by whom, and what is measured.

    `settings` are as given on the command line, `truth` a virtual motor's true values, `batch`, `number` and `socket` a line's,
    `torn_bytes` what was cut off from a journal that is gone on with. `motor_file`,
    `station_file` and `disturbances` are the files' content.
    """

    schema: int = optional(0)
    run: str
    motor: MotorReference
    station: StationReference
    operator: str = ""
    person: str = ""
    procedures: Sequence[str]
    settings: Sequence[str]
    seed: int = 0
    faults: Sequence[Mapping[str, Any]] = ()
    disturbances: str = optional("")
    probe_verification: str = optional("")
    probes: Sequence[str] = optional(())
    language: str = "en"
    software: Mapping[str, str] = field(default_factory=dict)
    truth: Mapping[str, float] = field(default_factory=dict)
    motor_file: str = ""
    station_file: str = ""
    batch: str | None = optional()
    number: int | None = optional()
    socket: str | None = optional()
    torn_bytes: int | None = optional()
    interlocks: InterlocksStart = field(default_factory=InterlocksStart)
    guardian: GuardianStart | None = field(default=UNTOLD, metadata={"optional": True})
    watchdogs: Sequence[Mapping[str, Any]] | None = optional()


class RunStarted(RunBegun, kind="run_started", durable=True):
    """A run begins."""


class RunResumed(RunBegun, kind="run_resumed", durable=True):
    """A run goes on at its first procedure that is not finished."""


class RehearsalStarted(Event, kind="rehearsal_started"):
    """A rehearsal begins; its folder, files, procedures and settings."""

    schema: int = optional(0)
    rehearsal: str
    motor: str
    station: str
    procedures: Sequence[str]
    settings: Sequence[str]
    seed: int
    software: Mapping[str, str]


class RunFinished(Event, kind="run_finished", durable=True, closing=True):
    """A session of a run has ended: completed, failed or aborted, why, and how long it took (s of bench, of wall time and of hand work).

    `cause` is in the run's language; `told` is the same for readers of any.
    """

    status: str
    cause: str = ""
    told: StoredSentence | None = optional()
    bench_time: float
    wall_time: float
    guardian: GuardianEnd | None = None
    hand_time: float = optional(default=0.0)


class ProcedureStarted(Event, kind="procedure_started"):
    """A procedure begins: its settings, the values in its sentences, and its steps' sentences in the run's language."""

    procedure: str
    section: str = ""
    settings: Mapping[str, Any] = field(default_factory=dict)
    values: Mapping[str, bool | int | float | str] | None = optional()
    steps: Mapping[str, str]


class ProcedureFinished(Event, kind="procedure_finished", durable=True):
    """A procedure has come to its end."""

    result: StoredResult


class PartialResultMade(Event, kind="partial_result", durable=True):
    """Results from the data that a procedure had taken before an error or an abort."""

    result: StoredResult


class ProcedureFailed(Event, kind="procedure_failed", durable=True, closing=True):
    """A procedure ended by an error: why, in the run's language and (`told`) for any language; `trace` is the program's."""

    procedure: str
    cause: str
    told: StoredSentence | None = optional()
    trace: Sequence[str] = ()


class KnownBefore(Event, kind="known_before"):
    """A warning before anything is energised, of one procedure or (empty) of the run; its sentence as it was shown."""

    procedure: str
    warning: StoredNotice
    message: str


class CapabilityNotChecked(Event, kind="not_foreseen"):
    """The capability of the instruments could not be checked for a procedure, and why."""

    procedure: str
    cause: str


class ConsistencyChecked(Event, kind="consistency_checked"):
    """Conclusion from the figures of all procedures together."""

    warnings: Sequence[StoredNotice]


class LeaseBegun(Event, kind="lease"):
    """Shared instruments are reserved for this run, after a wait (s of bench time)."""

    instruments: Sequence[str]
    waited: float


class LeaseEnded(Event, kind="lease_ended"):
    """They are given back; what went wrong as they were closed."""

    faults: Sequence[str]


class FaultBegan(Event, kind="fault_began"):
    """An injected fault of a virtual bench begins."""

    fault: Mapping[str, Any]


class FaultMended(Event, kind="fault_mended"):
    """An injected fault of a virtual bench is over."""

    fault: Mapping[str, Any]


class ClockSetBack(Event, kind="clock_set_back"):
    """The computer's clock was set back (s)."""

    seconds: float


class RecordFailed(Event, kind="record_failed", durable=True, closing=True):
    """An event of the kind `lost` could not be written."""

    lost: str
    error: str
