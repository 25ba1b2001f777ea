"""Back-EMF captures: fundamental, harmonics, flux linkage, speed constants (§3.4)."""

import math
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any, Literal

import numpy as np
from GTC.lib import UncertainReal

from bench.analysis.applied import Applied
from bench.analysis.outcome import AnalysisOutcome, estimated, named, paths_of
from bench.analysis.statements import Statement
from bench.analysis.temperature import Temperature
from bench.captures import Capture, CaptureError, read_captures
from drivers.interfaces.text import text, text_of
from procedures.estimation.emf.back_emf import (
    BackEmfFit,
    fit_back_emf,
    line_to_phase,
)
from procedures.estimation.emf.integrated_flux import FluxEstimate, flux_by_integration
from procedures.estimation.emf.period import peak_amplitude, peak_to_peak
from procedures.estimation.mechanics.pole_pairs import from_frequency
from procedures.techniques.temperature_correction import MAGNET_SPREAD, magnet_factor

ProbeConnection = Literal["line", "phase"]
_PROBES = {
    "line": "voltages taken as measured between two lines: phase amplitude = line amplitude / √3",
    "phase": "voltages taken as measured from line to (artificial) star point",
}
#: By whether the speed drifts.
_ESTIMATORS = {True: "voltage integrated over whole periods", False: "least squares of all channels together"}


def analyze_back_emf(
    files: str | Path | Sequence[str | Path],
    *,
    connection: ProbeConnection = "line",
    pole_pairs: int | None = None,
    scale: Mapping[str, float] | None = None,
    speed_rpm: float | None = None,
    speed_uncertainty_rpm: float | None = None,
    harmonics: Sequence[int] = (1, 3, 5, 7),
    accuracy: Sequence[Statement] = (),
    temperature: Temperature | None = None,
) -> dict[str, Any]:
    """Return frequency, fundamental, harmonics, phases, drift and flux linkage of a recorded back-EMF (one or more files).

    `connection` says where the probes were; `scale` multiplies channels, by name; with `pole_pairs`, or `speed_rpm` (rpm,
    mechanical; its uncertainty is taken as 0.5 % where not given) to find them, mechanical constants are added. Under a
    drifting speed the flux comes from the integrated voltage. `accuracy` states the errors of voltages and time base; with
    `temperature` flux and constants are referred to 25 °C by the magnets' coefficient. Raises CaptureError
    naming file and line.
    """
    if connection not in _PROBES:
        raise CaptureError(
            "connection", text("'{connection}' is not known; it is 'line' or 'phase'", connection=connection)
        )
    if pole_pairs is not None and pole_pairs < 1:
        raise CaptureError("pole_pairs", text("{pole_pairs} is below 1", pole_pairs=pole_pairs))
    capture = read_captures(paths_of(files)).evenly_sampled().scaled(named(scale))
    for channel in capture.channels:
        if channel.unit not in ("V", ""):
            raise CaptureError(
                capture.source,
                text(
                    "channel {name} is in {unit}; a back-EMF needs voltages only", name=channel.name, unit=channel.unit
                ),
            )
    names = [channel.name for channel in capture.channels]
    applied = Applied(accuracy, {"voltage": names, "time": ("time",)}, (capture,))
    values = np.vstack([channel.values for channel in capture.channels])
    steps = [channel.resolution for channel in capture.channels]
    time = capture.times()
    fit = estimated(capture, lambda: fit_back_emf(time, values, harmonics=harmonics, resolution=steps))
    flux = estimated(capture, lambda: flux_by_integration(time, values, harmonics=harmonics, frequency=fit.frequency))
    outcome = AnalysisOutcome("back_emf_constant", "3.4", capture, applied)
    outcome.assume(_PROBES[connection])
    factor = line_to_phase(1.0) if connection == "line" else 1.0
    _warnings(outcome, capture, fit, flux)
    pole_pairs = _pole_pairs(outcome, fit, pole_pairs, speed_rpm, speed_uncertainty_rpm)
    drifting = fit.drift_significant
    quantity = _flux_linkage(outcome, names, fit, flux, factor)
    if any(applied.offset("voltage", name) for name in names):
        outcome.assume("offsets of the voltage channels are fitted along: they do not reach the flux linkage")
    if temperature is None:
        outcome.assume("flux linkage as at the record's temperature, which is not given: not referred to 25 °C")
    else:
        known = outcome.uncertainties.limit("magnet temperature", temperature.celsius, temperature.half_width)
        quantity = quantity * magnet_factor(outcome.uncertainties, known, temperature.coefficient)
        outcome.assume(
            f"magnets at {temperature.celsius:g} °C ± {temperature.half_width:g} K with {temperature.coefficient:g} 1/K "
            f"± {MAGNET_SPREAD:.0%}: flux linkage and what follows from it referred to 25 °C; channels and details as recorded"
        )
        outcome.detail(magnet_temperature=temperature.celsius)
    frequency = outcome.uncertainties.statistical(
        "fit of the frequency", fit.frequency, fit.frequency_uncertainty, fit.degrees_of_freedom
    )
    outcome.parameter(
        "electrical_frequency",
        outcome.with_errors(frequency, "time", "time", gain=-1.0),
        estimator="least squares",
    )
    _constants(outcome, quantity, fit, pole_pairs, drifting=drifting, cold=temperature is not None)
    _details(outcome, capture, values, fit, flux, factor)
    return outcome.as_dict()


