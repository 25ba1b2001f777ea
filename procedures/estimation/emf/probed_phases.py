"""Three channels that should each show one phase of a turning motor against an artificial star: which show something else."""

import math
from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from enum import Enum

import numpy as np
from numpy.typing import NDArray

from procedures.estimation.fitting.fit import EstimationError, FloatArray

#: A pattern fits when no channel is farther off than this share of a phase's voltage: gains, unlike phases and harmonics stay below.
_FITS = 0.2
#: A signal of fewer steps of the converter is too weak to be judged.
LEAST_STEPS = 6.0


class ProbingFault(Enum):
    """Fault of probes, or of terminals that should be open."""

    NONE = "as told"
    SILENT = "silent channel"
    REVERSED = "channel reversed"
    TIP = "tip elsewhere"
    REFERENCE = "reference on a terminal"
    JOINED = "terminals joined"
    SEQUENCE = "sequence"


@dataclass(frozen=True)
class Pattern:
    """The phasors that three channels show after one mistake (relative to a phase's voltage), and this mistake.

    `channel` is the one concerned, `terminals` are 0, 1, 2 for A, B, C.
    """

    fault: ProbingFault
    phasors: tuple[complex, complex, complex]
    channel: int | None = None
    terminals: tuple[int, ...] = ()


_TURN = np.exp(-2j * np.pi / 3.0 * np.arange(3))


def patterns() -> Iterator[Pattern]:
    """Give what is right first, then every single mistake that shows."""
    a, b, c = (complex(phase) for phase in _TURN)
    phases = (a, b, c)
    yield Pattern(ProbingFault.NONE, phases)
    for k in range(3):
        yield Pattern(ProbingFault.SILENT, _with(phases, k, 0j), k)
        yield Pattern(ProbingFault.REVERSED, _with(phases, k, -phases[k]), k)
        for m in range(3):
            if m != k:
                yield Pattern(ProbingFault.TIP, _with(phases, k, phases[m]), k, (m,))
                yield Pattern(ProbingFault.REFERENCE, _with(phases, k, phases[k] - phases[m]), k, (m,))
    for k in range(3):
        pair = [m for m in range(3) if m != k]
        # Two joined terminals share the mean of their phases' voltages, and so does the artificial star in part.
        together = sum(phases[m] for m in pair) / 2.0
        star = (2.0 * together + phases[k]) / 3.0
        joined = [together - star] * 3
        joined[k] = phases[k] - star
        yield Pattern(ProbingFault.JOINED, (joined[0], joined[1], joined[2]), None, tuple(pair))
    yield Pattern(ProbingFault.SEQUENCE, (a, c, b))


def phasors(samples: FloatArray) -> NDArray[np.complex128]:
    """Return the phasors (C,), in the signals' unit (peak), of channels that share one frequency; their common phase is arbitrary.

    `samples` (C, n) hold some whole periods, about; time runs forwards, and so do the phasors.
    """
    centred = samples - samples.mean(axis=1, keepdims=True)
    weights, sizes, courses = np.linalg.svd(centred, full_matrices=False)
    scale = math.sqrt(2.0 / samples.shape[1])
    plane = weights[:, :2] * sizes[:2] * scale
    if courses.shape[0] < 2:
        return np.asarray(plane[:, 0], dtype=np.complex128)
    across, along = courses[0], courses[1]
    # Its area tells which way the signals' common circle is run through.
    forwards = float(np.sum(across[:-1] * along[1:] - across[1:] * along[:-1])) > 0.0
    # v = Re(V·exp(jωt)): with cos on the first axis and sin on the second, V = x - jy.
    return np.asarray(plane[:, 0] + (-1j if forwards else 1j) * plane[:, 1], dtype=np.complex128)


def fitting(seen: NDArray[np.complex128], among: Sequence[Pattern]) -> list[Pattern]:
    """Return the patterns that phasors (3,) fit, whatever their common size and phase, the best first."""
    found = []
    for number, pattern in enumerate(among):
        wanted = np.array(pattern.phasors)
        size = complex(np.vdot(wanted, seen)) / float(np.vdot(wanted, wanted).real)
        off = float(np.max(np.abs(seen - size * wanted)))
        if abs(size) > 0.0 and off < _FITS * abs(size):
            found.append((off / abs(size), number, pattern))
    return [pattern for _, _, pattern in sorted(found, key=lambda each: each[:2])]


def phase_order(voltages: FloatArray, resolution: float) -> int:
    """Return 1 where three channels' voltages (V, shape (3, n)) follow each other as A, B, C in time, -1 for A, C, B.

    `resolution` (V) is one step of the converter. Raises EstimationError where the signal is weak, or is not that of three phases.
    """
    seen = phasors(voltages)
    if float(np.max(np.abs(seen))) < LEAST_STEPS * resolution:
        raise EstimationError("the voltages are too weak beside the oscilloscope's resolution; turn the shaft faster")
    best = next(iter(fitting(seen, list(patterns()))), None)
    if best is None or best.fault not in (ProbingFault.NONE, ProbingFault.SEQUENCE):
        raise EstimationError("the voltages are not those of three phases; check the probes and the star point")
    return 1 if best.fault is ProbingFault.NONE else -1


def _with(phases: tuple[complex, complex, complex], channel: int, shown: complex) -> tuple[complex, complex, complex]:
    a, b, c = (shown if k == channel else phase for k, phase in enumerate(phases))
    return a, b, c
