"""A driver's connection: closed, opened again, refused where another instrument or nothing answers."""

from collections.abc import Mapping
from contextlib import suppress
from typing import Any

from bench.testing.conformance.ends import TAKE_OVER
from bench.testing.conformance.report import Checks
from bench.testing.conformance.session import Trial
from bench.testing.conformance.stand import Stand
from drivers.interfaces import IdentityError, InstrumentError
from sim_instruments.faults.line_faults import Fault

#: What makes another instrument of it: another line of identity, and the device type of a node of another profile (CiA 401).
_OTHERS = {
    "visa": Fault.wrong_identity,
    "can": lambda: Fault.on("replace", r"^read 1000H", reply=bytes.fromhex("4300100091010200"), times=None),
}


def check_refused_options(trial: Trial, wrong: Mapping[str, Any]) -> None:
    """Check that options which this instrument cannot have are refused, by the error `raises` where that is among them."""
    remedy, wrong = "Check them when opening", dict(wrong)
    errors = (wrong.pop("raises"),) if "raises" in wrong else (InstrumentError, ValueError)
    with trial.checks.refuses(f"options that cannot be: {wrong}", *errors, remedy=remedy):
        with trial.having(**wrong).stand() as made:
            made.open().close()


def check_connection(trial: Trial) -> None:
    """Check the ways in which a connection is made, ends, and fails."""
    subject, checks = trial.subject, trial.checks
    with trial.opened() as (made, instrument):
        instrument.close()
        instrument.close()
        left = [stream for stream in made.streams if not stream.closed]
        checks.that("close() lets go of the line", not left, f"{len(left)} connections are open", "Close the port")
        again = made.open()
        wrong = trial.wrong(made, again)
        checks.that("close() lets go: opened again, it works", not wrong, wrong, TAKE_OVER)
        again.close()
    with trial.stand() as made:
        if made.transport == "visa":
            if subject.role.feeds:
                _waiting(made, checks)
        else:
            made.listen()
            made.open(guarding=True).close()
            remedy = "Ask nothing that the run could notice"
            checks.that("guarding asks nothing when it opens", not made.messages, f"{made.messages}", remedy)
    with trial.stand() as made:
        if made.transport in _OTHERS:
            made.faults.add(_OTHERS[made.transport]())
            with checks.refuses("another instrument answers", IdentityError, remedy="Compare maker, model, profile"):
                made.open().close()
    if hasattr(subject.options, "serial_number"):
        with trial.having(serial_number="not this one").stand() as made:
            with checks.refuses("another serial number answers", IdentityError, remedy="Compare it with serial_number"):
                made.open().close()
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


def _waiting(made: Stand, checks: Checks) -> None:
    """Check that an error that waits is told by who opens the instrument for use, and left alone by who guards it."""
    simulated = made.simulated
    simulated.write(b"NO:SUCH:HEADER\n")
    made.open(guarding=True).close()
    simulated.write(b"SYST:ERR?\n")
    reply, _ = simulated.read(200, 1.0)
    remedy = "Ask nothing that the run could notice when guarding"
    checks.that("guarding leaves errors alone", not reply.lstrip(b"+").startswith(b"0"), "the queue is empty", remedy)
    simulated.write(b"NO:SUCH:HEADER\n")
    with suppress(InstrumentError):
        made.open().close()
        checks.that("an error that waits is told", False, "nobody looked", "Look at the error queue when opening")
