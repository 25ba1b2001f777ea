"""A batch's connection to panels: serial numbers and requests come in, what stands in which socket goes out."""

from collections import deque
from collections.abc import Callable, Mapping, Sequence
from dataclasses import asdict, dataclass, field
from datetime import UTC, datetime
from pathlib import Path
from threading import Lock
from typing import Any

from bench.eol.line.admission.next_motor import RefusedSerial
from bench.eol.line.admission.serial_numbers import QueuedSerials
from bench.eol.line.batch_listener import BatchListener
from bench.eol.line.batch_log import ANNOUNCEMENTS, BatchMotor
from bench.eol.line.brakes import AppliedBrake
from bench.eol.line.tile_figures import tile_figures
from bench.eol.motor_yield import MotorYield
from bench.eol.record import MotorRecord, label_of
from bench.eol.store.waiting import Waiting
from bench.eol.told_causes import cause_of, diagnosis_of, last_causes
from bench.eol.verdict import Verdict
from bench.journal.stored_result import store_text
from bench.operators.operator_channel import OperatorLine
from drivers.interfaces.text import Text, text

#: The files in a batch's folder that say where panels reach its line, and one whose serial numbers come from elsewhere.
FILE, WATCHED = ANNOUNCEMENTS
#: Serial numbers that wait for a socket, at most: what is scanned beyond them is refused.
_WAITING = 100
#: Motors that the pace is of, and one.
_LATEST = 21


@dataclass
class _Socket:
    """A socket as a panel shows it: the motor in it since when (UTC, ISO 8601), why it takes no more, and the last one's end."""

    name: str
    serial_number: str = ""
    since: str = ""
    braked: dict[str, Any] | None = None
    last: dict[str, Any] | None = None


@dataclass
class _Counts:
    """Verdicts by test and yields by motor since the batch was begun or resumed."""

    since: str
    verdicts: dict[str, int] = field(
        default_factory=lambda: dict.fromkeys((verdict.value for verdict in Verdict.of_motors()), 0)
    )
    motors: int = 0
    #: Of these, those that were never judged before, and of these those that passed at once.
    new: int = 0
    first_pass: int = 0
    final: int = 0
    golden: int = 0
    refused: int = 0
    #: How often (s) one of the latest motors came to its end, None before the second.
    pace: float | None = None
    #: Failed tests by their first rework code, empty where no part was named.
    reworks: dict[str, int] = field(default_factory=dict)


