"""Reported figures of a short circuit over speed, and contradictions between them or with earlier results."""

import math
from collections.abc import Sequence
from typing import Any

import numpy as np
from GTC.lib import UncertainReal

from drivers.interfaces import Accuracy
from drivers.interfaces.text import text
from procedures.core.procedure import Procedure
from procedures.estimation.fitting.misfit import NO_MISFIT, Answer, Cause, Finding, Misfit
from procedures.estimation.winding.resistance import at_temperature
from procedures.estimation.winding.short_circuit import D_INDUCTANCE, RESISTANCE, SALIENCY, current, d_axis_current
from procedures.maps.magnets import coefficient_between
from procedures.maps.short_points import FittedSweep, OpenBefore, ShortSweep
from procedures.maps.turned_points import line, torque_gain
from procedures.techniques.temperature.correction import magnet_factor, warmed
from procedures.techniques.temperature.settings import COLD

_RPM = math.pi / 30.0
#: Share of λ/L_d that the d-axis current must have reached for λ/L_d to be a measured figure.
_REACHED = 0.85
#: Currents that leave more than this (relative, rms) of the law of constant inductances are said to.
_LEFT = 0.01
#: An inductance that is known no better than this (relative standard uncertainty) is none.
_UNKNOWN = 0.25
#: Currents that leave more than this are none of a motor in a short circuit, and tell no inductance.
_NONE_LEFT = 0.02
#: So much wider is a limit whose 95 % interval reaches what it is for.
_HELD = 1.1
CHORD, CURRENT = "d_axis_chord_inductance", "short_circuit_current"


