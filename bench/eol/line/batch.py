"""A batch from the command line's wishes to its counts."""

import re
from collections import Counter
from collections.abc import Callable, Iterable, Iterator, Sequence
from contextlib import closing, contextmanager
from dataclasses import dataclass, field
from functools import partial
from pathlib import Path
from typing import IO

from bench.eol.limits import Limits
from bench.eol.line.admission import Admission, Refused
from bench.eol.line.batch_log import Begun, Ledger
from bench.eol.line.coordinator import Coordinator, Hears
from bench.eol.line.line_file import Line, digest, load_line
from bench.eol.line.messages import Batch
from bench.eol.line.order import by_time_over_failures
from bench.eol.line.panel_channel import Desk
from bench.eol.line.preparation import check_parameters, check_station, operator_of, planned_of
from bench.eol.line.process import Nursery
from bench.eol.line.record_writer import Keeper, open_keeper
from bench.eol.line.serials import FromFile, FromStream, Given, MadeUp, Serials
from bench.eol.plan import Check, Plan, load_plan
from bench.eol.record import MotorRecord
from bench.eol.store.faults import StoreError
from bench.eol.store.records import Passage
from bench.eol.store.waiting import Waiting
from bench.i18n.errors import UsageError, said_by
from bench.motor.motor_file import MotorFile, load_motor
from bench.safety.ownership.owner import Owner
from bench.safety.ownership.stations import owning_stations
from drivers.interfaces.text import Text, text
from procedures.catalogue import catalogue

#: Serial numbers that come from a panel, as `--serials` says it.
PANEL = "panel"
Stops = Callable[[str], None]
_BATCH_NAME = re.compile(r"[\w][\w.-]{0,99}")


@dataclass(frozen=True)
class BatchWishes:
    """What the command line asks for. `motors` is the batch's size on virtual benches without serial numbers.

    With `accounting`, each run's folder on a virtual bench gets its procedures' times and what of them was needless.
    """

    plan: Path
    station: str
    runs: Path
    sockets: int | None = None
    batch: str = ""
    serials: str = ""
    motors: int | None = None
    records: str = "records.sqlite"
    person: str = ""
    operator: str = ""
    language: str = "en"
    seed: int = 0
    again: bool = False
    accounting: bool = False


@dataclass
class Counts:
    """What became of a batch's motors, by verdict; those that passed at once; serial numbers refused; what still `waits` at the end."""

    verdicts: Counter[str] = field(default_factory=Counter)
    first_pass: int = 0
    refused: int = 0
    waits: Waiting = field(default_factory=Waiting)
    bench_time: float = 0.0

    @property
    def motors(self) -> int:
        """The motors with a record."""
        return sum(self.verdicts.values())


@dataclass(frozen=True)
class Prepared:
    """A plan with its motor and line, read and held against one another."""

    plan: Plan
    motor: MotorFile
    line: Line
    limits: dict[str, Limits]


def prepare(plan_file: Path, station: str, sockets: int | None) -> Prepared:
    """Read plan, motor and station and hold them against one another. Raises InputError for whatever does not go together."""
    procedures = catalogue()
    plan = load_plan(plan_file, list(procedures))
    motor = load_motor(plan.motor)
    line = load_line(station, sockets)
    planned = planned_of(plan.checks, plan.source)
    check_parameters(plan, planned)
    check_station(line, planned)
    if line.is_virtual:
        motor.virtual_motor()
    return Prepared(plan, motor, line, plan.limits(motor.nameplate.expected))


def run_batch(wishes: BatchWishes, ears: Hears, stream: IO[str], nursery: Nursery | None = None) -> tuple[Counts, str]:
    """Measure a batch; return what became of it and why it was stopped, empty where it came to its end.

    `stream` is where serial numbers are typed or scanned, `nursery` where workers come from, one of its own unless given.
    Raises InputError before anything is touched, or where no socket can work; StoreError where records can no longer be kept.
    """
    return measure(prepare(wishes.plan, wishes.station, wishes.sockets), wishes, ears, stream, nursery)


def measure(
    prepared: Prepared, wishes: BatchWishes, ears: Hears, stream: IO[str], nursery: Nursery | None = None
) -> tuple[Counts, str]:
    """Measure a batch by what was read and held against one another already; otherwise as `run_batch`."""
    plan, line = prepared.plan, prepared.line
    name = wishes.batch or plan.name
    if _BATCH_NAME.fullmatch(name) is None:
        raise UsageError(
            text("--batch {name!r}: allowed are up to 100 letters, digits, dots, hyphens and underscores", name=name)
        )
    _check_operator(wishes, line)
    stations = [socket.station for socket in line.sockets if socket.station is not None]
    with owning_stations(stations, f"motorbench eol run, batch {name}") as owner:
        return _measured(prepared, wishes, name, ears, stream, nursery, owner)