def _unequal(sizes: np.ndarray[Any, np.dtype[np.float64]]) -> bool:
    return bool(np.max(sizes) > 1.1 * np.min(sizes))


def _warnings(outcome: AnalysisOutcome, capture: Capture, fit: BackEmfFit, flux: FluxEstimate) -> None:
    if fit.drift_significant:
        outcome.warn(
            f"the speed drifts by {100 * fit.drift:+.2f} % over the record (u = {100 * fit.drift_uncertainty:.2f} %); the flux "
            "linkage is that of the voltage integrated over whole periods, which does not depend on it"
        )
    if _unequal(flux.values):
        told = ", ".join(f"{c.name} {v:.4g} V·s" for c, v in zip(capture.channels, flux.values, strict=True))
        outcome.warn(
            f"channels differ by more than 10 % ({told}): check the probes' settings; give --scale where one is off"
        )
    if len(capture.channels) == 3:
        first, second = (float(np.degrees(fit.phases[k])) for k in (1, 2))
        if not (abs(abs(first) - 120) < 3 and abs(abs(second) - 120) < 3 and first * second < 0):
            outcome.warn(
                f"the phases lie at {first:.1f}° and {second:.1f}° instead of ±120°: check where the probes are"
            )


def _pole_pairs(
    outcome: AnalysisOutcome, fit: BackEmfFit, given: int | None, speed_rpm: float | None, u_speed: float | None
) -> int | None:
    """Return the pole pairs given, or found from the speed, as a parameter where they were found."""
    if speed_rpm is None:
        return given
    if u_speed is None:
        u_speed = 0.005 * abs(speed_rpm)
        outcome.assume("speed taken as known to 0.5 %")
    try:
        count = from_frequency(fit.frequency, speed_rpm, fit.frequency_uncertainty, u_speed)
    except ValueError as error:
        raise CaptureError("speed_rpm", text_of(error)) from error
    outcome.detail(frequency_ratio=count.ratio)
    if given is not None and given != count.pole_pairs:
        outcome.warn(
            f"{given} pole pairs were given, but frequency and speed give {count.ratio:.3f}; the given ones are used"
        )
        return given
    if not count.certain or abs(count.ratio - count.pole_pairs) > 0.2:
        outcome.warn(
            f"frequency and speed give {count.ratio:.3f} pole pairs: not certain which integer; measure the speed better"
        )
    if given is None:
        outcome.parameter("pole_pairs", outcome.uncertainties.limit("", count.pole_pairs, 0.0), certain=count.certain)
    return count.pole_pairs


