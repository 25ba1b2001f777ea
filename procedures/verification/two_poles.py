"""Terminals between two poles, a supply's or a bridge's, as the estimators see them."""

import math
from collections.abc import Callable, Mapping, Sequence
from typing import Any

from drivers.interfaces.text import text
from procedures.core.actions import Connect, Socket, Terminal
from procedures.estimation.fitting.intervals import Interval
from procedures.estimation.winding.wiring import (
    Judgement,
    Kind,
    Mistake,
    Observation,
    Pole,
    Poles,
    WiringOutcome,
    judge,
    loop_resistance,
    mistakes,
)
from procedures.verification.check import Check
from procedures.verification.lines import Reference

_POLES: Mapping[Socket, Pole] = {
    Socket.SUPPLY_POSITIVE: Pole.PLUS,
    Socket.SUPPLY_NEGATIVE: Pole.MINUS,
    Socket.METER_HIGH: Pole.PLUS,
    Socket.METER_LOW: Pole.MINUS,
}
#: Legs that stand for all where nothing is known of them.
ALIKE = (1.0, 1.0, 1.0)
#: The terminal that is left open when AB, BC, CA are read.
THIRD = (2, 0, 1)
#: Lines within this factor of each other are alike.
_ALIKE_LINES = 1.12
#: Resistance (Ω) without a path, and with one of which no more is known.
NO_PATH = Interval(math.inf, math.inf)
ANY_PATH = Interval(0.0, 1e12)


def poles_of(connect: Connect) -> Poles:
    """Return where each terminal meets the instrument's two poles."""
    sockets = connect.complete()
    a, b, c = (_POLES.get(sockets[terminal], Pole.OPEN) for terminal in Terminal)
    return a, b, c


def loop(read: Interval, reference: Reference | None, leads: Interval) -> Observation:
    """Observe the resistance (Ω) between the poles, `leads` (Ω) being what two touching clips would read at most."""

    def predicted(mistake: Mistake) -> Interval:
        if mistake.kind is Kind.TOUCHING:
            return Interval(0.0, leads.high)
        resistance = loop_resistance(reference.phases if reference else ALIKE, mistake.poles)
        if math.isinf(resistance):
            return NO_PATH
        if reference is None:
            return ANY_PATH
        return reference.loop(mistake.poles)

    return Observation(read, predicted)


def judged(
    candidates: Sequence[Mistake],
    observe: Callable[[Reference | None], Sequence[Observation]],
    reference: Reference | None,
) -> tuple[Judgement, list[Mistake]]:
    """Hold what is observed against every candidate, and say which mistakes of the connection before would explain it instead.

    `observe` gives the observations with their predictions from a reference.
    """
    found = judge(candidates, observe(reference))
    if (
        reference is None
        or reference.before is None
        or found.outcome in (WiringOutcome.VERIFIED, WiringOutcome.UNVERIFIED)
    ):
        return found, []
    earlier = [
        mistake
        for mistake in mistakes(reference.before)
        if mistake.kind in (Kind.OPEN, Kind.JOINED)
        and math.isfinite(loop_resistance(ALIKE, mistake.poles))
        and judge(candidates[:1], observe(reference.had_it_been(mistake.poles))).outcome is WiringOutcome.VERIFIED
    ]
    return (Judgement(WiringOutcome.WRONG, found.possible), earlier) if earlier else (found, [])


def alike(lines: Sequence[float]) -> bool:
    """Tell whether line readings (Ω) are so alike that none has its third terminal joined."""
    return max(lines) < _ALIKE_LINES * min(lines)


def one_of_three(by: str, lines: Sequence[float], which: int, finding: Mapping[str, Any], *, odd: bool) -> Check:
    """Return the check of one of three line readings (Ω) by the instrument `by`; `finding` is what made it the odd one."""
    reading = {"resistance": lines[which]}
    if not odd:
        like = alike(lines)
        return Check(
            WiringOutcome.VERIFIED if like else WiringOutcome.UNVERIFIED, by, (), reading, "alike" if like else "unlike"
        )
    evidence = text(
        "the reading is {read:.4g} Ω between these terminals, {others} Ω between the others",
        read=lines[which],
        others=[f"{line:.4g}" for k, line in enumerate(lines) if k != which],
    )
    return Check(WiringOutcome.WRONG, by, (finding,), reading, "", evidence)


def expected(connect: Connect, reference: Reference | None) -> float | None:
    """Return the resistance (Ω) that belongs to the connection as intended, leads left out; None where it is not known."""
    return loop_resistance(reference.phases, poles_of(connect)) if reference else None
