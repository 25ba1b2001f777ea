"""Mains hum in a record of a turning machine's voltages."""

import math
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from scipy import special

from procedures.estimation.emf.harmonics import HarmonicModel, waveform_basis
from procedures.estimation.emf.record import DigitizedChannel
from procedures.estimation.fitting.fit import FloatArray
from procedures.estimation.fitting.misfit import Answer, Cause, Finding
from procedures.estimation.fitting.noise import MAINS, MAINS_STRAY

#: A line is seen where chance gives it once in so many records.
_CHANCE = 2e-6
#: Points that suffice to look for so slow a line.
_ENOUGH = 4096
#: A line is told from the fitted harmonics this many bins away, from those that are not fitted a little farther.
_APART, _ASIDE = 0.6, 1.5
#: A line is the mains' own where its mirror image about the fundamental, which a swing of the speed has as well, is so much weaker.
_MIRRORED = 6.0
#: Below this share of a converter's step a line may be the steps' own.
_LEAST_STEPS = 0.1


@dataclass(frozen=True)
class Hum:
    """A line at `frequency` (Hz): its `amplitudes` (C,), V, and how far beyond chance it is seen."""

    frequency: float
    amplitudes: FloatArray
    score: float

    def finding(self, channels: Sequence[DigitizedChannel]) -> Finding:
        """Return the finding for it."""
        worst = int(np.argmax(self.amplitudes))
        figures: dict[str, float | str] = {
            "frequency": self.frequency,
            "channel": channels[worst].name,
            "amplitude": float(self.amplitudes[worst]),
        }
        return Finding(Cause.HUM, Answer.MODELLED, ("flux_linkage",), self.score, figures)


def find_hum(
    t: FloatArray, orders: Sequence[int], model: HarmonicModel, colour: float, channels: Sequence[DigitizedChannel]
) -> float | None:
    """Return the frequency (Hz) of the mains hum that the residuals show, None where they show none."""
    block = max(1, t.size // _ENOUGH)
    count = t.size // block
    few_t = t[: count * block].reshape(count, block).mean(axis=1)
    left = model.residuals[:, : count * block].reshape(-1, count, block).mean(axis=2)
    span = float(t[-1] - t[0])
    fundamental = float(model.speed(np.array([model.middle]))[0]) / (2.0 * math.pi)
    spread = np.maximum(np.std(left, axis=1), 1e-300)
    steps = np.array([channel.resolution for channel in channels])
    best: tuple[float, float] | None = None
    basis: FloatArray | None = None
    for mains in MAINS:
        nearest = max(1, round(mains / fundamental))
        apart = abs(mains - nearest * fundamental) * span
        if 2.0 * mains * (few_t[1] - few_t[0]) > 0.9 or mains * span < 1.0:
            continue
        if apart < (_APART if nearest in orders else _ASIDE):
            continue
        stray = MAINS_STRAY * mains * span
        tried = (
            mains * (1.0 + MAINS_STRAY * np.linspace(-1.0, 1.0, 2 * math.ceil(2.0 * stray) + 1))
            if stray > 0.5
            else [mains]
        )
        for frequency in tried:
            if basis is None:
                basis = waveform_basis(model, orders, few_t)
            pair, _ = _across(mains_pair(few_t, float(frequency)), basis)
            size = left @ pair.T @ np.linalg.inv(pair @ pair.T)
            if np.max(np.hypot(size[:, 0], size[:, 1]) - _LEAST_STEPS * steps) <= 0.0:
                continue
            power = float(np.sum(np.einsum("cm,mn,cn->c", size, pair @ pair.T, size) / spread**2)) / colour
            if power < float(special.chdtri(2 * left.shape[0], _CHANCE)):
                continue
            image, _ = _across(mains_pair(few_t, abs(2.0 * fundamental - float(frequency))), basis)
            mirrored = left @ image.T @ np.linalg.pinv(image @ image.T)
            opposite = float(np.sum(np.einsum("cm,mn,cn->c", mirrored, image @ image.T, mirrored) / spread**2)) / colour
            if power > _MIRRORED * opposite and (best is None or power > best[0]):
                best = power, float(frequency)
    return None if best is None else best[1]


def take_out(
    t: FloatArray, v: FloatArray, orders: Sequence[int], model: HarmonicModel, frequency: float
) -> tuple[FloatArray, FloatArray, Hum]:
    """Return the record (C, n) without its line of that frequency, by what the amplitudes' uncertainties grow for it (1 + 2H,), and
    the line.
    """
    basis = waveform_basis(model, orders, t)
    pair = mains_pair(t, frequency)
    across, shift = _across(pair, basis)
    normal = across @ across.T
    rest = v - (v @ basis.T @ np.linalg.inv(basis @ basis.T)) @ basis
    size = rest @ across.T @ np.linalg.inv(normal)
    whole = np.diag(np.linalg.inv(basis @ basis.T))
    growth = np.sqrt(1.0 + np.einsum("mk,mn,nk->k", shift, np.linalg.inv(normal), shift) / whole)
    noise = np.maximum(np.std(rest - size @ across, axis=1), 1e-300)
    power = float(np.sum(np.einsum("cm,mn,cn->c", size, normal, size) / noise**2))
    return v - size @ pair, growth, Hum(frequency, np.hypot(size[:, 0], size[:, 1]), math.sqrt(power))


def mains_pair(t: FloatArray, frequency: float) -> FloatArray:
    """Return cosine and sine of a line (Hz) at times (s), (2, n)."""
    angle = 2.0 * math.pi * frequency * t
    return np.array((np.cos(angle), np.sin(angle)))


def _across(pair: FloatArray, basis: FloatArray) -> tuple[FloatArray, FloatArray]:
    """Return what of a cosine and a sine the waveform's own terms do not make up for, and what they do (2, 1 + 2H)."""
    shift = pair @ basis.T @ np.linalg.inv(basis @ basis.T)
    return pair - shift @ basis, shift
