"""What a line's coordinator and its workers say to each other."""

from collections.abc import Mapping
from dataclasses import dataclass

from bench.eol.limits import Limits
from bench.eol.line.arbiter import Answer
from bench.eol.plan import Check, Plan
from bench.eol.record import MotorRecord
from bench.motor.motor_file import MotorFile
from drivers.interfaces.text import Text


@dataclass(frozen=True)
class Batch:
    """What is the same for every motor of a batch; `uid` makes the records' identifiers, `folder` holds the runs."""

    name: str
    uid: str
    plan: Plan
    limits: Mapping[str, Limits]
    motor: MotorFile
    line: str
    person: str
    seed: int
    folder: str
    language: str
    operator: str
    accounting: bool = False


@dataclass(frozen=True)
class Place:
    """Where one socket's worker works: `content` is its station's text, empty on a virtual bench.

    `lifeline` is the file descriptor that is open for as long as the worker or its guardian lives, `times` that of the sockets'
    times, and `owner` that of the batch's claims, whose name is `owner_name`; the worker, which gets them, fills them in.
    A line of virtual benches has no claims.
    """

    socket: int
    name: str
    sockets: int
    source: str
    content: str
    shared: tuple[str, ...]
    timeout: float
    lifeline: int
    times: int
    owner_name: str = ""
    owner: int = -1


@dataclass(frozen=True)
class Setup:
    """The first message to a worker."""

    batch: Batch
    place: Place


@dataclass(frozen=True)
class Task:
    """A motor to be measured: its number in the batch, its serial number, its checks, and when its socket takes it up (s)."""

    number: int
    serial_number: str
    checks: tuple[Check, ...]
    at: float


@dataclass(frozen=True)
class Told:
    """The answer to a ticket."""

    ticket: int
    answer: Answer


@dataclass(frozen=True)
class Stop:
    """What is under way is to take its way down, for this reason."""

    by: str


@dataclass(frozen=True)
class Leave:
    """There are no more motors."""


@dataclass(frozen=True)
class Ready:
    """A worker is ready for a motor."""


@dataclass(frozen=True)
class Want:
    """A worker's run waits for shared instruments; `time` is its bench's (s). The answer names the ticket."""

    ticket: int
    time: float
    wanted: tuple[str, ...]
    purpose: str


@dataclass(frozen=True)
class GaveBack:
    """A worker's run has given back what it had."""

    time: float


@dataclass(frozen=True)
class Passed:
    """A worker's bench has passed the time that others wait for."""

    time: float


@dataclass(frozen=True)
class Done:
    """A motor's run has ended; its record is not kept yet. `floor` is the least bench time (s) that it could have taken."""

    record: MotorRecord
    time: float


@dataclass(frozen=True)
class Broken:
    """A worker cannot work at all: what is wrong with its station."""

    words: Text


ToWorker = Setup | Task | Told | Stop | Leave
FromWorker = Ready | Want | GaveBack | Passed | Done | Broken
