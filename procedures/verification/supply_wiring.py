"""Connections to a supply, proved by a harmless current."""

import math
from collections.abc import Callable, Sequence

from drivers.interfaces import Reading, Regulated
from drivers.interfaces.text import text
from procedures.core.actions import Connect, ConnectProbes, ConnectVoltmeter, CurrentProbe, VoltageProbe
from procedures.estimation.fitting.intervals import ANY
from procedures.estimation.winding.held_angle import Stands, explaining
from procedures.estimation.winding.wiring import Kind, Leads, Outcome
from procedures.verification import by_leads, by_supply
from procedures.verification.check import Check, mistake_record
from procedures.verification.steady import again, direct, risen
from procedures.verification.two_poles import poles_of
from procedures.verification.verification import Proof

#: A channel shows so much more than is expected, either way.
_ROOM = 1.4


class SupplyWiring:
    """Connections to the supply, and what senses beside it."""

    def __init__(self, proof: Proof) -> None:
        self._proof = proof
        self._bench = proof.bench

    def connect(self, connect: Connect) -> None:
        """Connect the terminals to the supply, and prove it; a rotor that is not locked swings, and then only the path shows."""
        self._bench.perform(connect)
        self._proof.verify(connect, lambda: self._by_harmless_current(connect))

    def held(self, connect: Connect) -> bool:
        """Prove a connection by the current that flows already, the shaft being locked, where that was not done before.

        Return whether it is proved.
        """
        standing = self._bench.standing
        if not standing.proved and not self._bench.supply.read_by_hand:
            self._proof.verify(connect, lambda: self._judge(connect, by_supply.fed(self._bench.supply), swinging=False))
        return standing.proved

    def aligned(self, connect: Connect, stands: Stands, *, continuous: bool) -> None:
        """Prove that the rotor stands where this connection's current turns it, where its saliency tells an angle.

        `continuous` says that the connection's continuity was proved when the current flowed.
        """
        if not stands.telling:
            return
        explaining_it = explaining(stands, poles_of(connect), continuous=continuous)
        told = {"angle": stands.angle, "saliency": stands.saliency}
        if not explaining_it:
            # Friction may hold a rotor off; the procedure itself judges how far is too far.
            return
        possible = tuple(mistake_record(mistake, Leads()) for mistake in explaining_it)
        right = explaining_it[0].kind is Kind.NONE
        evidence = text(
            "aligned by this connection, the rotor stands at {angle:.0f}° of phase A's axis, electrical",
            angle=math.degrees(stands.angle),
        )
        found = Check(
            Outcome.PROVED if right else Outcome.WRONG,
            "lcr_meter",
            () if right else possible,
            told,
            "aligned" if right else "",
            evidence,
            mendable=False,
        )
        self._proof.record(connect, found) if right else self._proof.verify(connect, lambda: found)

    def both_ways(self, connect: Connect, forwards: float, backwards: float) -> None:
        """Hold four-wire readings (Ω) of one pair in both polarities against each other, which only a clip elsewhere tells apart."""
        found = by_leads.both_ways(connect, forwards, backwards)
        if found.outcome is Outcome.WRONG:
            self._proof.verify(connect, lambda: found)

    def compare_lines(
        self, connects: Sequence[Connect], lines: Callable[[], Sequence[float]], read_again: Callable[[int], None]
    ) -> None:
        """Hold four-wire readings (Ω) of AB, BC, CA against each other; `read_again` has one of them made anew."""
        self._proof.compare(connects, lambda which: by_leads.compared(lines(), which), read_again)

    def four_wires(self, connect: Connect, voltmeter: ConnectVoltmeter, *, ranged: bool) -> None:
        """Connect the terminals to the supply, the voltmeter being fitted, and prove both.

        `ranged` tells that the voltmeter has its range, and is to keep it.
        """
        self._bench.perform(connect)
        self._proof.verify(connect, lambda: self._by_voltmeter(connect, voltmeter, ranged=ranged), voltmeter)

    def probed(self, connect: Connect, voltage: VoltageProbe, current: CurrentProbe) -> None:
        """Fit a voltage and a current probe beside the supply that is connected already, and prove all of it."""
        probes = ConnectProbes((voltage, current))
        self._bench.perform(probes)
        self._proof.verify(connect, lambda: self._by_probes(connect, voltage, current), probes)

    def seen_leads(self, output: Reading, current: Reading, voltmeter: Reading) -> None:
        """Keep what two- and four-wire voltage of one current show of the supply's leads."""
        drop = by_supply.within(output).plus(by_supply.within(voltmeter).scaled(-1.0))
        resistance = drop.over(by_supply.within(current))
        if resistance is not ANY:
            self._proof.lines.seen_leads(resistance)

    def _by_harmless_current(self, connect: Connect) -> Check:
        supply = self._bench.supply
        if supply.read_by_hand:
            return Check(Outcome.UNPROVED, "supply", reason="by hand")
        with supply.energised(*self._harmless(), Regulated.CURRENT):
            self._bench.clock.sleep(self._proof.levels.settle)
            read = by_supply.fed(supply)
        return self._judge(connect, read, swinging=not self._bench.standing.rotor_locked)

    def _by_voltmeter(self, connect: Connect, action: ConnectVoltmeter, *, ranged: bool) -> Check:
        supply, voltmeter = self._bench.supply, self._bench.voltmeter
        if supply.read_by_hand or voltmeter.read_by_hand:
            return Check(Outcome.UNPROVED, "voltmeter", reason="by hand")
        with supply.energised(*self._harmless(), Regulated.CURRENT):
            self._bench.clock.sleep(self._proof.levels.settle)
            read = by_supply.fed(supply)
            if not ranged:
                voltmeter.configure(max(abs(read.voltage.low), read.voltage.high))
            sensed = by_leads.Sensed(voltage=by_supply.within(voltmeter.measure_voltage()))
        return self._judge_leads(connect, by_leads.of_voltmeter(action), read, sensed)

    def _by_probes(self, connect: Connect, voltage: VoltageProbe, current: CurrentProbe) -> Check:
        supply, scope = self._bench.supply, self._bench.oscilloscope
        if supply.read_by_hand or not scope.gives_waveforms:
            return Check(Outcome.UNPROVED, "oscilloscope", reason="by hand")
        volts, amperes = self._harmless()
        with supply.energised(volts, amperes, Regulated.CURRENT):
            self._bench.clock.sleep(self._proof.levels.settle)
            read = by_supply.fed(supply)
            spans = {
                voltage.channel: _ROOM * read.voltage.high,
                current.channel: _ROOM * max(amperes, read.current.high),
            }
            shown = direct(self._bench, spans)
        self._bench.clock.sleep(self._proof.levels.settle)
        zero = again(self._bench, list(spans))
        seen = {channel: risen(zero[channel], wave) for channel, wave in shown.items()}
        sensed = by_leads.Sensed(seen[voltage.channel], seen[current.channel], voltage.channel, current.channel)
        return self._judge_leads(connect, by_leads.of_probes(voltage, current), read, sensed)

    def _judge(self, connect: Connect, read: by_supply.Fed, *, swinging: bool) -> Check:
        lines, leads = self._proof.lines, self._proof.levels.leads
        reference = lines.for_supply(self._proof.known, leads)
        found = by_supply.judged(connect, read, reference, leads, swinging=swinging)
        if reference is None and read.path and not swinging:
            lines.suppose("supply", poles_of(connect), read.resistance)
        return found

    def _judge_leads(self, connect: Connect, told: Leads, read: by_supply.Fed, sensed: by_leads.Sensed) -> Check:
        leads = self._proof.levels.leads
        reference = self._proof.lines.for_supply(self._proof.known, leads)
        return by_leads.judged(connect, told, read, sensed, reference, leads)

    def _harmless(self) -> tuple[float, float]:
        """Return the voltage (V) and the current limit (A) that wiring is verified with."""
        supply, plate = self._bench.supply, self._proof.nameplate
        share = self._proof.levels.current_share * plate.rated_current
        highest = supply.maximum_voltage
        return min(highest, plate.rated_voltage or highest), min(share, supply.maximum_current, plate.current_bound)