def _flux_linkage(
    outcome: AnalysisOutcome, names: Sequence[str], fit: BackEmfFit, flux: FluxEstimate, factor: float
) -> UncertainReal:
    """Return the mean flux linkage with the channels' errors; the choice between the two estimators is the drift's."""
    integrated, fitted = flux.mean(), fit.mean_flux_linkage()
    outcome.detail(
        flux_linkage_least_squares={"value": factor * fitted[0], "standard_uncertainty": factor * fitted[1]},
        flux_linkage_integrated={"value": factor * integrated[0], "standard_uncertainty": factor * integrated[1]},
    )
    if fit.drift_significant:
        (value, uncertainty), freedom = integrated, flux.degrees_of_freedom
        parts = flux.values
    else:
        (value, uncertainty), freedom = fitted, fit.degrees_of_freedom
        parts = np.abs(fit.amplitudes[:, fit.harmonics.index(1)])
    mean = outcome.uncertainties.statistical(_ESTIMATORS[fit.drift_significant], value, uncertainty, freedom)
    for name, part in zip(names, parts, strict=True):
        mean = outcome.with_errors(mean, "voltage", name, gain=float(part / np.sum(parts)))
    return factor * outcome.with_errors(mean, "time", "time", gain=1.0)


def _constants(
    outcome: AnalysisOutcome,
    flux: UncertainReal,
    fit: BackEmfFit,
    pole_pairs: int | None,
    *,
    drifting: bool,
    cold: bool,
) -> None:
    """Add flux linkage and what follows from it."""
    how = _ESTIMATORS[drifting]
    at = ", at 25 °C" if cold else ""
    phase = "peak, per phase of the Y-equivalent"
    outcome.parameter("flux_linkage", flux, estimator=how, convention=f"{phase}, per electrical radian{at}")
    if pole_pairs is None:
        outcome.assume("pole pairs not given: mechanical constants left out")
        return
    outcome.assume(f"{pole_pairs} pole pairs")
    mechanical = {
        "back_emf_constant_mechanical": (pole_pairs, f"{phase}, per mechanical radian{at}"),
        "torque_constant": (1.5 * pole_pairs, f"per peak phase ampere of the Y-equivalent{at}"),
    }
    for name, (times, convention) in mechanical.items():
        outcome.parameter(name, times * flux, estimator=how, convention=convention)
    outcome.detail(
        mechanical_speed_rpm=60 * fit.frequency / pole_pairs,
        back_emf_constant_per_krpm={
            "value": float(flux.x) * pole_pairs * 1000 * math.pi / 30,
            "unit": "V/krpm, phase, peak",
        },
    )
    outcome.warn(
        "flux_linkage is V·s per electrical radian, back_emf_constant_mechanical V·s per mechanical radian: "
        f"they differ by the {pole_pairs} pole pairs",
        "E4",
    )


def _details(
    outcome: AnalysisOutcome,
    capture: Capture,
    values: np.ndarray[Any, np.dtype[np.float64]],
    fit: BackEmfFit,
    flux: FluxEstimate,
    factor: float,
) -> None:
    first = fit.harmonics.index(1)
    channels = {}
    for k, channel in enumerate(capture.channels):
        size, u_size = fit.fundamental(k)
        channels[channel.name] = {
            "fundamental": {"value": size, "unit": "V", "standard_uncertainty": u_size},
            "phase_degrees": {
                "value": float(np.degrees(fit.phases[k])),
                "standard_uncertainty": float(np.degrees(fit.phase_uncertainties[k])),
            },
            "harmonics_percent": {
                str(order): float(100 * abs(fit.amplitudes[k, j]) / abs(fit.amplitudes[k, first]))
                for j, order in enumerate(fit.harmonics)
                if j != first
            },
            "total_harmonic_distortion": float(fit.thd[k]),
            "offset": float(fit.offsets[k]),
            "residual_rms": float(fit.residual_rms[k]),
            "resolution": channel.resolution,
            "flux_linkage_integrated": float(factor * flux.values[k]),
            "flux_linkage_per_period": [float(factor * x) for x in flux.per_period[k]],
            "note_peak": peak_amplitude(values[k]),
            "note_peak_to_peak": peak_to_peak(values[k]),
        }
    outcome.detail(
        channels=channels,
        phase_factor=factor,
        drift={
            "value": fit.drift,
            "standard_uncertainty": fit.drift_uncertainty,
            "p_value": fit.drift_p_value,
            "significant": fit.drift_significant,
        },
        period_frequencies=[float(f) for f in flux.period_frequencies],
        residual_colour=fit.colour,
    )
