"""Connections to an inverter, verified by a harmless current; those to a six-step drive, which knows full voltage only."""

import math
from collections.abc import Callable

import numpy as np

from drivers.interfaces import ReportedError, Waveform
from drivers.interfaces.text import Text, text
from procedures.core.actions import Connect, ConnectProbes, CurrentProbe, Wanted
from procedures.core.bench import Role
from procedures.estimation.emf.probed_phases import LEAST_STEPS
from procedures.estimation.fitting.fit import Fit
from procedures.estimation.winding.wiring import Kind, WiringOutcome
from procedures.techniques.shaft.driven_shaft import driving_speed_rad
from procedures.techniques.steady_signals import alternating
from procedures.verification.check import Check, without_current
from procedures.verification.verifier import VerifiedWiring

#: Frequency (Hz) of a harmless rotating field, the time (s) until it has settled, and the periods recorded.
_FREQUENCY, _SETTLE, _PERIODS = 10.0, 0.1, 3.0
#: What a probe shows of the current commanded: within the first it is that, below the second it is none.
_SAME, _NONE = (0.6, 1.5), 0.2
#: Torque readings in each direction of the current, the time (s) between them, and by how many scatters two means must differ.
_READINGS, _INTERVAL, _CLEAR = 4, 0.05, 4.0
#: After so long (s) a torque transducer's filter has forgotten what was before.
_FORGOTTEN = 2.0
#: A line's rms current over a six-step drive's bus current is 0.82; below this there is no probe round it.
_NO_LINE = 0.3


class InverterWiring(VerifiedWiring):
    """Connections to the inverter or the six-step drive."""

    def probed(self, connect: Connect, probe: CurrentProbe, *beside: Wanted) -> None:
        """Connect the inverter and a current probe, with what else is wanted of the setup.

        Both are proved with a harmless current in a slowly turning field.
        """
        probes = ConnectProbes((probe,))
        self._bench.perform(connect, probes, *beside)
        self._verifier.verify(connect, lambda: self._by_probe(probe), probes)

    def direction(self, connect: Connect) -> None:
        """Prove the order of the phases of an inverter that is connected, by the torque of a harmless current on a turned shaft."""
        self._verifier.verify(connect, self._by_torque)

    def judge_slope(self, connect: Connect, fit: Fit) -> None:
        """Refuse a torque (N·m) that falls as the inverter's current (A) rises, clearly."""
        slope, uncertainty = fit.value("torque_constant"), fit.uncertainty("torque_constant")
        if slope < -_CLEAR * uncertainty:
            self._verifier.verify(connect, lambda: _against(slope))

    def full_voltage(self, connect: Connect, probe: CurrentProbe, start: Callable[[], object]) -> None:
        """Connect a drive that knows full voltage only, and a current probe; `start` it, which its own protections may refuse."""
        probes = ConnectProbes((probe,))
        self._bench.perform(connect, probes)

        def check() -> Check:
            start()
            return Check(WiringOutcome.UNVERIFIED, Role.DRIVE.value, reason="full voltage")

        self._verifier.verify(connect, lambda: _unless_refused(Role.DRIVE, check), probes)

    def running(self, connect: Connect, probe: CurrentProbe, wave: Waveform, bus: float) -> None:
        """Prove a current probe on a running six-step drive by the current (A) out of its source."""
        line = float(np.sqrt(np.mean(np.square(wave.values))))
        readings = {"sensed_current": line, "current": bus}
        check = Check(WiringOutcome.VERIFIED, Role.OSCILLOSCOPE.value, read=readings)
        if line < _NO_LINE * bus:
            evidence = text(
                "the drive takes {bus:.3g} A, channel {channel} shows {line:.3g} A",
                bus=bus,
                channel=probe.channel,
                line=line,
            )
            check = Check(
                WiringOutcome.WRONG,
                Role.OSCILLOSCOPE.value,
                (without_current(probe),),
                readings,
                "",
                evidence,
                correctable_now=False,
            )
        self._verifier.verify(connect, lambda: check, ConnectProbes((probe,)))

    def _by_probe(self, probe: CurrentProbe) -> Check:
        bench = self._bench
        if bench.inverter.read_by_hand or bench.oscilloscope.read_by_hand:
            return Check(WiringOutcome.UNVERIFIED, Role.INVERTER.value, reason="by hand")
        level = self._harmless()

        def shown() -> float:
            frequency = min(_FREQUENCY, bench.inverter.maximum_frequency)
            with bench.inverter.driving_frequency(frequency, level):
                bench.clock.sleep(_SETTLE)
                wave = alternating(bench, [probe.channel], 1.5 * level, _PERIODS / frequency)[probe.channel]
            if level < LEAST_STEPS * wave.resolution:
                return math.nan
            return math.sqrt(2.0) * float(np.std(wave.values))

        return _unless_refused(Role.INVERTER, lambda: _probe_judged(probe, shown(), level))

    def _by_torque(self) -> Check:
        bench = self._bench
        if bench.inverter.read_by_hand or bench.dynamometer.read_by_hand:
            return Check(WiringOutcome.UNVERIFIED, Role.DYNAMOMETER.value, reason="by hand")
        speed = driving_speed_rad(bench, self._verifier.nameplate, self._verifier.settings.wiring_speed_share)
        level = self._harmless()

        def torques(pause: float = 0.0) -> np.ndarray:
            bench.clock.sleep(pause)
            read = []
            for _ in range(_READINGS):
                bench.clock.sleep(_INTERVAL)
                read.append(-bench.dynamometer.measure().torque)
            return np.array(read)

        def judged() -> Check:
            with bench.dynamometer.driving_speed(speed), bench.inverter.driving_current(level):
                forwards = torques()
                bench.inverter.set_current(-level)
                backwards = torques()
                if np.mean(forwards) < np.mean(backwards):
                    # Behind a slow filter the run-up is still in what was read first: what is wrong is so afterwards too.
                    backwards = torques(_FORGOTTEN)
                    bench.inverter.set_current(level)
                    forwards = torques(_FORGOTTEN)
            return _torque_judged(forwards, backwards, level, bench.dynamometer.measure().torque_accuracy.resolution)

        result = _unless_refused(Role.INVERTER, judged)
        if result.outcome is WiringOutcome.WRONG:
            # Hands are going to mend it.
            bench.dynamometer.stop()
        return result

    def _harmless(self) -> float:
        plate = self._verifier.nameplate
        share = self._verifier.settings.wiring_current_share * plate.rated_current
        return min(share, self._bench.inverter.maximum_current, plate.current_bound)


