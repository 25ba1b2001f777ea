"""EMF of the three windings as phasors, seen from the start of the state T1T2."""

import math

import numpy as np
from numpy.typing import NDArray

from sim_instruments.six_step.drive import EmfHarmonic, SixStepDrive


def emf_angle_at_start(drive: SixStepDrive) -> float:
    """Angle (electrical, rad) of winding a's EMF when T1T2 begins: e_a = k·ω·cos(θ + it), θ the angle since then."""
    # Delta: the winding c lies across the conducting legs. Wye: phases a and c in series do.
    return (math.pi / 6 if drive.connection == "delta" else 0.0) - drive.advance_angle


def emf_phasors(drive: SixStepDrive) -> tuple[NDArray[np.float64], NDArray[np.complex128]]:
    """Harmonic orders, shape (H,), and EMF phasors per mechanical rad/s of the windings a, b, c, shape (3, H).

    With θ the electrical angle since T1T2 began, winding k has e_k = ω·Re Σ_h E[k, h]·exp(j·order[h]·θ) volts.
    Without advance the line-to-line EMF across the conducting legs 1 and 3 peaks in the middle of the state.
    """
    start = emf_angle_at_start(drive)
    harmonics = (EmfHarmonic(1, 1.0), *drive.emf_harmonics)
    orders = np.array([h.order for h in harmonics], dtype=np.float64)
    amplitudes = np.array([h.amplitude * np.exp(1j * h.phase) for h in harmonics])
    angles = start - np.arange(3)[:, None] * (2 * math.pi / 3)
    return orders, drive.emf_constant * amplitudes * np.exp(1j * orders * angles)


def mean_line_emf(drive: SixStepDrive) -> float:
    """Mean EMF over T1T2 between the conducting terminals 1 and 3 per mechanical speed, in V/(rad/s)."""
    orders, phasors = emf_phasors(drive)
    line = -phasors[2] if drive.connection == "delta" else phasors[0] - phasors[2]
    swing = 1j * orders * (math.pi / 3)
    return float((line * (np.exp(swing) - 1) / swing).real.sum())
