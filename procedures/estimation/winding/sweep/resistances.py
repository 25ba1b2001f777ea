"""The resistance that a bridge reads beside the inductance of a sweep: what it says of contacts, and of what is connected."""

from dataclasses import replace

import numpy as np
from scipy import special

from procedures.estimation.fitting.fit import FloatArray
from procedures.estimation.fitting.misfit import NO_MISFIT, Answer, Cause, Finding, Misfit
from procedures.estimation.winding.sweep.jump import clearest_jump
from procedures.estimation.winding.sweep.rotor_sweep import SweepFit

#: Fewer readings show no course of the resistance; a jump is told where chance brings it in this share of sweeps, from this share on.
_LEAST, _CHANCE, _TOLD = 16, 1e-4, 2e-3
#: Of a direct current's resistance a series resistance is no smaller than this share: the winding may have cooled by 50 K.
_COOLED = 0.8


def allowed_for_jump(fit: SweepFit, resistance: FloatArray) -> SweepFit:
    """Return the fit with what a jump of the resistance (Ω, shape (n,), at the readings fitted) tells.

    A contact changes the resistance alone, a meter's range both: by how much the inductance jumps at the same place is in the interval.
    """
    if resistance.size < _LEAST or not np.all(np.isfinite(resistance)):
        return fit
    mean, course = float(np.mean(resistance)), fit.course
    order = np.linspace(-1.0, 1.0, resistance.size)
    # Iron and magnets lose more on one axis than on the other; a winding warms and cools. Once an electrical turn, half the course's
    # pace, comes the rotor's voltage, which a small resistance beside a large reactance shows first.
    waves = [part(k * course) for k in (0.5, 1.0, 2.0) for part in (np.cos, np.sin)]
    design = np.column_stack((np.ones_like(order), order, order**2, *waves))
    jump = clearest_jump(design, resistance)
    share = jump.height / mean if mean else 0.0
    if jump.probability > _CHANCE or abs(share) < _TOLD:
        return fit
    wave = np.column_stack((np.ones_like(order), np.cos(course), np.sin(course)))
    own = jump.column[:, 0] - wave @ np.linalg.lstsq(wave, jump.column[:, 0], rcond=None)[0]
    size = float(own @ own)
    by = abs(float(own @ fit.residuals) / size) + fit.residual_rms / np.sqrt(size)
    covariance = fit.covariance.copy()
    covariance[0, 0] += (0.5 * by) ** 2
    covariance[1, 1] += (0.5 * abs(by / fit.value("mean") * fit.value("amplitude"))) ** 2
    score = float(-special.ndtri(max(0.5 * jump.probability, 1e-300)))
    figures: dict[str, float | str] = {"record": "sweep", "number": float(jump.place + 1), "change": share}
    finding = Finding(Cause.CONTACT, Answer.WIDENED, score=score, figures=figures)
    return replace(fit, covariance=covariance, misfit=Misfit((*fit.misfit.findings, finding)))


def against_direct_current(resistance: FloatArray, limit: float, direct: float, frequency: float) -> Misfit:
    """Return what contradicts a line's resistance by direct current (`direct`, Ω): a series resistance (Ω, shape (n,)) far below it.

    `limit` is the bridge's limit of error (Ω). At a frequency (Hz) iron only adds to the resistance.
    """
    read = float(np.median(resistance))
    if not np.isfinite(read) or read + limit >= _COOLED * direct:
        return NO_MISFIT
    figures: dict[str, float | str] = {"record": "sweep", "read": read, "direct": direct, "frequency": frequency}
    return Misfit((Finding(Cause.RESISTANCES_DIFFER, Answer.WITHHELD, figures=figures),))