def _unless_refused(role: Role, judged: Callable[[], Check]) -> Check:
    """Return what was found, or that the instrument that feeds the motor switched itself off."""
    try:
        return judged()
    except ReportedError as error:
        if error.instrument != role.value:
            raise
        message = text("it reports: {what}", what=error.what)
        return Check(WiringOutcome.WRONG, role.value, ({"kind": "refused", "by": role.value},), evidence=message)


def _probe_judged(probe: CurrentProbe, shown: float, level: float) -> Check:
    if math.isnan(shown):
        return Check(WiringOutcome.UNVERIFIED, Role.OSCILLOSCOPE.value, reason="weak")
    readings = {"sensed_current": shown, "current": level}
    evidence: Text = text(
        "channel {channel} shows {shown:.3g} A, the inverter drives {level:.3g} A",
        channel=probe.channel,
        shown=shown,
        level=level,
    )
    if shown < _NONE * level:
        open_wire = {"kind": Kind.OPEN.value, "terminals": [probe.terminal.value]}
        return Check(
            WiringOutcome.WRONG, Role.OSCILLOSCOPE.value, (without_current(probe), open_wire), readings, "", evidence
        )
    if _SAME[0] * level <= shown <= _SAME[1] * level:
        return Check(WiringOutcome.UNVERIFIED, Role.OSCILLOSCOPE.value, read=readings, reason="one line")
    return Check(WiringOutcome.UNEXPLAINED, Role.OSCILLOSCOPE.value, read=readings, evidence=evidence)


def _torque_judged(forwards: np.ndarray, backwards: np.ndarray, level: float, resolution: float) -> Check:
    difference = float(np.mean(forwards) - np.mean(backwards))
    scatter = float(np.hypot(np.std(forwards, ddof=1), np.std(backwards, ddof=1)) / math.sqrt(_READINGS)) + resolution
    readings = {"torque": 0.5 * difference, "current": level}
    if abs(difference) < _CLEAR * scatter:
        return Check(WiringOutcome.UNVERIFIED, Role.DYNAMOMETER.value, read=readings, reason="weak")
    if difference > 0.0:
        return Check(WiringOutcome.VERIFIED, Role.DYNAMOMETER.value, read=readings)
    return _against(0.5 * difference / level, readings)


def _against(slope: float, readings: dict[str, float] | None = None) -> Check:
    evidence = text("the torque falls by {slope:.3g} N·m for each additional ampere", slope=abs(slope))
    return Check(
        WiringOutcome.WRONG,
        Role.DYNAMOMETER.value,
        ({"kind": "order"},),
        readings or {"torque_constant": slope},
        "",
        evidence,
        correctable_now=readings is not None,
    )
