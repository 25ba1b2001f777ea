"""Checks of a driver's connection: closed, opened again, refused if another instrument or none answers."""

import errno
import re
from contextlib import suppress
from typing import Any
from unittest.mock import patch

import serial

from bench.testing.conformance.ends import TAKE_OVER
from bench.testing.conformance.report import Checks
from bench.testing.conformance.session import Trial
from bench.testing.conformance.stand import OneInstrumentBench
from drivers.interfaces import IdentityError, InstrumentError
from drivers.transport.serial.port_errors import reason_and_remedy
from sim_instruments.faults.line_faults import Fault

#: What makes another instrument of it: another line of identity, and the device type of a node of another profile (CiA 401).
_OTHERS = {
    "visa": Fault.wrong_identity,
    "can": lambda: Fault.on("replace", r"^read 1000H", reply=bytes.fromhex("4300100091010200"), times=None),
}


def check_connection(trial: Trial) -> None:
    """Check the ways in which a connection is made, ends, and fails."""
    subject, checks = trial.subject, trial.checks
    directions: list[str] = []
    traffic: list[str] = []
    with trial.stand() as made:
        trial.session.prepare(made)
        before = made.connections
        instrument = made.open()
        instrument.close()
        instrument.close()
        left = made.connections - before
        checks.that("close() lets go of the line", left <= 0, f"{left} connections are open", "Close the port")
        made.listen()
        again = made.open(
            wire=lambda _, direction, __: directions.append(direction), traffic=lambda *entry: traffic.append(entry[0])
        )
        wrong = trial.wrong(made, again)
        checks.that("close() lets go: opened again, it works", not wrong, wrong, TAKE_OVER)
        again.close()
        heard = f"{len(directions)} of {len(made.messages)} messages, of which {directions.count('<')} came from it"
        whole, remedy = len(directions) >= len(made.messages) and "<" in directions, "Hand on surroundings.wire"
        checks.that("what is on its wire is told", whole, heard, remedy)
        advice = "Hand on surroundings.traffic"
        checks.that("what it says and hears is told", "read" in traffic, f"{len(traffic)} entries", advice)
    with trial.stand() as made:
        if made.transport == "visa":
            _waiting(made, checks, guarded=subject.role.feeds)
        else:
            made.listen()
            made.open(guarding=True).close()
            remedy = "Ask nothing that the run could notice"
            checks.that("guarding asks nothing when it opens", not made.messages, f"{made.messages}", remedy)
    if checks.manual.local:
        _gives_the_panel_back(trial)
    check_port(trial)
    with trial.stand() as made:
        if made.transport in _OTHERS:
            made.faults.add(_OTHERS[made.transport]())
            with checks.refuses("another instrument answers", IdentityError, remedy="Compare maker, model, profile"):
                made.open().close()
    if hasattr(subject.options, "serial_number"):
        with trial.having(serial_number="not this one").stand() as made:
            with checks.refuses("another serial number answers", IdentityError, remedy="Compare it with serial_number"):
                made.open().close()
    with trial.opened() as (made, instrument), suppress(InstrumentError):
        # A port that fails is renewed, or told.
        for stream in made.streams:
            stream.read = _failing
        trial.brief(made, instrument)
    with checks.refuses("nothing answers", InstrumentError, remedy="Raise CommunicationError"):
        with trial.stand() as made:
            made.bench.address(subject.role.value)
            made.bench.connection(subject.role.value).pull()
            trial.session.prepare(made)
            instrument = made.open()
            try:
                trial.brief(made, instrument)
            finally:
                instrument.close()


def _gives_the_panel_back(trial: Trial) -> None:
    with trial.opened(listening=True) as (made, instrument):
        instrument.close()
        last = made.messages[-1][0].strip()
    right = re.search(trial.checks.manual.local, last) is not None
    trial.checks.that("close() gives the front panel back", right, f"'{last}' is its last message", "Go to local last")


def _failing(*_: Any) -> bytes:
    raise ConnectionResetError("the port is gone")


def _waiting(made: OneInstrumentBench, checks: Checks, *, guarded: bool) -> None:
    """Check that an error that waits is told by who opens the instrument for use, and left alone by who guards it."""

    def waits() -> bool:
        made.simulated.write(b"SYST:ERR?\n")
        return not made.simulated.read(200, 1.0)[0].lstrip(b"+").startswith(b"0")

    made.simulated.write(b"NO:SUCH:HEADER\n")
    if guarded:
        made.open(guarding=True).close()
        remedy = "Ask nothing that the run could notice when guarding"
        checks.that("guarding leaves errors alone", waits(), "the queue is empty", remedy)
        made.simulated.write(b"NO:SUCH:HEADER\n")
    with suppress(InstrumentError):
        made.open().close()
        left = guarded or waits()
        checks.that("an error that waits is told", not left, "nobody looked", "Look at the error queue when opening")


def check_port(trial: Trial) -> None:
    """Check how a serial port is set up, where the manual states it, and that one which cannot be opened is told."""
    if not trial.checks.manual.port:
        return
    found: dict[str, Any] = {}
    for error in (serial.SerialException("there is no such port"), serial.SerialException(errno.EACCES, "not allowed")):

        def opens(port: Any, error: Exception = error) -> None:
            found.update(port.get_settings())
            raise error

        _, remedy = reason_and_remedy(error)
        advice = "Raise CommunicationError with the reason and the remedy, as port_errors.not_opened() has them"
        with patch.object(serial.Serial, "open", opens), trial.stand() as made:
            with trial.checks.refuses(
                "a port that cannot be opened", InstrumentError, remedy=advice, says=(str(remedy),)
            ):
                made.open(address="/dev/ttyS99").close()
    for name, value in trial.checks.manual.port.items():
        wrong = f"{found.get(name)} instead of {value}"
        trial.checks.that(f"{name} of the port", found.get(name) == value, wrong, "Compare it with the manual")
