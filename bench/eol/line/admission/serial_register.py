"""A station's knowledge of a serial number: its claim and its earlier tests, here and at every station of the server."""

from collections.abc import Callable, Iterator
from concurrent.futures import Future
from threading import Lock, Thread
from time import monotonic
from typing import Any, TypeVar, cast

from sqlalchemy import Engine

from bench.eol.record import MotorRecord
from bench.eol.serial_number import in_other_capitals, spelled
from bench.eol.store.claims import STALE, STALE_BY_PERSON, SerialClaim, claim_serial, release_serial
from bench.eol.store.database import open_database
from bench.eol.store.earlier_tests import EarlierTest, earlier_test_of, earlier_tests, in_order, latest_of_plan
from bench.eol.store.faults import FAULTS, StoreError, fault_of
from bench.i18n.errors import InputError
from drivers.interfaces.text import Text, text, text_of

_Answer = TypeVar("_Answer")

#: After a database did not answer it is not asked for so long (s): a line must not wait for it with every motor.
_PAUSE = 30.0
#: How long (s) the line waits for a server's answer: it hears of no stop meanwhile.
_PATIENCE = 5.0


class SerialRegister:
    """Claims serial numbers and tells of their earlier tests, for one station.

    `own` is the station's database, `server` the address of the one that all stations share, empty where there is none;
    `spooled` gives the records that no database has. Where both are named, the server's claim counts.
    """

    def __init__(self, own: Engine, server: str, spooled: Callable[[], Iterator[MotorRecord]]) -> None:
        self._own = own
        self._address = server
        # A database that can be read may not be writable.
        self._claims = "server" if server else "own claims"
        self._spooled = spooled
        #: Guards the next two: a question that is given up lets go of the server itself, once it has its answer.
        self._lock = Lock()
        self._server: Engine | None = None
        self._wanted: Future[Any] | None = None
        self._asked: Future[Any] | None = None
        self._away: dict[str, tuple[float, Text]] = {}

    def claim(self, wanted: SerialClaim, *, by_person: bool = False) -> SerialClaim | None:
        """Claim a serial number; return who has it instead. Raises StoreError where the database of claims does not answer.

        One that somebody left without a record is taken over after a while, sooner where a person answers for it.
        """
        stale = STALE_BY_PERSON if by_person else STALE
        holder = self._ask(self._claims, lambda engine: claim_serial(engine, wanted, stale))
        if holder is not None and self._is_recorded(holder):
            self.release(holder)
            holder = self._ask(self._claims, lambda engine: claim_serial(engine, wanted, stale))
        return holder

    def _is_recorded(self, claim: SerialClaim) -> bool:
        """Tell whether its test has ended here: a server lets go of it with the record, which may wait for the server."""
        try:
            return any(test.identifier == claim.identifier for test in self.tests_here(claim.serial_number))
        except StoreError:
            return False

    def release(self, claim: SerialClaim) -> None:
        """Release a serial number that is not tested after all. Raises StoreError."""
        self._ask(self._claims, lambda engine: release_serial(engine, claim))

    def tests_here(self, serial_number: str) -> list[EarlierTest]:
        """Return the tests of a serial number that this station's records have, in order. Raises StoreError."""

        def tests(engine: Engine) -> list[EarlierTest]:
            looked_for = {serial_number, *in_other_capitals(serial_number)}
            spooled = [earlier_test_of(each) for each in self._spooled() if spelled(each.serial_number) in looked_for]
            return in_order([*earlier_tests(engine, serial_number), *spooled])

        return self._ask("own", tests)

    def tests_elsewhere(self, serial_number: str) -> list[EarlierTest]:
        """Return the tests of a serial number that the server has, none without one. Raises StoreError."""
        if not self._address:
            return []
        return self._ask("server", lambda engine: earlier_tests(engine, serial_number))

    def check_plan(self, name: str, sha256: str, model: str) -> Iterator[Text]:
        """Give what is to be said of a plan whose name the records know with another content.

        Raises InputError where they know it for another type. What cannot be looked up is not known.
        """
        try:
            last = self._ask("server" if self._address else "own", lambda engine: latest_of_plan(engine, name))
        except StoreError:
            return
        if last is not None and last.model != model:
            raise InputError(
                text(
                    "the records know the plan {name} for the type {other} (batch {batch}), and this one is for {model}; "
                    "they are kept by that name: give each plan its own (plan.name)",
                    name=name,
                    other=last.model,
                    batch=last.batch,
                    model=model,
                )
            )
        if last is not None and last.plan_sha256 != sha256:
            yield text(
                "the plan {name} has changed since batch {batch}; the statistics combine both under one name, "
                "limits of the time included",
                name=name,
                batch=last.batch,
            )

    def ask_server(self, question: Callable[[Engine], _Answer]) -> _Answer | None:
        """Return the server's answer, None where there is no server or it does not answer now."""
        if not self._address:
            return None
        try:
            return self._ask("server", question)
        except StoreError:
            return None

    def ask_again(self) -> None:
        """Ask the server from now on, although it did not answer a moment ago; from any thread."""
        self._away.pop("server", None)

    def close(self) -> None:
        """Close the connection to the server, with a question that it has not answered."""
        with self._lock:
            server, self._server, self._wanted = self._server, None, None
        if server is not None:
            server.dispose()

    def _ask(self, which: str, question: Callable[[Engine], _Answer]) -> _Answer:
        since, why = self._away.get(which, (0.0, Text("")))
        if since and monotonic() - since < _PAUSE:
            raise StoreError(why)
        try:
            answer = self._ask_server(question) if which == "server" else question(self._own)
        except (*FAULTS, StoreError) as error:
            if which == "server":
                why = text("the server: {why}", why=text_of(fault_of(error)))
                self.close()
            else:
                why = text("the station's own database: {why}", why=text_of(fault_of(error)))
            self._away[which] = (monotonic(), why)
            raise StoreError(why) from error
        self._away.pop(which, None)
        return answer

    def _ask_server(self, question: Callable[[Engine], _Answer]) -> _Answer:
        """Ask in a thread of its own: a server that is there and silent may take the request, and never answer."""
        silent = StoreError(text("no answer within {time:g} s", time=_PATIENCE))
        if self._asked is not None and not self._asked.done():
            raise silent
        answer: Future[_Answer] = Future()
        self._asked = answer
        with self._lock:
            server, self._server, self._wanted = self._server, None, answer

        def ask() -> None:
            engine = server
            try:
                engine = engine or open_database(self._address)
                given, error = question(engine), None
            except BaseException as failure:  # noqa: BLE001  whoever asked hears it
                given, error = None, failure
            with self._lock:
                kept = self._wanted is answer
                if kept:
                    self._server = engine
            if not kept and engine is not None:
                engine.dispose()
            if error is None:
                answer.set_result(cast("_Answer", given))
            else:
                answer.set_exception(error)

        Thread(target=ask, name="serial register", daemon=True).start()
        try:
            return answer.result(_PATIENCE)
        except TimeoutError:
            raise silent from None
