"""The use of a role's instruments in the checks, and the trial of one driver in this way."""

import inspect
from collections.abc import Callable, Iterator
from contextlib import AbstractContextManager, contextmanager
from dataclasses import dataclass, replace
from importlib import import_module
from typing import Any

from bench.testing.conformance.report import Checks
from bench.testing.conformance.stand import DriverUnderTest, OneInstrumentBench, stand
from drivers.interfaces import InstrumentError, Role, Traffic
from drivers.interfaces.declarations import Effect, declarations

Use = Callable[[OneInstrumentBench, Any, Checks], None]
Energise = Callable[[OneInstrumentBench, Any], AbstractContextManager[None]]


def _nothing(stand: OneInstrumentBench, instrument: Any, checks: Checks) -> None:
    """Use nothing."""


@dataclass(frozen=True)
class CheckSession:
    """The use of an instrument of a role.

    `prepare` does what hands do before. `brief` is one use of every method that measures or feeds, whose messages are then
    disturbed one by one; `full` is further use, over random values. `energise` gives a block that feeds energy, None for a role
    that has none; `stuck` is what of the virtual bench can stay on. `longest` is how much longer (s, bench) it may take for one
    message that is not answered. Each compares with the actual state.
    """

    prepare: Callable[[OneInstrumentBench], None]
    brief: Use
    full: Use = _nothing
    energise: Energise | None = None
    stuck: str = ""
    longest: float = 60.0


def session_of(role: Role) -> CheckSession:
    """Return how instruments of a role are used."""
    result: CheckSession = import_module(f"bench.testing.conformance.roles.{role.value}").SESSION
    return result


def plain_readings(role: Role) -> Iterator[str]:
    """Give the methods of a role that measure and need no argument."""
    for name, declared in declarations(role.interface).items():
        needed = inspect.Parameter.empty in declared.arguments.values()
        if declared.effect is Effect.READING and not declared.is_property and not needed:
            yield name


@dataclass(frozen=True)
class Trial:
    """One driver, how its role is used, where findings go, and the seed of its benches."""

    subject: DriverUnderTest
    session: CheckSession
    checks: Checks
    seed: int
    thorough: bool = False

    def having(self, **options: Any) -> "Trial":
        """Return the trial of the driver with other options; the machine behind it stays what it is."""
        return replace(self, subject=replace(self.subject, options=replace(self.subject.options, **options)))

    def stand(self, *, sockets: bool = False, hostile: int | None = None) -> AbstractContextManager[OneInstrumentBench]:
        """Give a bench with its instrument, in the state in which it is found."""
        return stand(self.subject, self.seed, sockets=sockets, hostile=hostile)

    @contextmanager
    def opened(
        self, *, listening: bool = False, traffic: Traffic | None = None
    ) -> Iterator[tuple[OneInstrumentBench, Any]]:
        """Give a bench made ready, and the instrument opened; mended and closed at the end."""
        with self.stand() as made:
            self.session.prepare(made)
            if listening:
                made.listen()
            instrument: Any = made.open(traffic=traffic)
            try:
                yield made, instrument
            finally:
                made.faults.clear()
                instrument.close()

    def wrong(self, made: OneInstrumentBench, instrument: Any, *, full: bool = False, safe: bool = False) -> str:
        """Return what is wrong in a brief (or `full`) use, made `safe` before it; empty where all is right."""
        checks = Checks()
        try:
            if safe:
                instrument.make_safe()
            self.session.brief(made, instrument, checks)
            if full:
                self.session.full(made, instrument, checks)
        except InstrumentError as error:
            checks.that("no error", False, str(error), "There is nothing that it could tell")
        return checks.wrong

    def brief(self, made: OneInstrumentBench, instrument: Any) -> None:
        """Use it briefly and make it safe, whatever comes of it."""
        self.session.brief(made, instrument, Checks())
        instrument.make_safe()
