"""The messages between a line's coordinator and its workers."""

from collections.abc import Mapping
from dataclasses import dataclass

from bench.eol.limits import ParameterLimits
from bench.eol.line.preparation.prepare import BatchRequest
from bench.eol.line.workers.instrument_sharing import LeaseRelease, LeaseReply, LeaseRequest
from bench.eol.plan import Plan, PlannedCheck
from bench.eol.record import MotorRecord
from bench.motor.motor_file import MotorFile
from drivers.interfaces.text import Text


@dataclass(frozen=True)
class Batch:
    """The common part of every motor of a batch; `uid` makes the records' identifiers, `folder` holds the runs."""

    name: str
    uid: str
    plan: Plan
    limits: Mapping[str, ParameterLimits]
    motor: MotorFile
    line: str
    folder: str
    request: BatchRequest


@dataclass(frozen=True)
class WorkerSetup:
    """The first message to a worker: the batch, and its socket, one of so many `sockets`.

    `content` is the text of the socket's station from the file `source`, empty on a virtual bench; `shared` are the roles
    that sockets use in turn. `twin_of` is the text of the station whose twin a virtual bench is.
    `owner_name` is the name of the batch's claims; a line of virtual benches has none.
    """

    batch: Batch
    number: int
    name: str
    sockets: int
    source: str
    content: str
    shared: tuple[str, ...]
    owner_name: str = ""
    twin_of: str = ""


@dataclass(frozen=True)
class Task:
    """A motor to be measured: its number in the batch, its serial number, its checks, and when its socket takes it up (s).

    It is the serial number's test of this number, again by a person where one is named. A golden motor has limits of its own.
    """

    number: int
    serial_number: str
    checks: tuple[PlannedCheck, ...]
    at: float
    test_number: int = 1
    again_by: str = ""
    golden_limits: Mapping[str, ParameterLimits] | None = None


@dataclass(frozen=True)
class Stop:
    """The run under way is to shut down, for this reason."""

    by: str


@dataclass(frozen=True)
class NoMoreMotors:
    """There are no more motors."""


@dataclass(frozen=True)
class Ready:
    """A worker is ready for a motor."""


@dataclass(frozen=True)
class TimeReached:
    """A worker's bench has passed the time (s) that others wait for."""

    time: float


@dataclass(frozen=True)
class MotorDone:
    """A motor's run has ended at this time (s); its record is not kept yet. `remedy` is what to do where its run could not be written.

    `left_on` is what could not be switched off, or verified to be.
    """

    record: MotorRecord
    time: float
    remedy: Text | None = None
    left_on: tuple[str, ...] = ()


@dataclass(frozen=True)
class WorkerFailed:
    """A worker cannot work at all: what is wrong with its station."""

    reason: Text


ToWorker = WorkerSetup | Task | LeaseReply | Stop | NoMoreMotors
FromWorker = Ready | LeaseRequest | LeaseRelease | TimeReached | MotorDone | WorkerFailed
