"""Asking one thing at a time: who has the instrument, what came of the question, and how much time is left."""

from collections.abc import Callable, Collection
from typing import TypeVar

from bench.discovery.findings import FoundInstrument, NotScanned, Question, ScanReport
from bench.discovery.matching import KnownInstruments
from bench.discovery.time_bound import TimeBound
from bench.safety.ownership.claims import Claim
from bench.safety.ownership.owner import HeldError, Ownership
from drivers.interfaces import Clock, InstrumentError
from drivers.interfaces.text import Text, text, text_of
from drivers.transport.canonical_address import canonical_addresses

T = TypeVar("T")
#: The longest piece of an answer that is shown (characters).
_SHOWN = 200


class Inquiry:
    """One scan's questions; what they bring is in `report`. `say` tells a person beforehand what takes long."""

    def __init__(
        self, clock: Clock, seconds: float, known: KnownInstruments, owner: Ownership, say: Callable[[Text], None]
    ) -> None:
        self.clock = clock
        self.bound = TimeBound(clock, seconds)
        self.known = known
        self.say = say
        self.report = ScanReport()
        self._owner = owner
        self._looked_at: set[str] = set()

    def take(self, *addresses: str, units: Collection[int] = ()) -> bool:
        """Reserve the instrument at these addresses for the scan; false if it was scanned already, or has another owner, which is
        added to the report.
        """
        keys = frozenset(key for address in addresses for key in canonical_addresses(address, units=units))
        if keys & self._looked_at:
            return False
        self._looked_at |= keys
        try:
            self._owner.claim([Claim(addresses[0], keys)])
        except HeldError as error:
            self.skip(addresses[0], text_of(error))
            return False
        return True

    def looked_at(self, name: str) -> bool:
        """Say whether anything was asked at what has this canonical name, or one that begins so."""
        return any(key.startswith(name) for key in self._looked_at)

    def ask(self, where: str, what: Text, action: Callable[[], T | None], seconds: float) -> T | None:
        """Return what `action` brings within `seconds` and put it down; None where nothing usable came."""
        if not self.bound.left:
            self.skip(where, text("not asked, because the time was over; allow more with --within"))
            return None
        answer, outcome = None, text("no answer")
        try:
            answer = self.bound.run(action, seconds)
        except TimeoutError:
            outcome = text("no answer in time")
        except Exception as error:  # noqa: BLE001  whatever a library raises, the others are still asked
            outcome = error.what if isinstance(error, InstrumentError) else text_of(error)
        except KeyboardInterrupt:
            self.report.asked.append(Question(where, what, text("interrupted by Ctrl-C"), answered=False))
            raise
        if answer is not None:
            outcome = text("answered")
        self.report.asked.append(Question(where, what, outcome, answered=answer is not None))
        return answer

    def skip(self, where: str, why: Text) -> None:
        """Put down what was not looked at."""
        self.report.unlooked.append(NotScanned(where, why))

    def add(self, finding: FoundInstrument) -> None:
        """Put down what was found."""
        self.report.found.append(finding)


def shown(answer: str | bytes) -> str:
    """Return an answer as it may be printed: no control characters, and no more than a line."""
    words = answer.decode("latin-1") if isinstance(answer, bytes) else answer
    line = "".join(letter if letter.isprintable() else repr(letter)[1:-1] for letter in words.strip())
    return line if len(line) <= _SHOWN else f"{line[:_SHOWN]}…"
