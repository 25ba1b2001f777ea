"""Evaluation of recorded current steps: the loop's inductance with its instruments' errors, and warnings about it (§3.3.1)."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from typing import Any

import numpy as np
from GTC.lib import UncertainReal

from drivers.interfaces import Accuracy
from drivers.interfaces.text import text
from procedures.core.bench import Bench
from procedures.core.curves import curve
from procedures.estimation.fitting.misfit import Misfit
from procedures.estimation.fitting.repeats import mean_of_readings
from procedures.estimation.winding.current_step.repeats import fit_repeats
from procedures.estimation.winding.current_step.response import apparent_inductance, time_constant_63
from procedures.techniques.winding.step_probes import ProbesJudged, SettledSteps, probes_against_supply
from procedures.techniques.winding.step_recording import RecordedStep

#: The other axis carries current too: phases differ by some percent, and friction holds the rotor off d or q by some degrees. As k².
_OTHER_AXIS = 3e-3


@dataclass(frozen=True)
class SteppedLoop:
    """The loop's `inductance` (H), what the records show beyond the model, what stands beside (s, Ω), what they end at, and all findings
    by name.
    """

    inductance: UncertainReal
    misfit: Misfit
    time_constant_63: float
    total_resistance: float
    settled: SettledSteps
    findings: Mapping[str, Any]

    def with_probes(self, bench: Bench, probes: ProbesJudged) -> "SteppedLoop":
        """Return the loop with what was found of its probes afterwards."""
        if not probes.share:
            return self
        # Of each axis by itself: what bends makes one larger and the other smaller.
        name = text("oscilloscope, channel {channel}: gain, against the other axis", channel=probes.channel)
        wider = self.inductance * bench.uncertainties.limit(name, 1.0, probes.share)
        return replace(self, inductance=wider, misfit=Misfit.together((self.misfit, probes.misfit)))


def loop_of_steps(bench: Bench, axis: str, voltage: float, steps: Sequence[RecordedStep]) -> SteppedLoop:
    """Return the loop that repeated steps to a voltage (V) went through. Raises WithheldError where no record gives it."""
    unc, last = bench.uncertainties, steps[-1]
    repeats = fit_repeats([s.reading(_OTHER_AXIS) for s in steps])
    fit = repeats.fits[-1]
    inductance, resistance = (
        unc.statistical(text("step fits of {what}", what=f"{symbol}_{axis}"), *repeats.mean(fitted)[:3])
        for symbol, fitted in (("L", "inductance"), ("R", "resistance"))
    )
    loop = _with_probes(bench, inductance, steps[0])
    # Either channel of a scope may be late by half a sampling interval.
    late = Accuracy(gain=fit.timing, source="as taken")
    loop = unc.instrument("skew of the channels", loop, late)
    probes = probes_against_supply(last.voltage, last.current, last.source, repeats.misfit, float(resistance.x))
    off = Accuracy(gain=probes.share, source="against the supply's readings")
    loop = _read(bench, probes.channel, loop, off)
    settled = SettledSteps.of(last.voltage, last.current, *repeats.mean("resistance")[:2])
    # What a supply's limit ended is not fitted.
    fitted_part = slice(0, fit.residuals.size)
    tau = time_constant_63(last.current.time, last.current.values)
    tail = slice(-len(last.current.values) // 10, None)
    total_resistance = abs(voltage / float(last.current.values[tail].mean()))
    findings = {
        "winding_resistance": float(resistance.x),
        "winding_inductance": float(inductance.x),
        "total_resistance": total_resistance,
        "time_constant": float(inductance.x) / float(resistance.x),
        "time_constant_63": tau,
        "residual_current": fit.residual_rms,
        "fit": curve(
            time=last.current.time[fitted_part],
            fitted=last.current.values[fitted_part] - fit.residuals,
            residual=fit.residuals,
        ),
    }
    misfit = Misfit.together((repeats.misfit, probes.misfit))
    return SteppedLoop(loop, misfit, tau, total_resistance, settled, findings)


def apparent_point(bench: Bench, name: str, steps: Sequence[RecordedStep], factor: float) -> dict[str, float]:
    """Return the current (A) that repeated steps end at, and `factor` times the loop's apparent inductance (H) there, with what scatter
    and instruments leave of it.
    """
    apparent = [apparent_inductance(s.current.time, s.voltage.values, s.current.values) for s in steps]
    value, scatter, freedom = mean_of_readings([factor * a.inductance for a in apparent])
    repeated = bench.uncertainties.statistical(text("steps of {what}", what=name), value, scatter, freedom)
    return {
        "current": float(np.mean([a.current for a in apparent])),
        "inductance": value,
        "standard_uncertainty": float(_with_probes(bench, repeated, steps[-1]).u),
        "repeatability": scatter,
    }


def _with_probes(bench: Bench, quantity: UncertainReal, recorded: RecordedStep) -> UncertainReal:
    """Put on the gains of the voltage and the current channel; their offsets are fitted."""
    for wave in (recorded.voltage, recorded.current):
        gain = Accuracy(gain=wave.accuracy.gain, source=wave.accuracy.source)
        quantity = _read(bench, wave.channel, quantity, gain)
    return quantity


def _read(bench: Bench, channel: int, quantity: UncertainReal, accuracy: Accuracy) -> UncertainReal:
    name = text("oscilloscope, channel {channel}", channel=channel)
    return bench.uncertainties.instrument(name, quantity, accuracy)
