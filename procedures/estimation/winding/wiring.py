"""Wiring mistakes that a reading excludes or explains: three phases between two poles."""

import math
from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import dataclass, replace
from enum import Enum

from procedures.estimation.fitting.intervals import Interval


class Pole(Enum):
    """The pole of an instrument that a terminal is connected to; a supply's minus and a meter's low are MINUS."""

    PLUS = "plus"
    MINUS = "minus"
    OPEN = "open"


#: The poles at the terminals A, B, C; terminals are 0, 1, 2 throughout.
Poles = tuple[Pole, Pole, Pole]


class Kind(Enum):
    """Possible miswiring. OPEN, JOINED and TOUCHING break or add continuity, the others keep it."""

    NONE = "as told"
    OPEN = "open"
    JOINED = "joined"
    TOUCHING = "touching"
    OTHER_POLE = "other pole"
    EXCHANGED = "exchanged"
    VOLTAGE_LEAD = "voltage lead"
    VOLTAGE_REVERSED = "voltage reversed"
    CURRENT_PROBE = "current probe"


#: Mistakes after which other terminals are connected than should be, or none.
CONTINUITY = frozenset({Kind.OPEN, Kind.JOINED, Kind.TOUCHING})


@dataclass(frozen=True)
class SensingLeads:
    """The terminals that the two leads of a voltmeter or probe sense, and the wire in a current probe with its sign.

    None is nothing touched; a current probe's sign is 1 where its arrow points to the motor.
    """

    voltage: tuple[int | None, int | None] | None = None
    current: tuple[int | None, int] | None = None


@dataclass(frozen=True)
class Mistake:
    """One mistake of one pair of hands: the terminals it concerns, and where poles and leads then are.

    TOUCHING is the two poles' clips against each other. Of a lead or probe, `terminals` is where it should be.
    """

    kind: Kind
    terminals: tuple[int, ...]
    poles: Poles
    leads: SensingLeads = SensingLeads()


def loop_resistance(phases: Sequence[float], poles: Poles) -> float:
    """Return the resistance (Ω) between the poles of an equivalent wye with these legs (Ω); infinite without a path."""
    to_plus, to_minus = (_conductance(phases, poles, pole) for pole in (Pole.PLUS, Pole.MINUS))
    return 1.0 / to_plus + 1.0 / to_minus if to_plus and to_minus else math.inf


def potentials(phases: Sequence[float], poles: Poles) -> tuple[float, ...] | None:
    """Return the terminals' potentials, MINUS being 0 and PLUS 1; an open one has the star's. None without a path."""
    to_plus, to_minus = (_conductance(phases, poles, pole) for pole in (Pole.PLUS, Pole.MINUS))
    if not (to_plus and to_minus):
        return None
    levels = {Pole.PLUS: 1.0, Pole.MINUS: 0.0, Pole.OPEN: to_plus / (to_plus + to_minus)}
    return tuple(levels[pole] for pole in poles)


def currents(phases: Sequence[float], poles: Poles) -> tuple[float, ...] | None:
    """Return the currents into the terminals for 1 A from PLUS to MINUS; None without a path."""
    sums = {pole: _conductance(phases, poles, pole) for pole in (Pole.PLUS, Pole.MINUS)}
    if not all(sums.values()):
        return None
    signs = {Pole.PLUS: 1.0, Pole.MINUS: -1.0}
    return tuple(
        signs[pole] / (phase * sums[pole]) if pole in signs else 0.0 for phase, pole in zip(phases, poles, strict=True)
    )


def voltage_sensed(phases: Sequence[float], mistake: Mistake) -> float | None:
    """Return the voltage that the voltage leads sense over that between the poles; None without a path or leads.

    A lead that touches nothing senses none.
    """
    levels, leads = potentials(phases, mistake.poles), mistake.leads.voltage
    if levels is None or leads is None:
        return None
    positive, negative = leads
    return 0.0 if positive is None or negative is None else levels[positive] - levels[negative]


def current_sensed(phases: Sequence[float], mistake: Mistake) -> float | None:
    """Return the current that the current probe senses over that from PLUS to MINUS; None without a path or probe."""
    shares, probe = currents(phases, mistake.poles), mistake.leads.current
    if shares is None or probe is None:
        return None
    terminal, sign = probe
    # Between clips that touch, the current goes by without the motor.
    return 0.0 if terminal is None or mistake.kind is Kind.TOUCHING else sign * shares[terminal]


def mistakes(expected: Poles, leads: SensingLeads = SensingLeads()) -> list[Mistake]:
    """Return no mistake first, then every single one; each state of the wires once, as the first mistake that leads to it."""
    found = {expected: Mistake(Kind.NONE, (), expected, leads)}
    for mistake in _of_wires(expected):
        found.setdefault(mistake.poles, replace(mistake, leads=leads))
    return [*found.values(), Mistake(Kind.TOUCHING, (), expected, leads), *_of_leads(expected, leads)]


