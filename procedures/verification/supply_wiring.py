"""Connections to a supply, verified by a harmless current."""

import math
from collections.abc import Mapping

from drivers.interfaces import Reading, Regulated
from drivers.interfaces.text import text
from procedures.core.actions import (
    Connect,
    ConnectProbes,
    ConnectVoltmeter,
    CurrentProbe,
    LinePair,
    VoltageProbe,
    Wanted,
    supply_across,
)
from procedures.estimation.fitting.intervals import ANY
from procedures.estimation.winding.held_angle import AxisAngle, explaining
from procedures.estimation.winding.wiring import Kind, SensingLeads, WiringOutcome
from procedures.techniques.steady_signals import again, direct, risen
from procedures.verification import sensing_evidence, supply_evidence
from procedures.verification.check import Check, mistake_record
from procedures.verification.resolved_current import require_resolved
from procedures.verification.two_poles import poles_of
from procedures.verification.verifier import VerifiedWiring

#: A channel shows so much more than is expected, either way.
_ROOM = 1.4


class SupplyWiring(VerifiedWiring):
    """Connections to the supply, and what senses beside it."""

    def connect(self, connect: Connect, *beside: Wanted) -> None:
        """Connect the terminals to the supply, with what else is wanted of the setup, and prove the connection.

        A rotor that is not locked swings, and then only the path shows.
        """
        self._bench.perform(connect, *beside)
        self._verifier.verify(connect, lambda: self._by_harmless_current(connect))

    def held(self, connect: Connect) -> bool:
        """Prove a connection by the current that flows already, the shaft being locked, where that was not done before.

        Return whether it is verified.
        """
        state = self._bench.state
        if not state.verified and not self._bench.supply.read_by_hand:
            self._verifier.verify(
                connect, lambda: self._judge(connect, supply_evidence.read(self._bench.supply), swinging=False)
            )
        return state.verified

    def aligned(self, connect: Connect, stands: AxisAngle, *, continuous: bool) -> None:
        """Prove that the rotor stands where this connection's current turns it, where its saliency tells an angle.

        `continuous` says that the connection's continuity was verified when the current flowed.
        """
        if not stands.telling:
            return
        explaining_it = explaining(stands, poles_of(connect), continuous=continuous)
        readings = {"angle": stands.angle, "saliency": stands.saliency}
        if not explaining_it:
            # Friction may hold a rotor off; the procedure itself judges how far is too far.
            return
        possible = tuple(mistake_record(mistake, SensingLeads()) for mistake in explaining_it)
        right = explaining_it[0].kind is Kind.NONE
        evidence = text(
            "after aligning with this connection the rotor stands at {angle:.0f}° electrical from the axis of phase A",
            angle=math.degrees(stands.angle),
        )
        check = Check(
            WiringOutcome.VERIFIED if right else WiringOutcome.WRONG,
            "lcr_meter",
            () if right else possible,
            readings,
            "aligned" if right else "",
            evidence,
            correctable_now=False,
        )
        self._verifier.record(connect, check) if right else self._verifier.verify(connect, lambda: check)

    def both_ways(self, connect: Connect, forwards: float, backwards: float) -> None:
        """Hold four-wire readings (Ω) of one pair in both polarities against each other, which only a clip elsewhere tells apart."""
        found = sensing_evidence.both_ways(connect, forwards, backwards)
        if found.outcome is WiringOutcome.WRONG:
            self._verifier.verify(connect, lambda: found)

    def lines_to_repeat(self, lines: Mapping[LinePair, float]) -> tuple[LinePair, ...]:
        """Return which four-wire readings (Ω) of AB, BC, CA are to be taken again, their connection being corrected; none if all fit."""
        return self._verifier.lines_to_repeat(
            {pair: supply_across(*pair) for pair in lines},
            [sensing_evidence.compared(list(lines.values()), k) for k in range(len(lines))],
        )

    def four_wires(self, connect: Connect, voltmeter: ConnectVoltmeter, *, ranged: bool) -> None:
        """Connect the terminals to the supply, fit the voltmeter, and prove both.

        `ranged` tells that the voltmeter has its range, and is to keep it.
        """
        self._bench.perform(connect, voltmeter)
        self._verifier.verify(connect, lambda: self._by_voltmeter(connect, voltmeter, ranged=ranged), voltmeter)

    def probed(self, connect: Connect, voltage: VoltageProbe, current: CurrentProbe) -> None:
        """Fit a voltage and a current probe beside the supply that is connected already, and prove all of it."""
        probes = ConnectProbes((voltage, current))
        self._bench.perform(probes)
        self._verifier.verify(connect, lambda: self._by_probes(connect, voltage, current), probes)

    def seen_leads(self, output: Reading, current: Reading, voltmeter: Reading) -> None:
        """Keep what two- and four-wire voltage of one current show of the supply's leads."""
        drop = supply_evidence.within(output).plus(supply_evidence.within(voltmeter).scaled(-1.0))
        resistance = drop.over(supply_evidence.within(current))
        if resistance is not ANY:
            self._verifier.lines.seen_leads(resistance)

    def _by_harmless_current(self, connect: Connect) -> Check:
        supply = self._bench.supply
        if supply.read_by_hand:
            return Check(WiringOutcome.UNVERIFIED, "supply", reason="by hand")
        with supply.energised(*self._harmless(), Regulated.CURRENT):
            self._bench.clock.sleep(self._verifier.settings.wiring_settle)
            read = self._read()
        return self._judge(connect, read, swinging=not self._bench.state.rotor_locked)

    def _by_voltmeter(self, connect: Connect, action: ConnectVoltmeter, *, ranged: bool) -> Check:
        supply, voltmeter = self._bench.supply, self._bench.voltmeter
        if supply.read_by_hand or voltmeter.read_by_hand:
            return Check(WiringOutcome.UNVERIFIED, "voltmeter", reason="by hand")
        with supply.energised(*self._harmless(), Regulated.CURRENT):
            self._bench.clock.sleep(self._verifier.settings.wiring_settle)
            read = self._read()
            if not ranged:
                voltmeter.configure(max(abs(read.voltage.low), read.voltage.high))
            sensed = sensing_evidence.Sensed(voltage=supply_evidence.within(voltmeter.measure_voltage()))
        return self._judge_leads(connect, sensing_evidence.of_voltmeter(action), read, sensed)

    def _by_probes(self, connect: Connect, voltage: VoltageProbe, current: CurrentProbe) -> Check:
        supply, scope = self._bench.supply, self._bench.oscilloscope
        if supply.read_by_hand or scope.read_by_hand:
            return Check(WiringOutcome.UNVERIFIED, "oscilloscope", reason="by hand")
        volts, amperes = self._harmless()
        with supply.energised(volts, amperes, Regulated.CURRENT):
            self._bench.clock.sleep(self._verifier.settings.wiring_settle)
            read = self._read()
            spans = {
                voltage.channel: _ROOM * read.voltage.high,
                current.channel: _ROOM * max(amperes, read.current.high),
            }
            shown = direct(self._bench, spans)
        self._bench.clock.sleep(self._verifier.settings.wiring_settle)
        zero = again(self._bench, list(spans))
        seen = {channel: risen(zero[channel], wave) for channel, wave in shown.items()}
        sensed = sensing_evidence.Sensed(seen[voltage.channel], seen[current.channel], voltage.channel, current.channel)
        return self._judge_leads(connect, sensing_evidence.of_probes(voltage, current), read, sensed)

    def _judge(self, connect: Connect, read: supply_evidence.SupplyReading, *, swinging: bool) -> Check:
        lines, leads = self._verifier.lines, self._verifier.settings.wiring_leads
        reference = lines.for_supply(self._verifier.known, leads)
        result = supply_evidence.judged(connect, read, reference, leads, swinging=swinging)
        if reference is None and read.path and not swinging:
            lines.suppose("supply", poles_of(connect), read.resistance)
        return result

    def _judge_leads(
        self,
        connect: Connect,
        expected: SensingLeads,
        read: supply_evidence.SupplyReading,
        sensed: sensing_evidence.Sensed,
    ) -> Check:
        leads = self._verifier.settings.wiring_leads
        reference = self._verifier.lines.for_supply(self._verifier.known, leads)
        return sensing_evidence.judged(connect, expected, read, sensed, reference, leads)

    def _read(self) -> supply_evidence.SupplyReading:
        read = supply_evidence.read(self._bench.supply)
        require_resolved(self._verifier.nameplate.rated_current, read.current, text("supply"))
        return read

    def _harmless(self) -> tuple[float, float]:
        """Return the voltage (V) and the current limit (A) that wiring is verified with."""
        supply, plate = self._bench.supply, self._verifier.nameplate
        share = self._verifier.settings.wiring_current_share * plate.rated_current
        highest = supply.maximum_voltage
        return min(highest, plate.rated_voltage or highest), min(share, supply.maximum_current, plate.current_bound)
