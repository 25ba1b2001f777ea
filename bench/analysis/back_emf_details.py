"""Details of a back-EMF analysis besides its parameters."""

from collections.abc import Sequence
from typing import Any

import numpy as np

from bench.analysis.back_emf_record import BackEmfRecord
from bench.analysis.outcome import AnalysisOutcome
from bench.analysis.record_sizes import warn_of_voltage
from bench.captures import Capture
from drivers.interfaces.text import text
from procedures.estimation.emf.back_emf import BackEmfFit
from procedures.estimation.emf.integrated_flux import FluxEstimate
from procedures.estimation.emf.period import peak_amplitude, peak_to_peak
from procedures.estimation.emf.speed_trend import OverSpeeds
from procedures.estimation.fitting.fit import coverage_interval


def warn_of_record(outcome: AnalysisOutcome, record: BackEmfRecord) -> None:
    """Say what looks wrong of a record's speed and of where its probes are."""
    capture, fit = record.capture, record.fit
    together = [names for names in record.lines if len(names) > 1]
    for names in together:
        outcome.warn(
            text(
                "channels {names} show the same waveform: their probes are on the same line, or one channel is a "
                "copy. They count as one channel and give no information about the other lines. Probe the other "
                "lines as well",
                names=names,
            ),
            "one-line",
        )
    sizes = np.abs(fit.amplitudes[:, fit.harmonics.index(1)])
    largest = int(np.argmax(sizes))
    warn_of_voltage(outcome, record.names[largest], float(sizes[largest]))
    if fit.ripples:
        frequencies = record.integrated.period_frequencies
        outcome.warn(
            text(
                "the speed swings: the periods of the record are at {slowest:.4g} to {fastest:.4g} Hz. The flux linkage comes from the "
                "voltage integrated over whole periods, which does not depend on the speed",
                slowest=float(np.min(frequencies)),
                fastest=float(np.max(frequencies)),
            )
        )
    elif fit.drift_significant:
        outcome.warn(
            text(
                "the speed drifts by {drift:+.2f} % over the record (u = {drift_uncertainty:.2f} %). The flux "
                "linkage comes from the voltage integrated over whole periods, which does not depend on the speed",
                drift=100 * fit.drift,
                drift_uncertainty=100 * fit.drift_uncertainty,
            )
        )
    if len(capture.channels) == 3 and not together:
        first, second = (float(np.degrees(fit.phases[k])) for k in (1, 2))
        if not (abs(abs(first) - 120) < 3 and abs(abs(second) - 120) < 3 and first * second < 0):
            outcome.warn(
                text(
                    "the phases lie at {first:.1f}° and {second:.1f}° instead of ±120°: check the positions of "
                    "the probes",
                    first=first,
                    second=second,
                )
            )


def detail_record(
    outcome: AnalysisOutcome,
    capture: Capture,
    values: np.ndarray[Any, np.dtype[np.float64]],
    fit: BackEmfFit,
    flux: FluxEstimate,
    factor: float,
) -> None:
    """Add what each channel shows."""
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
            }
            | {
                str(order): float(100 * sizes[k] / abs(fit.amplitudes[k, first]))
                for order, sizes in fit.further.items()
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


def detail_speeds(
    outcome: AnalysisOutcome, records: Sequence[BackEmfRecord], over: OverSpeeds, factor: float, pole_pairs: int | None
) -> None:
    """Add the table of the speeds (with intervals from the scatter alone), and what was tried on it."""
    rows = []
    for record in records:
        flux = record.flux
        low, high = coverage_interval(flux.value, flux.uncertainty, flux.degrees_of_freedom)
        rows.append(
            {
                "source": record.capture.source,
                "electrical_frequency": record.fit.frequency,
                "speed_rpm": 60.0 * record.fit.frequency / pole_pairs if pole_pairs else None,
                "flux_linkage": factor * flux.value,
                "standard_uncertainty": factor * flux.uncertainty,
                "coverage_interval": [factor * low, factor * high],
                "withheld": record.misfit.withholding("flux_linkage") is not None,
            }
        )
    given = [factor * record.flux.value for record in records]
    outcome.detail(
        speeds=rows,
        speed_trend={
            "p_value": over.p_value,
            "span": [min(given), max(given)],
            "law": over.law,
            "laws": [
                {"law": each.name, "intercept": factor * each.value, "p_value": each.p_value} for each in over.laws
            ],
        },
    )