def _of_wires(expected: Poles) -> Iterator[Mistake]:
    for k, pole in enumerate(expected):
        if pole is not Pole.OPEN:
            yield Mistake(Kind.OPEN, (k,), _with(expected, {k: Pole.OPEN}))
    for k, pole in enumerate(expected):
        if pole is Pole.OPEN:
            for other in (Pole.PLUS, Pole.MINUS):
                yield Mistake(Kind.JOINED, (k,), _with(expected, {k: other}))
    for k in range(3):
        for m in range(k):
            if expected[k] is not expected[m]:
                yield Mistake(Kind.EXCHANGED, (m, k), _with(expected, {k: expected[m], m: expected[k]}))
    reversed_ = {Pole.PLUS: Pole.MINUS, Pole.MINUS: Pole.PLUS, Pole.OPEN: Pole.OPEN}
    a, b, c = (reversed_[pole] for pole in expected)
    yield Mistake(Kind.EXCHANGED, (0, 1, 2), (a, b, c))
    for k, pole in enumerate(expected):
        if pole is not Pole.OPEN:
            yield Mistake(Kind.OTHER_POLE, (k,), _with(expected, {k: reversed_[pole]}))


def _of_leads(expected: Poles, leads: SensingLeads) -> Iterator[Mistake]:
    places: tuple[int | None, ...] = (0, 1, 2, None)
    if leads.voltage is not None:
        positive, negative = leads.voltage
        wanted = tuple(t for t in leads.voltage if t is not None)
        yield Mistake(Kind.VOLTAGE_REVERSED, wanted, expected, replace(leads, voltage=(negative, positive)))
        for place in places:
            if place not in leads.voltage:
                yield Mistake(Kind.VOLTAGE_LEAD, wanted[:1], expected, replace(leads, voltage=(place, negative)))
                yield Mistake(Kind.VOLTAGE_LEAD, wanted[1:], expected, replace(leads, voltage=(positive, place)))
    if leads.current is not None:
        terminal, sign = leads.current
        wanted = () if terminal is None else (terminal,)
        for place in places:
            for arrow in (sign, -sign):
                if (place, arrow) != leads.current and (place is not None or arrow == sign):
                    yield Mistake(Kind.CURRENT_PROBE, wanted, expected, replace(leads, current=(place, arrow)))


def _conductance(phases: Sequence[float], poles: Poles, pole: Pole) -> float:
    return sum(1.0 / phase for phase, at in zip(phases, poles, strict=True) if at is pole)


def _with(expected: Poles, changed: Mapping[int, Pole]) -> Poles:
    a, b, c = (changed.get(k, pole) for k, pole in enumerate(expected))
    return a, b, c


class WiringOutcome(Enum):
    """Outcome of verifying a connection.

    VERIFIED: no mistake of continuity would read so. UNVERIFIED: the connection may be right, but so would such a mistake read.
    WRONG: it is not right, and a mistake explains the readings. UNEXPLAINED: neither right nor any one mistake.
    """

    VERIFIED = "verified"
    UNVERIFIED = "not verified"
    WRONG = "wrong"
    UNEXPLAINED = "unexplained"


@dataclass(frozen=True)
class Observation:
    """A figure as it was read, within its error, and what each mistake would have it be; ANY where that is not known."""

    read: Interval
    predicted: Callable[[Mistake], Interval]


@dataclass(frozen=True)
class Judgement:
    """The outcome, and the mistakes that all readings allow; a wire off or too much goes before all others that explain them."""

    outcome: WiringOutcome
    possible: tuple[Mistake, ...] = ()


def judge(candidates: Sequence[Mistake], observations: Sequence[Observation]) -> Judgement:
    """Hold the readings against every candidate, the first of which is no mistake."""
    possible = tuple(c for c in candidates if all(o.read.overlaps(o.predicted(c)) for o in observations))
    if not possible:
        return Judgement(WiringOutcome.UNEXPLAINED)
    breaking = tuple(mistake for mistake in possible if mistake.kind in CONTINUITY)
    if possible[0].kind is Kind.NONE:
        return Judgement(WiringOutcome.UNVERIFIED if breaking else WiringOutcome.VERIFIED, possible[1:])
    wires = tuple(mistake for mistake in breaking if mistake.kind is not Kind.TOUCHING)
    return Judgement(WiringOutcome.WRONG, wires or possible)


def odd_line(lines: Sequence[float], share: float = 0.75) -> int | None:
    """Return which of three line readings (Ω) is a share of the other two, which are alike; or None.

    Three quarters is a line with the third terminal joined, a half one whose voltage is taken at the third. A winding with
    unlike phases shows two low lines or none: no three phases of a healthy motor give one line lower by a quarter.
    """
    for k, line in enumerate(lines):
        others = [other for m, other in enumerate(lines) if m != k]
        if max(others) < _ALIKE * min(others) and abs(line / (0.5 * sum(others)) - share) < _NEAR:
            return k
    return None


#: Two lines are alike within this factor; a line is three quarters of them within this.
_ALIKE, _NEAR = 1.06, 0.04