class ShortResults:
    """Reports for a procedure what its sweeps and their fits tell."""

    def __init__(
        self, procedure: Procedure[Any], before: OpenBefore, sweeps: Sequence[ShortSweep], fitted: Sequence[FittedSweep]
    ) -> None:
        self._procedure, self._before, self._sweeps, self._fitted = procedure, before, sweeps, fitted
        self._unc, self._settings = procedure.bench.uncertainties, procedure.settings
        sweep = sweeps[0]
        self._voltage = self._gain("oscilloscope, voltage channels", before.emf.accuracies[0])
        self._current = self._gain("oscilloscope, current channel", sweep.points[0].current.accuracies[0])
        unlike = self._settings.unbalance if sweep.shares is None else 0.5 * abs(sweep.shares[1] - sweep.shares[0])
        self._current = self._current * self._unc.limit(
            "mean of the phases' currents against the one probed", 1.0, unlike
        )
        self._torque = torque_gain(
            self._unc, sweep.points[0].torque.torque_accuracy, float(np.max(np.abs(fitted[0].braking)))
        )
        self._flux = self._voltage * self._unc.statistical(
            "EMF over electrical speed",
            before.emf.flux.value,
            before.emf.flux.uncertainty,
            before.emf.flux.degrees_of_freedom,
        )

    def report(self) -> None:
        """Report resistance, inductance, current and peak; alarm what contradicts."""
        sweep, fit = self._sweeps[0], self._fitted[0]
        self._keep()
        by_torque, by_current = self._resistances(fit)
        apart = self._contradiction(by_torque, by_current)
        self._report_resistance(self._held_apart(by_torque, apart), sweep, fit)
        inductance = self._unc.statistical(
            "currents over speed: d-axis inductance",
            fit.currents.value(D_INDUCTANCE),
            fit.currents.uncertainty(D_INDUCTANCE),
            fit.currents.degrees_of_freedom,
        )
        self._report_inductance(inductance, sweep, fit, abs(apart))
        self._report_peak(fit, sweep)
        if len(self._sweeps) > 1:
            self._report_coefficient()

    def _gain(self, name: str, accuracy: Accuracy) -> UncertainReal:
        return self._unc.instrument(name, 1.0, Accuracy(gain=accuracy.gain, source=accuracy.source))

    def _resistances(self, fit: FittedSweep) -> tuple[UncertainReal, UncertainReal]:
        """Return the resistance (Ω) by the torque and by the currents, as warm as it was."""
        torque, currents = fit.torque, fit.currents
        by_torque = self._unc.statistical(
            "braking torque over 1.5·p·I²/ω", torque.resistance, torque.uncertainty, torque.degrees_of_freedom
        )
        by_torque = by_torque * self._torque / self._current**2
        by_torque = by_torque + self._unc.one_sided(
            "iron loss of the open circuit that the short circuit does not have", 0.0, fit.floor
        )
        by_current = self._unc.statistical(
            "currents over speed: resistance",
            currents.value(RESISTANCE),
            currents.uncertainty(RESISTANCE),
            currents.degrees_of_freedom,
        )
        return by_torque, by_current * self._flux / float(self._flux.x) / self._current

    def _held_apart(self, by_torque: UncertainReal, apart: float) -> UncertainReal:
        """Return the torque's resistance as far off as a wrong factor of the current, which counts twice in it, makes both `apart`."""
        source = text("resistances by torque and by currents")
        if apart < 0.0:
            return by_torque * (1.0 + self._unc.one_sided(source, 0.0, math.expm1(-2.0 * apart)))
        return by_torque * (1.0 - self._unc.one_sided(source, 0.0, -math.expm1(-2.0 * apart)))

    def _contradiction(self, by_torque: UncertainReal, by_current: UncertainReal) -> float:
        """Alarm where the two resistances are not one; of constants they would be, and so would both flux linkages.

        Return the logarithm of their ratio, as far as it is beyond one standard uncertainty.
        """
        ratio = by_torque / by_current
        low, high = self._unc.interval(ratio)
        self._procedure.findings["resistance_ratio"] = {
            "by_torque": float(by_torque.x),
            "by_current": float(by_current.x),
            "ratio": float(ratio.x),
            "low": low,
            "high": high,
            "flux_open": float(self._flux.x),
            "flux_short": float((self._flux * ratio).x),
        }
        off, known = math.log(float(ratio.x)), float(ratio.u) / float(ratio.x)
        # The share of its square that the standard uncertainty does not have.
        apart = off * max(1.0 - (known / off) ** 2, 0.0) if off else 0.0
        self._procedure.findings["resistance_ratio"]["apart"] = apart
        if low <= 1.0 <= high:
            return apart
        values = {
            "torque": float(by_torque.x),
            "current": float(by_current.x),
            "ratio": float(ratio.x),
            "flux": float((self._flux * ratio).x),
            "open": float(self._flux.x),
            "gain": float(1.0 / ratio.x) - 1.0,
        }
        if float(ratio.x) > 1.0:
            self._procedure.notice(
                "short-circuit-resistance",
                text(
                    "the power of the braking torque gives {torque:.4g} Ω, the currents give {current:.4g} Ω with "
                    "the flux linkage of the open circuit: a ratio of {ratio:.3f} (with the torque's value, λ "
                    "would be {flux:.4g} V·s, not {open:.4g}). Saturation of L_q makes the currents' value too "
                    "small; iron loss in the short circuit, or a current that is shown {gain:+.1%} off, makes the torque's value too "
                    "large. The torque's value is reported, not a mean, and its interval holds a wrong factor of the current probe",
                    **values,
                ),
            )
        else:
            self._procedure.notice(
                "short-circuit-resistance",
                text(
                    "the power of the braking torque gives {torque:.4g} Ω, the currents give {current:.4g} Ω with "
                    "the flux linkage of the open circuit: a ratio of {ratio:.3f} (with the torque's value, λ "
                    "would be {flux:.4g} V·s, not {open:.4g}). Likely causes: a current that is shown {gain:+.1%} off (verify the probe, "
                    "or run probe-verification); a slow filter of the torque (state it, or raise settle); a voltage drop in the short "
                    "circuit that does not grow with the current, as in switches and worn contacts (join the terminals by clean links). "
                    "The intervals hold the first two",
                    **values,
                ),
            )
        return apart

    def _report_resistance(self, by_torque: UncertainReal, sweep: ShortSweep, fit: FittedSweep) -> None:
        settings = self._settings
        warm = float(sweep.temperature.x)
        kelvin = warmed(warm, max(sweep.rise, 0.0), settings.coefficient, settings.coefficient_reference) - warm
        # What warmed on the way was warm at the last points only.
        mean = sweep.temperature + self._unc.limit("warming by the short-circuit current", 0.5 * kelvin, 0.5 * kelvin)
        self._procedure.findings["rise"] = {"relative": sweep.rise, "kelvin": kelvin}
        cold = at_temperature(by_torque, mean, COLD, settings.coefficient, settings.coefficient_reference)
        known = self._procedure.known.get("stator_resistance")
        if known is not None:
            self._beside_winding(cold, self._unc.of_parameter(known))
        self._procedure.report(
            "short_circuit_resistance",
            cold,
            section=self._procedure.section,
            estimator="braking power over 1.5·I², the drag with open terminals subtracted",
            misfit=sweep.zero.misfit(float(np.max(np.abs(fit.braking)))).of("short_circuit_resistance"),
        )

    def _beside_winding(self, cold: UncertainReal, winding: UncertainReal) -> None:
        """Hold the short's resistance against the winding's own: leads and link are the difference, which cannot be less than none."""
        beyond = cold - winding
        low, high = self._unc.interval(beyond)
        self._procedure.findings["leads_and_link"] = {"value": float(beyond.x), "low": low, "high": high}
        if high < 0.0:
            self._procedure.notice(
                "short-circuit-resistance",
                text(
                    "the short circuit shows {short:.4g} Ω per phase, less than the winding's own {winding:.4g} "
                    "Ω: check the current probe's factor, the torque's zero, and the pole pairs",
                    short=float(cold.x),
                    winding=float(winding.x),
                ),
            )

    def _report_inductance(self, fitted: UncertainReal, sweep: ShortSweep, fit: FittedSweep, apart: float) -> None:
        settings, procedure = self._settings, self._procedure
        chord = fitted * self._flux / float(self._flux.x) / self._current
        chord = chord * (1.0 + self._unc.limit("resistances by torque and by currents", 0.0, _HELD * math.expm1(apart)))
        size, asymptote, reached = self._reached(sweep, fit)
        procedure.findings["d_axis_current"] = {"largest": -size, "asymptote": -asymptote, "share": reached}
        if float(chord.u) > _UNKNOWN * float(chord.x):
            procedure.notice(
                "short-circuit-reach",
                text(
                    "the d-axis current reached {size:.3g} A of about {asymptote:.3g} A, where the currents "
                    "hardly depend on the inductance: it is not given{why}",
                    size=size,
                    asymptote=asymptote,
                    why=self._why(sweep),
                ),
            )
            return
        if fit.currents.residual_rms > _LEFT:
            procedure.notice(
                "short-circuit-shape",
                text(
                    "the currents deviate by {left:.1%} rms from the curve of constant inductances: saturation, "
                    "or a contact that changes; check their residual",
                    left=fit.currents.residual_rms,
                ),
            )
        left = fit.currents.residual_rms
        bent = Misfit(
            (
                Finding(
                    Cause.UNEXPLAINED,
                    Answer.WITHHELD,
                    (CHORD, CURRENT),
                    figures={"record": "short-circuit", "left": left},
                ),
            )
        )
        bent = bent if left > _NONE_LEFT else NO_MISFIT
        given = procedure.report(
            CHORD,
            chord,
            section=procedure.section,
            estimator="short-circuit currents over speed with the open circuit's flux linkage",
            misfit=Misfit.together(
                [bent.of(CHORD), *(each.current.misfit.of("flux_linkage", CHORD) for each in sweep.points)]
            ),
        )
        if given is None:
            return
        if reached < _REACHED:
            procedure.notice(
                "short-circuit-reach",
                text(
                    "the d-axis current reached {size:.3g} A of about {asymptote:.3g} A: λ/L_d would be "
                    "extrapolated, not measured, and is not given{why}",
                    size=size,
                    asymptote=asymptote,
                    why=self._why(sweep),
                ),
            )
            return
        # The flux linkage's gain is in both and cancels: what is left is the current's own.
        cold = magnet_factor(
            self._unc, sweep.temperature, settings.magnet_coefficient, settings.magnet_coefficient_uncertainty
        )
        procedure.report(
            CURRENT,
            self._flux / chord * cold,
            section=procedure.section,
            estimator="short-circuit currents over speed, extrapolated to zero resistance",
        )

    @staticmethod
    def _why(sweep: ShortSweep) -> object:
        match sweep.stopped:
            case "current":
                return text("; the motor's largest current ended it")
            case "torque":
                return text("; the dynamometer's torque ended it")
        return ""

    def _reached(self, sweep: ShortSweep, fit: FittedSweep) -> tuple[float, float, float]:
        r, ld, xi = (fit.currents.value(name) for name in (RESISTANCE, D_INDUCTANCE, SALIENCY))
        flux = float(self._flux.x)
        size = float(-np.min(d_axis_current(sweep.electrical, r, ld, ld * xi, flux)))
        asymptote = flux / ld
        return size, asymptote, size / asymptote

    def _report_peak(self, fit: FittedSweep, sweep: ShortSweep) -> None:
        procedure = self._procedure
        if fit.torque.peak is None:
            procedure.notice(
                "short-circuit-peak",
                text(
                    "no speed lies beyond the largest braking torque, so that it is not given{why}",
                    why=self._why(sweep),
                ),
            )
            return
        (size, speed), (u_size, u_speed) = fit.torque.peak, fit.torque.peak_uncertainties
        freedom = fit.currents.degrees_of_freedom
        procedure.report(
            "peak_braking_torque",
            self._torque * self._unc.statistical("braking torques near their peak", size, u_size, freedom),
            section=procedure.section,
            estimator="curve by the fit of the currents, size by the torques near the peak",
        )
        procedure.report(
            "peak_braking_speed",
            self._unc.statistical("speed of the peak", speed, u_speed, freedom) / (self._before.pole_pairs * _RPM),
            section=procedure.section,
            estimator="R, L_d and L_q of the currents' fit",
        )

    def _report_coefficient(self) -> None:
        """Report what the flux linkage loses by warmth: with one L_d, the current at high speed falls as it does."""
        cold, warm = self._sweeps
        sizes = [
            self._unc.statistical(
                text("current at high speed at {temperature:.0f} °C", temperature=float(sweep.temperature.x)),
                1.0 / fit.currents.value(D_INDUCTANCE),
                fit.currents.uncertainty(D_INDUCTANCE) / fit.currents.value(D_INDUCTANCE) ** 2,
                fit.currents.degrees_of_freedom,
            )
            for sweep, fit in zip(self._sweeps, self._fitted, strict=True)
        ]
        coefficient = coefficient_between(
            self._procedure, sizes, (cold.temperature, warm.temperature), self._settings.magnet_lag
        )
        if coefficient is not None:
            self._procedure.report(
                "flux_temperature_coefficient",
                coefficient,
                section=self._procedure.section,
                estimator="short-circuit current at high speed, at two temperatures of the winding",
            )

    def _keep(self) -> None:
        """Keep what was read and fitted, for whoever draws it."""
        flux, rows = float(self._flux.x), []
        for sweep, fit in zip(self._sweeps, self._fitted, strict=True):
            r, ld, xi = (fit.currents.value(name) for name in (RESISTANCE, D_INDUCTANCE, SALIENCY))
            fine = np.geomspace(sweep.electrical[0], sweep.electrical[-1], 200)
            course = current(fine, r, ld, ld * xi, flux)
            rows.append(
                {
                    "winding_temperature": float(sweep.temperature.x),
                    "speed": line(sweep.electrical / self._before.pole_pairs),
                    "current": line(sweep.amplitudes),
                    "torque": line(fit.braking),
                    "current_residual": line(fit.currents.residuals),
                    "torque_residual": line(fit.torque.residuals),
                    "fit": {
                        "speed": line(fine / self._before.pole_pairs),
                        "current": line(course),
                        "torque": line(1.5 * self._before.pole_pairs * fit.torque.resistance * course**2 / fine),
                    },
                    "resistance": r,
                    "d_axis_inductance": ld,
                    "saliency": xi,
                    "saliency_uncertainty": fit.currents.uncertainty(SALIENCY),
                    "together": _together(fit),
                    "stopped": sweep.stopped,
                    "shares": None if sweep.shares is None else list(sweep.shares),
                    "copper_loss": line(1.5 * fit.torque.resistance * sweep.amplitudes**2),
                    "drag_loss": line(
                        [self._before.drag_at(w)[0] * w for w in sweep.electrical / self._before.pole_pairs]
                    ),
                }
            )
        self._procedure.findings |= {
            "sweeps": rows,
            "pole_pairs": self._before.pole_pairs,
            "open_circuit": {
                "speed": line([each.speed for each in self._before.drags]),
                "torque": line(self._before.torques()),
                "flux_linkage": flux,
            },
        }


def _together(fit: FittedSweep) -> dict[str, Any]:
    """Return what both at once give, with saturation and a drop in the model: resistance (Ω) and drop (V), each with its uncertainty.

    Nothing where they do not tell these apart.
    """
    if fit.together is None:
        return {}
    named = {"resistance": fit.together.resistance, "drop": fit.together.drop}
    return {
        name: None if figure is None else [figure.value, figure.standard_uncertainty] for name, figure in named.items()
    }
