"""Request of a run, options of carrying it out, and its outcome."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from pathlib import Path
from typing import TYPE_CHECKING, Any

from bench.journal.disk import Reserve
from bench.journal.errors import RecordError
from bench.journal.journal import Listener
from bench.journal.recording import KeepsWaveforms
from bench.journal.run_folder import RunFolder
from bench.journal.run_view import RunView
from bench.journal.waveforms import EveryWaveform
from bench.motor.motor_file import MotorFile
from bench.run.retry_policy import After, stop_at_failure
from drivers.interfaces import Clock
from procedures.core.result import Notice

if TYPE_CHECKING:
    from bench.virtual.fault_file import GivenFault


@dataclass(frozen=True)
class RunRequest:
    """Request of the command line; `language` is settled already. Without `guardian`, none is started: for tests.

    `station` is a file or `virtual`, `operator` one of OPERATORS or empty for the usual one; `faults` are injected on a
    virtual bench, and `disturbances` is a file of what disturbs it.
    `probe_verification` is an earlier run whose verification of the probes holds for this one;
    `probes` are limits of probes that the station file leaves open. `record` is the file that the instruments' traffic goes to.
    """

    procedures: Sequence[str]
    motor: MotorFile
    station: str
    language: str
    runs: Path
    operator: str = ""
    person: str = ""
    answers: Path | None = None
    assignments: Sequence[str] = field(default_factory=tuple)
    seed: int = 0
    trace: bool = False
    faults: "Sequence[GivenFault]" = ()
    disturbances: Path | None = None
    probe_verification: str = ""
    probes: Sequence[str] = ()
    go_on: bool = False
    resume: RunFolder | None = None
    repeat: Sequence[str] = ()
    guardian: bool = True
    record: Path | None = None


@dataclass(frozen=True)
class UnitReference:
    """A motor of a batch: the batch's name, the motor's number in it, and the socket it is measured at."""

    batch: str
    number: int
    socket: str


@dataclass(frozen=True)
class RunOptions:
    """Options of carrying out a run; the defaults are those of a single run, a line has others.

    `folder` is made already; `versions` are known already; `waveforms` says which are kept; `lifelines` are
    file descriptors that a guardian keeps open for as long as it lives; `procedure_clock` is what procedures wait by, the bench's
    clock where it is None. Without `durable`, only the run's end is forced to the disk, and in a folder made already no room is
    kept for it; `reserve` is room that stands already. Without `write_result` there is no `result.json`.
    """

    after: After = stop_at_failure
    warnings: Sequence[Notice] = ()
    listeners: Sequence[Listener] = ()
    folder: RunFolder | None = None
    versions: Mapping[str, str] = field(default_factory=dict)
    waveforms: KeepsWaveforms = field(default_factory=EveryWaveform)
    lifelines: Sequence[int] = ()
    procedure_clock: Clock | None = None
    durable: bool = True
    reserve: Reserve | None = None
    unit: UnitReference | None = None
    write_result: bool = True


@dataclass(frozen=True)
class Finished:
    """A run that has ended: its folder, what it came to, and that as JSON.

    `journal_sha256` is the hash of the journal's last event. `left` is the actual state of a virtual bench after the
    shutdown, empty for a real one; `unfelt` says where its faults were given that never began or struck no message.
    `unwritten` is what could not be recorded, `left_on` what could not be switched off.
    """

    folder: RunFolder
    view: RunView
    result: dict[str, Any]
    journal_sha256: str = ""
    left: Mapping[str, Any] = field(default_factory=dict)
    unfelt: tuple[str, ...] = ()
    unwritten: RecordError | None = None
    left_on: tuple[str, ...] = ()
