"""Use of a switch matrix: crosspoints closed one set after the other, and relays that do not follow."""

from collections.abc import Collection
from typing import Any

from bench.testing.conformance.report import Checks
from bench.testing.conformance.session import CheckSession
from bench.testing.conformance.stand import OneInstrumentBench
from drivers.interfaces import CrosspointError, ReportedError
from sim_instruments.faults.line_faults import Fault, FaultKind

_SETS: tuple[frozenset[str], ...] = (
    frozenset({"A:supply+", "B:supply-"}),
    frozenset({"A:lcr_high", "B:lcr_low", "A:voltmeter+", "B:voltmeter-"}),
    frozenset({"C:supply+", "B:supply-", "A:channel1+", "B:channel1-"}),
)
#: What may not be closed together: two sockets at a terminal, two sources, a lead on two points, beside an insulation test.
_CONFLICTS: tuple[frozenset[str], ...] = (
    frozenset({"A:supply+", "A:supply-"}),
    frozenset({"A:supply+", "B:lcr_low"}),
    frozenset({"A:supply+", "B:inverter_v"}),
    frozenset({"A:supply+", "B:drive_1"}),
    frozenset({"A:supply+", "B:insulation_high"}),
    frozenset({"A:voltmeter+", "B:voltmeter+"}),
    frozenset({"A:channel1+", "B:channel1+"}),
    frozenset({"A:insulation_high", "B:voltmeter+"}),
    frozenset({"A:insulation_high", "B:channel1+"}),
    frozenset({"A:insulation_high", "leads:short"}),
)


def _prepare(stand: OneInstrumentBench) -> None:
    """Nothing to do: it wires the motor itself."""


def _joined(stand: OneInstrumentBench) -> frozenset[str]:
    return frozenset(
        f"{terminal}:{socket}" for terminal, socket in stand.world.truth()["wiring"].items() if socket != "open"
    )


def _compare(stand: OneInstrumentBench, matrix: Any, checks: Checks, wanted: Collection[str]) -> None:
    remedy = "Compare channels and the list's form with the manual"
    held = matrix.closed()
    checks.that("closed() is what was asked for", held == wanted, f"{sorted(held)}", remedy)
    sockets = frozenset(name for name in wanted if ":voltmeter" not in name and ":channel" not in name)
    found = _joined(stand)
    checks.that("the motor is wired as asked for", found == sockets, f"{sorted(found)}", remedy)


def _connect(stand: OneInstrumentBench, matrix: Any, checks: Checks, wanted: frozenset[str]) -> None:
    before, changes = stand.bench.clock.now(), matrix.closed() != wanted
    matrix.connect(wanted)
    right, remedy = stand.bench.clock.now() - before >= 0.02 or not changes, "Wait for the relays' settling time"
    checks.that("connect() waits until the contacts have settled", right, "it returned at once", remedy)
    _compare(stand, matrix, checks, wanted)


def _brief(stand: OneInstrumentBench, matrix: Any, checks: Checks) -> None:
    for wanted in _SETS[:2]:
        _connect(stand, matrix, checks, wanted & matrix.crosspoints)


def _full(stand: OneInstrumentBench, matrix: Any, checks: Checks) -> None:
    there = matrix.crosspoints
    for wanted in (*_SETS, frozenset[str](), _SETS[0], _SETS[0]):
        _connect(stand, matrix, checks, wanted & there)
    remedy = "Check with drivers.bases.crosspoints.conflict before anything is switched"
    for wanted in (*(each for each in _CONFLICTS if each <= there), frozenset({"A:nowhere"})):
        stand.messages.clear()
        with checks.refuses(f"refused: {', '.join(sorted(wanted))}", CrosspointError, remedy=remedy, says=wanted):
            matrix.connect(wanted)
        sent = [message for message, _ in stand.messages]
        checks.that("nothing is sent for what is refused", not sent, f"{sent} was sent", remedy)
    for name in ("supply+", "inverter_u", "drive_1", "insulation_high"):
        if f"A:{name}" in there:
            _connect(stand, matrix, checks, frozenset({f"A:{name}"}))
    if all(wanted <= there for wanted in _SETS[:2]):
        _stuck(stand, matrix, checks)


def _stuck(stand: OneInstrumentBench, matrix: Any, checks: Checks) -> None:
    """Check that a crosspoint that does not read back as closed opens everything and is reported."""
    remedy = "Read back what is closed, open everything, and raise ReportedError naming the crosspoint"
    frozen = stand.faults.add(Fault(FaultKind.FROZEN, lambda _, message: "?" in message, times=None))
    matrix.connect(_SETS[0])
    with checks.refuses("a relay that does not follow", ReportedError, remedy=remedy):
        matrix.connect(_SETS[1])
    left = _joined(stand)
    checks.that("all open after that", not left, f"{sorted(left)} closed", remedy)
    with checks.refuses("make_safe with a relay that does not follow", ReportedError, remedy=remedy):
        matrix.make_safe()
    stand.faults.remove(frozen)
    _connect(stand, matrix, checks, _SETS[1])
    matrix.make_safe()
    left = _joined(stand) | matrix.closed()
    checks.that("make_safe opens all", not left, f"{sorted(left)} closed", remedy)


SESSION = CheckSession(_prepare, _brief, _full)
