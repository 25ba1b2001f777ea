"""Third harmonic or hum that all channels show alike: voltages between lines have none, those against a star point or ground may."""

import numpy as np

from procedures.estimation.emf.harmonics import HarmonicModel, waveform_basis
from procedures.estimation.fitting.fit import FloatArray


def in_phase_third(time: FloatArray, channels: FloatArray, model: HarmonicModel) -> tuple[float, float]:
    """Return the third harmonic of the channels' mean (C, n), V, as a share of their fundamental, and its standard uncertainty.

    Gains that differ do not make one: three times a third of a turn is a whole one for this order only, and its multiples.
    """
    basis = waveform_basis(model, (1, 3), time)
    mean = channels.mean(axis=0)
    normal = basis @ basis.T
    values = np.linalg.solve(normal, basis @ mean)
    left = mean - values @ basis
    noise = float(np.sqrt(np.mean(left**2) / normal[2, 2]))
    fundamental = float(np.mean(np.abs(model.flux[:, 0])))
    # A flux's voltage goes with its order.
    return 3.0 * float(np.hypot(values[2], values[4])) / fundamental, 3.0 * noise / fundamental


def in_phase_hum(time: FloatArray, channels: FloatArray, model: HarmonicModel, frequency: float) -> tuple[float, float]:
    """Return the hum (Hz) of the channels' mean (C, n), V, as a share of their fundamental, and that of the channel with the least."""
    angle = 2.0 * np.pi * frequency * time
    basis = np.vstack((waveform_basis(model, (1, 3), time), np.cos(angle), np.sin(angle)))
    rows = np.vstack((channels.mean(axis=0), channels))
    values = np.linalg.lstsq(basis.T, rows.T, rcond=None)[0]
    hum = np.hypot(values[-2], values[-1])
    fundamental = float(np.mean(np.abs(model.flux[:, 0]))) * abs(float(model.speed(np.array([model.middle]))[0]))
    return float(hum[0]) / fundamental, float(np.min(hum[1:])) / fundamental
