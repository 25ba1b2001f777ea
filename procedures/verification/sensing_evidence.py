"""Verification by what senses beside a supply: a voltmeter's leads, a voltage probe and a current probe."""

from collections.abc import Iterator, Sequence
from dataclasses import dataclass

from drivers.interfaces.text import Text, text
from procedures.core.actions import Connect, ConnectVoltmeter, CurrentProbe, Node, Socket, Terminal, VoltageProbe
from procedures.estimation.fitting.intervals import ANY, Interval, around
from procedures.estimation.winding.wiring import (
    Judgement,
    Kind,
    Mistake,
    Observation,
    SensingLeads,
    WiringOutcome,
    current_sensed,
    loop_resistance,
    mistakes,
    odd_line,
    voltage_sensed,
)
from procedures.verification.check import TERMINALS, Check, records
from procedures.verification.lines import Reference
from procedures.verification.supply_evidence import SupplyReading, evidence, figures, middle
from procedures.verification.two_poles import ALIKE, THIRD, alike, expected, loop, one_of_three, poles_of
from procedures.verification.two_poles import judged as judged_alike

#: Of one polarity's reading the other's is this share where a wire joins the third terminal, or a lead of the voltmeter is on it; unlike
#: phases make it differ by so much.
_ELSEWHERE, _NEAR = (0.75, 0.5), 0.05
#: Shares of voltage and current between unlike phases are off by this at most.
_UNLIKE = 0.05


@dataclass(frozen=True)
class Sensed:
    """The voltage (V) and current (A) that are sensed, within their errors, None if nothing senses it; scope channels or None."""

    voltage: Interval | None = None
    current: Interval | None = None
    voltage_channel: int | None = None
    current_channel: int | None = None


def of_voltmeter(action: ConnectVoltmeter) -> SensingLeads:
    """Return where a voltmeter's leads should be."""
    return SensingLeads(voltage=(TERMINALS.index(action.positive), TERMINALS.index(action.negative)))


def of_probes(voltage: VoltageProbe, current: CurrentProbe) -> SensingLeads:
    """Return where a voltage probe between two terminals and a current probe should be."""
    positive, negative = (TERMINALS.index(_terminal(node)) for node in (voltage.positive, voltage.negative))
    return SensingLeads((positive, negative), (TERMINALS.index(current.terminal), 1))


def judged(
    connect: Connect,
    leads: SensingLeads,
    read: SupplyReading,
    sensed: Sensed,
    reference: Reference | None,
    longest: float,
) -> Check:
    """Hold the supply's readings and what is sensed against the connection as intended; the supply's leads have at most `longest` Ω."""
    between = reference.leads if reference else Interval(0.0, longest)

    def observe(known: Reference | None) -> list[Observation]:
        phases = known.phases if known else ALIKE
        observations = [loop(read.resistance, known, between)]
        if not read.path:
            return observations
        if sensed.voltage is not None:
            observations.append(_over_supply(sensed.voltage.over(read.voltage), phases, _motor_share(read, between)))
            if known is not None:
                observations.append(_over_current(sensed.voltage.over(read.current), known))
        if sensed.current is not None:
            observations.append(_of_current(sensed.current.over(read.current), phases))
        return observations

    found, earlier = judged_alike(mistakes(poles_of(connect), leads), observe, reference)
    channels = (sensed.voltage_channel, sensed.current_channel)
    reason = ""
    if found.outcome is WiringOutcome.UNVERIFIED:
        reason = "too close" if reference else "unknown"
    return Check(
        found.outcome,
        "voltmeter" if sensed.voltage_channel is None else "oscilloscope",
        (*records(found, earlier, leads, channels), *_badly_set(found, channels)),
        {**figures(read), **_sensed_figures(sensed)},
        reason,
        _evidence(read, sensed, expected(connect, reference)),
    )


def _badly_set(found: Judgement, channels: tuple[int | None, int | None]) -> Iterator[dict[str, object]]:
    """Give the records of channels that read wrongly for what is set, and so look like a lead that is elsewhere."""
    elsewhere = (Kind.VOLTAGE_LEAD, Kind.CURRENT_PROBE)
    for kind, channel in zip(elsewhere, channels, strict=True):
        if channel is not None and any(mistake.kind is kind for mistake in found.possible):
            yield {"kind": "channel", "channel": channel}


