"""Accuracy, speed and noise of the E4980A after its data sheet (5989-4435EN): Ae = [Ab + Zs/|Z|·100 + Yo·|Z|·100]·Kt."""

import math
from typing import Literal

import numpy as np

Aperture = Literal["SHOR", "MED", "LONG"]

# Measurement time in ms against frequency, DC bias off.
_FREQUENCIES = (20.0, 100.0, 1.0e3, 10.0e3, 100.0e3, 1.0e6, 2.0e6)
_TIMES = {
    "LONG": (480.0, 300.0, 240.0, 230.0, 220.0, 220.0, 220.0),
    "MED": (380.0, 180.0, 110.0, 92.0, 89.0, 88.0, 88.0),
    "SHOR": (330.0, 100.0, 20.0, 7.7, 5.7, 5.6, 5.6),
}
_LOG_FREQUENCIES = np.log(_FREQUENCIES)
_LOG_TIMES = {aperture: np.log(times) for aperture, times in _TIMES.items()}
# Noise of one reading, as the share of the data sheet's error that repeats differently each time.
_NOISE_SHARE = {"LONG": 0.01, "MED": 0.02, "SHOR": 0.05}
_BASIC_NOISE = {"LONG": 5.0e-6, "MED": 1.0e-5, "SHOR": 5.0e-5}
_INTEGRATED_SHARE = 0.8


def measurement_time(aperture: Aperture, frequency: float) -> float:
    """Return the time (s) of one measurement at a frequency (Hz)."""
    return float(np.exp(np.interp(math.log(frequency), _LOG_FREQUENCIES, _LOG_TIMES[aperture]))) / 1000.0


def integration_time(aperture: Aperture, frequency: float) -> float:
    """Return the part (s) of the measurement in which the signal is integrated: whole periods of the test signal."""
    periods = max(1, int(_INTEGRATED_SHARE * measurement_time(aperture, frequency) * frequency))
    return periods / frequency


def basic_accuracy(aperture: Aperture, frequency: float, level_rms: float) -> float:
    """Return Ab, relative, for a level (V); of two columns that fit the better one holds."""
    short = aperture == "SHOR"
    low = frequency < (125.0 if short else 100.0)
    candidates: list[float] = []
    if level_rms <= 0.05:
        floor = max(level_rms, 0.005)
        candidates.append((0.6 if low else 0.2) * 0.05 / floor if short else (0.25 if low else 0.1) * 0.03 / floor)
    if 0.05 <= level_rms <= 0.3:
        candidates.append((0.6 if low else 0.2) if short else (0.25 if low else 0.1))
    if 0.3 <= level_rms <= 1.0:
        candidates.append((0.3 if low else 0.1) if short else (0.1 if low else 0.05))
    if level_rms >= 1.0:
        candidates.append((0.3 if low else 0.15) if short else (0.15 if low else 0.1))
    return min(candidates) / 100.0


def short_offset(aperture: Aperture, frequency: float, level_rms: float, magnitude: float) -> float:
    """Return Zs (Ω) for an impedance of that magnitude (Ω)."""
    level = max(level_rms, 0.005)
    by_frequency = 1.0 + math.sqrt(1000.0 / frequency)
    if magnitude > 1.08:
        return (2.5e-3 if aperture == "SHOR" else 0.6e-3) * (1.0 + 0.4 / level) * by_frequency
    return (1.0e-3 if aperture == "SHOR" else 0.2e-3) * (1.0 + 1.0 / level) * by_frequency


def open_offset(aperture: Aperture, frequency: float, level_rms: float) -> float:
    """Return Yo (S)."""
    level = max(level_rms, 0.005)
    return (2.0e-9 if aperture == "SHOR" else 0.5e-9) * (1.0 + 0.1 / level) * (1.0 + math.sqrt(100.0 / frequency))


def noise(aperture: Aperture, averages: int, frequency: float, level_rms: float, magnitude: float) -> float:
    """Return the standard deviation (Ω) of each part of the impedance from one reading to the next."""
    share = _NOISE_SHARE[aperture]
    deviation = math.hypot(
        _BASIC_NOISE[aperture] * magnitude,
        share * short_offset(aperture, frequency, level_rms, magnitude),
        share * open_offset(aperture, frequency, level_rms) * magnitude**2,
    )
    return deviation / math.sqrt(averages)