class PanelChannel(BatchListener):
    """Listens to the events of a line, and sends its whole state to every panel at each change.

    A panel sends `{"serial": NUMBER}`, with `"again": PERSON` where a person answers for one that was tested before,
    `{"finish": PERSON}`: no more motors, those in the sockets to their end, or `{"stop": PERSON}`: shut down now. Without `serials`
    the numbers come from elsewhere, and panels watch and stop.
    """

    def __init__(self, batch: str, plan: str, sockets: Sequence[str], serials: QueuedSerials | None) -> None:
        self._about = {"batch": batch, "plan": plan, "scans": serials is not None}
        self._sockets = {name: _Socket(name) for name in sockets}
        self._serials = serials
        self._counts, self._yield = _Counts(_now()), MotorYield()
        self._ends: deque[datetime] = deque(maxlen=_LATEST)
        self._message: dict[str, Any] | None = None
        self._records = _waiting(Waiting())
        #: What is to be known and calls for nothing at once; it stands until the next motor is done.
        self._notes: list[Text] = []
        self._ending: Text | None = None
        self._stop: Callable[[str], None] = lambda _: None
        self._permit: Callable[[str, str], None] = lambda _serial, _person: None
        self._lock = Lock()
        self._line = OperatorLine(self._receive)
        self._send()

    def open(self, folder: Path, stop: Callable[[str], None], permit: Callable[[str, str], None]) -> None:
        """Announce the line in the batch's folder; `stop` ends the batch, `permit` has a person answer for a serial number.

        Raises OSError.
        """
        self._stop, self._permit = stop, permit
        mine, other = (FILE, WATCHED) if self._serials is not None else (WATCHED, FILE)
        self._line.announce(folder, mine)
        # The batch may have been broken off when its serial numbers came from elsewhere.
        (folder / other).unlink(missing_ok=True)

    def close(self) -> None:
        """Close the connections and withdraw the announcement."""
        self._line.close()

    def begun(self, motor: BatchMotor, socket: str) -> None:
        """Hear that a motor is measured from now on."""
        with self._lock:
            if motor.judged_before:
                self._yield.judged_before(motor.serial_number)
            socket_state = self._sockets[socket]
            socket_state.serial_number, socket_state.since = motor.serial_number, _now()
            self._message = {"kind": "begun", "words": motor.serial_number, "socket": socket}
        self._send()

    def done(self, record: MotorRecord) -> None:
        """Hear that a motor's record is kept."""
        with self._lock:
            socket_state = self._sockets[record.socket]
            socket_state.serial_number = socket_state.since = ""
            socket_state.last = {
                "serial_number": record.serial_number,
                "verdict": record.verdict.value,
                "cause": store_text(cause_of(record)),
                "causes": [(procedure, store_text(cause)) for procedure, cause in last_causes(record).items()],
                "diagnosis": [store_text(each) for each in diagnosis_of(record)],
                "rework": record.rework,
                "golden": record.golden,
                "label": label_of(record),
                **tile_figures(record),
            }
            self._take_count(record)
            self._notes.clear()
        self._send()

    def refused(self, refused: RefusedSerial) -> None:
        """Hear that a serial number is not measured."""
        with self._lock:
            self._counts.refused += 1
            self._message = _message("refused", refused.why)
            self._message["again"] = refused.serial_number if refused.by_person else ""
        self._send()

    def braked(self, brake: AppliedBrake) -> None:
        """Hear that a socket or the line takes no more motors."""
        with self._lock:
            self._message = _message("trouble", brake.why)
            if brake.socket:
                self._sockets[brake.socket].braked = store_text(brake.why)
            else:
                self._ending = brake.why
        self._send()

    def trouble(self, words: Text) -> None:
        """Hear of something that went wrong and concerns no motor's figures."""
        with self._lock:
            self._message = _message("trouble", words)
        self._send()

    def noted(self, words: Text) -> None:
        """Hear what is to be known: it takes the place of no instruction."""
        with self._lock:
            self._notes.append(words)
        self._send()

    def waits(self, waiting: Waiting) -> None:
        """Hear what of the records waits to be stored or forwarded."""
        with self._lock:
            self._records = _waiting(waiting)
        self._send()

    def _receive(self, message: Mapping[str, Any]) -> Text | None:
        serials = self._serials
        match message:
            case {"serial": str(serial), "again": str(person)} if serials is not None:
                if not person.strip():
                    return text("a person who has a motor tested again gives a name")
                self._permit(serial.strip(), person.strip())
                return self._take_serial(serials, serial)
            case {"serial": str(serial)} if serials is not None:
                return self._take_serial(serials, serial)
            case {"finish": str(person)} if serials is not None:
                self._ending = text("finished by {person}", person=person)
                serials.end()
            case {"serial": _} | {"finish": _} if serials is None:
                return text(
                    "this batch does not take its serial numbers from a panel: go on, or finish it, where it was begun"
                )
            case {"stop": str(person)}:
                self._ending = text("stopped by {person}", person=person)
                self._stop(person)
            case {"watching": _}:
                return None
            case _:
                return text('allowed are {{"serial": NUMBER}}, {{"finish": PERSON}} and {{"stop": PERSON}}')
        self._send()
        return None

    def _take_count(self, record: MotorRecord) -> None:
        if record.golden:
            self._counts.golden += 1
            return
        self._counts.verdicts[record.verdict.value] += 1
        self._yield.add(record)
        self._counts.motors, self._counts.final = self._yield.motors, self._yield.final
        self._counts.new, self._counts.first_pass = self._yield.new, self._yield.first_pass
        self._ends.append(record.ended)
        if len(self._ends) > 1:
            self._counts.pace = (max(self._ends) - min(self._ends)).total_seconds() / (len(self._ends) - 1)
        if record.verdict is Verdict.FAIL:
            code = (record.rework.split() or [""])[0]
            self._counts.reworks[code] = self._counts.reworks.get(code, 0) + 1

    def _take_serial(self, serials: QueuedSerials, serial: str) -> Text | None:
        serial = serial.strip()
        if self._ending is not None:
            return text("serial number {serial}: the batch is {ending}", serial=serial, ending=self._ending)
        if not serial:
            return text("no serial number was given")
        if serials.waiting >= _WAITING:
            return text(
                "serial number {serial}: {number} motors are already waiting for a socket",
                serial=serial,
                number=_WAITING,
            )
        serials.put(serial)
        self._send()
        return None

    def _send(self) -> None:
        with self._lock:
            state = {
                **self._about,
                "sockets": [asdict(socket) for socket in self._sockets.values()],
                "counts": asdict(self._counts),
                "waiting": self._serials.waiting if self._serials is not None else 0,
                "records": self._records,
                "notes": [store_text(note) for note in self._notes],
                "message": self._message,
                "ending": None if self._ending is None else store_text(self._ending),
            }
        self._line.say({"line": state})


def _message(kind: str, words: Text) -> dict[str, Any]:
    return {"kind": kind, "words": str(words), "text": store_text(words)}


def _waiting(waiting: Waiting) -> dict[str, Any]:
    """Return what waits as a panel shows it."""
    return {
        "for_server": waiting.for_server,
        "unstored": waiting.unstored,
        "next_try": None if waiting.next_try is None else waiting.next_try.isoformat(),
        "sentences": [store_text(sentence) for sentence in waiting.sentences()],
    }


def _now() -> str:
    return datetime.now(UTC).isoformat(timespec="seconds")