def compared(lines: Sequence[float], which: int) -> Check:
    """Hold one of three four-wire readings (Ω) against the other two, which stand for what it should be."""
    third = {"kind": "third", "terminals": [TERMINALS[THIRD[which]].value]}
    return one_of_three("voltmeter", lines, which, third, odd=which in (odd_line(lines), odd_line(lines, 0.5)))


def both_ways(connect: Connect, forwards: float, backwards: float) -> Check:
    """Hold four-wire readings (Ω) of one pair in both polarities against each other."""
    readings = {"forwards": forwards, "backwards": backwards}
    if min(readings.values()) > 0.0 and alike((forwards, backwards)):
        return Check(WiringOutcome.VERIFIED, "voltmeter", (), readings)
    (third,) = (t.value for t, socket in connect.complete().items() if socket is Socket.OPEN)
    evidence = text(
        "the four-wire reading is {forwards:.4g} Ω in one polarity and {backwards:.4g} Ω in the other",
        forwards=forwards,
        backwards=backwards,
    )
    share = min(forwards, backwards) / max(forwards, backwards)
    elsewhere = share <= 0.0 or any(abs(share - told) <= _NEAR for told in _ELSEWHERE)
    entries = ({"kind": "third", "terminals": [third]},) if elsewhere else ()
    return Check(
        WiringOutcome.WRONG,
        "voltmeter",
        (*entries, {"kind": "contacts"}),
        readings,
        "",
        evidence,
        correctable_now=False,
    )


def _motor_share(read: SupplyReading, leads: Interval) -> Interval:
    """Return how much of the supply's voltage is at the terminals, its leads taking the rest."""
    taken = leads.over(read.resistance)
    if taken is ANY:
        return Interval(0.0, 1.0)
    return Interval(max(0.0, 1.0 - taken.high), max(0.0, 1.0 - taken.low))


def _over_supply(read: Interval, phases: tuple[float, float, float], motor: Interval) -> Observation:
    def predicted(mistake: Mistake) -> Interval:
        share = voltage_sensed(phases, mistake)
        if share is None:
            return ANY
        ends = [share * end for end in (0.0 if mistake.kind is Kind.TOUCHING else motor.low, motor.high)]
        return Interval(min(ends) - _UNLIKE, max(ends) + _UNLIKE)

    return Observation(read, predicted)


def _over_current(read: Interval, reference: Reference) -> Observation:
    def predicted(mistake: Mistake) -> Interval:
        share = voltage_sensed(reference.phases, mistake)
        if share is None or mistake.kind is Kind.TOUCHING:
            return ANY
        resistance = loop_resistance(reference.phases, mistake.poles)
        return around(share * resistance, gain=reference.tolerance, offset=_UNLIKE * resistance)

    return Observation(read, predicted)


def _of_current(read: Interval, phases: tuple[float, float, float]) -> Observation:
    def predicted(mistake: Mistake) -> Interval:
        share = current_sensed(phases, mistake)
        return ANY if share is None else around(share, offset=_UNLIKE)

    return Observation(read, predicted)


def _sensed_figures(sensed: Sensed) -> dict[str, float]:
    readings = {"sensed_voltage": sensed.voltage, "sensed_current": sensed.current}
    return {name: middle(interval) for name, interval in readings.items() if interval is not None}


def _evidence(read: SupplyReading, sensed: Sensed, wanted: float | None) -> Text:
    words = evidence(read, wanted)
    if not read.path:
        return words
    if sensed.voltage is not None:
        words = text(
            "{evidence}; {sensed:.3g} V of its {voltage:.3g} V are measured at the motor",
            evidence=words,
            sensed=middle(sensed.voltage),
            voltage=middle(read.voltage),
        )
    if sensed.current is not None:
        words = text(
            "{evidence}; {sensed:.3g} A of its {current:.3g} A are measured at the motor",
            evidence=words,
            sensed=middle(sensed.current),
            current=middle(read.current),
        )
    return words


def _terminal(node: Node) -> Terminal:
    return Terminal(node.value)