def _measured(
    prepared: Prepared,
    wishes: BatchWishes,
    name: str,
    ears: Hears,
    stream: IO[str],
    nursery: Nursery | None,
    owner: Owner | None,
) -> tuple[Counts, str]:
    plan, line = prepared.plan, prepared.line
    folder = wishes.runs / name
    if owner is not None:
        owner.work_in(folder)
    keeper = open_keeper(wishes.records, wishes.runs)
    counts = Counts()
    try:
        about = {
            "name": name,
            "plan": plan.sha256,
            "motor": prepared.motor.sha256,
            "line": digest(line),
            "seed": wishes.seed,
        }
        with (
            closing(Ledger(folder, about)) as ledger,
            closing(_serials(wishes, plan, line, ledger.last, stream)) as serials,
        ):
            batch = Batch(
                name=name,
                uid=ledger.uid,
                plan=plan,
                limits=prepared.limits,
                motor=prepared.motor,
                line=line.name,
                person=wishes.person,
                seed=wishes.seed,
                folder=str(folder),
                language=wishes.language,
                operator=wishes.operator,
                accounting=wishes.accounting,
            )
            cut_off = _cut_off(ledger, keeper, name) if ledger.resumed else ()
            checks = _ordered(plan, keeper)
            with _heard(serials, batch, line, ears) as (hearing, opened), _nursery(nursery) as workers:
                counting = _Counting(counts, hearing)
                keeper.listen(counting.waits)
                admission = Admission(
                    serials,
                    cut_off,
                    plan.check_serial,
                    partial(_earlier, keeper, counting),
                    batch=name,
                    known=ledger.last,
                    again=wishes.again,
                )
                coordinator = Coordinator(line, batch, checks, admission, keeper, ledger, counting, workers, owner)
                opened(coordinator.stop)
                stopped = coordinator.run()
    finally:
        keeper.close()
        counts.waits = keeper.left
    return counts, stopped


@contextmanager
def _nursery(given: Nursery | None) -> Iterator[Nursery]:
    if given is not None:
        yield given
        return
    with closing(Nursery()) as own:
        yield own


@contextmanager
def _heard(serials: Serials, batch: Batch, line: Line, ears: Hears) -> Iterator[tuple[Hears, Callable[[Stops], None]]]:
    """Give who hears the line, and what to hand its brake to: with `--serials panel` a desk that panels reach."""
    if not isinstance(serials, Given) or isinstance(serials, FromStream):
        yield ears, lambda _: None
        return
    with closing(Desk(batch.name, batch.plan.name, [s.name for s in line.sockets], serials, ears)) as desk:
        yield desk, lambda stop: desk.open(Path(batch.folder), stop)


def _check_operator(wishes: BatchWishes, line: Line) -> None:
    if wishes.operator not in ("", "fixture", "virtual", "terminal"):
        raise UsageError(
            text("--operator {operator}: allowed are fixture, virtual, terminal", operator=wishes.operator)
        )
    if line.is_virtual:
        if wishes.operator == "terminal":
            raise UsageError(
                text("--operator terminal: on the virtual bench only a fixture or virtual hands can do anything")
            )
        return
    by_hand = any(
        operator_of(wishes.operator, socket.station) in ("", "terminal")
        and not (socket.station and socket.station.control)
        for socket in line.sockets
    )
    if by_hand and (len(line.sockets) > 1 or wishes.serials in ("", "-")):
        raise UsageError(
            text(
                "a person at the terminal serves one socket, and the keyboard answers the questions: give --serials FILE, "
                "or each socket a fixture ([sockets.NAME.instruments.switch_matrix], rotor_actuator)"
            )
        )


def _serials(wishes: BatchWishes, plan: Plan, line: Line, last: int, stream: IO[str]) -> Serials:
    if wishes.motors is not None and wishes.serials:
        raise UsageError(text("--motors N makes serial numbers up; --serials gives them: take one of both"))
    if wishes.motors is not None:
        if not line.is_virtual:
            raise UsageError(
                text("--motors N is for virtual benches; a real motor's serial number comes by --serials FILE or -")
            )
        if not 1 <= wishes.motors <= 10_000_000:
            raise UsageError(text("--motors {motors}: allowed are 1 to 10000000", motors=wishes.motors))
        plan.check_serial(plan.spread.serial.format(number=1))
        return MadeUp(plan.spread.serial, last + 1, wishes.motors)
    if not wishes.serials or wishes.serials == "-":
        return FromStream(stream)
    if wishes.serials == PANEL:
        return Given()
    return FromFile(Path(wishes.serials))


def _ordered(plan: Plan, keeper: Keeper) -> Sequence[Check]:
    if plan.order == "listed":
        return plan.checks
    return by_time_over_failures(plan.checks, keeper.experience(plan.name))


def _earlier(keeper: Keeper, ears: Hears, serial_number: str) -> Passage | None:
    """Return the last passage of a serial number; a line whose records cannot be read goes on, and says so."""
    try:
        return keeper.earlier(serial_number)
    except StoreError as error:
        ears.trouble(
            text(
                "whether serial number {serial} was measured before cannot be looked up, so it is measured: {error}",
                serial=serial_number,
                error=said_by(error),
            )
        )
        return None


def _cut_off(ledger: Ledger, keeper: Keeper, batch: str) -> list[Begun]:
    """Return the motors that were begun and have no record, each once."""
    kept = bytearray(ledger.last + 1)
    for number in keeper.numbers(batch):
        if number <= ledger.last:
            kept[number] = 1
    return list(_unkept(ledger.begun(), kept))


def _unkept(begun: Iterable[Begun], kept: bytearray) -> Iterator[Begun]:
    for motor in begun:
        if not kept[motor.number]:
            kept[motor.number] = 1
            yield motor


class _Counting:
    """Counts, and passes on."""

    def __init__(self, counts: Counts, ears: Hears) -> None:
        self._counts, self._ears = counts, ears

    def begun(self, motor: Begun, socket: str) -> None:
        self._ears.begun(motor, socket)

    def done(self, record: MotorRecord) -> None:
        self._counts.verdicts[record.verdict.value] += 1
        self._counts.first_pass += record.first_pass
        self._counts.bench_time += record.bench_time
        self._ears.done(record)

    def refused(self, refused: Refused) -> None:
        self._counts.refused += 1
        self._ears.refused(refused)

    def trouble(self, words: Text) -> None:
        self._ears.trouble(words)

    def waits(self, waiting: Waiting) -> None:
        self._ears.waits(waiting)
