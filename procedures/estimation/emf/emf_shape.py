"""Shape of a machine's EMF: how like the phases are in size and spacing, and how far each is from a sine."""

import math
from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import ArrayLike, NDArray

from procedures.estimation.emf.back_emf import fit_back_emf
from procedures.estimation.fitting.fit import EstimationError, FloatArray
from procedures.estimation.fitting.noise import undithered

#: The course of the angle is told by these; the others are then read along it.
_LEADING = (1, 5, 7)
#: Harmonics are read up to this share of the sampling limit.
_USABLE = 0.9
#: What odd orders lose stands for a distortion of up to so many times theirs.
_LIKE_OTHERS = 3.0


@dataclass(frozen=True)
class EmfShape:
    """Three channels' EMF of one turning machine.

    `flux` (3,) fundamental amplitude over electrical speed (V·s/rad), `flux_uncertainty` its relative standard uncertainty;
    `spacings` (3,) from the first channel to the second, the second to the third, the third to the first (rad, positive, of
    sum 2π) with `spacing_uncertainty`; `thd` (3,) with `thd_uncertainty`; `harmonics` (3, N) complex amplitudes over the
    fundamental's, orders 1 … N, at the crest of each channel's fundamental, with `noise` (3,) on each of their axes; `forwards` whether
    the channels follow each other in their order.
    """

    frequency: float
    flux: FloatArray
    flux_uncertainty: float
    spacings: FloatArray
    spacing_uncertainty: float
    thd: FloatArray
    thd_uncertainty: float
    harmonics: NDArray[np.complex128]
    noise: FloatArray
    forwards: bool

    def with_backwards(self, back: "EmfShape") -> "EmfShape":
        """Return the mean of this and one of the shaft turning the other way: what delays a channel in time is late by the opposite
        angle there, and falls out of the spacings. A wave that a channel bends keeps its sign where the EMF changes it, and falls out of
        the harmonics of even order.
        """
        share = 0.5 * (self.harmonics + self._mirrored(back))
        own = 0.5 * np.hypot(self.noise, back.noise)
        thd, _ = _distortion(share, own)
        return replace(
            self,
            flux=0.5 * (self.flux + back.flux),
            # Rounding at the same angles of a turn, and what the channels pick up of the mains, are no noise that a second record halves.
            flux_uncertainty=max(self.flux_uncertainty, back.flux_uncertainty),
            spacings=0.5 * (self.spacings + back.spacings),
            spacing_uncertainty=max(self.spacing_uncertainty, back.spacing_uncertainty),
            thd=thd,
            thd_uncertainty=max(self.thd_uncertainty, back.thd_uncertainty),
            noise=own,
            harmonics=share,
        )

    def bent(self, back: "EmfShape") -> tuple[FloatArray, FloatArray]:
        """Return how much each channel bends the wave, by its harmonics of even order that turning the other way does not turn: their rms
        (3,) over the fundamental's, noise taken out, and its uncertainty.
        """
        left = 0.5 * (self.harmonics - self._mirrored(back))[:, 1::2]
        own = 0.5 * np.hypot(self.noise, back.noise)
        size = np.sqrt(np.maximum(np.sum(np.abs(left) ** 2, axis=1) - 2.0 * left.shape[1] * own**2, 0.0))
        return size, own * math.sqrt(2.0 * left.shape[1])

    def lost(self, slower: "EmfShape") -> tuple[FloatArray, FloatArray]:
        """Return by how much the distortion (3,) is more than that of a wave that nothing filters, and its uncertainty, by the shaft
        turning slower the same way.

        What a filter of probe or converter takes or adds grows with the frequency's square (a bandwidth, a mean over time, a resonance
        far above). Harmonics of even order, which a channel may make of a large wave, are left out and taken to lose alike. What a channel
        shows alone counts where it is seen better than the mean of the three.
        """
        odd, at_slower = self._of_odd_orders(), slower._of_odd_orders()
        off, spread = odd[0] - at_slower[0], np.full(3, math.hypot(odd[1], at_slower[1]))
        mean, of_mean = float(np.mean(off)), float(spread[0]) / math.sqrt(3.0)
        better = abs(mean) / of_mean > np.abs(off) / spread
        # A wave of hardly any odd order says little of the others.
        whole = np.clip(self.thd / np.maximum(odd[0], 1e-300), 1.0, _LIKE_OTHERS)
        grown = whole * self.frequency**2 / (self.frequency**2 - slower.frequency**2)
        return grown * np.where(better, mean, off), grown * np.where(better, of_mean, spread)

    def _of_odd_orders(self) -> tuple[FloatArray, float]:
        return _distortion(self.harmonics[:, ::2], self.noise)

    @staticmethod
    def _mirrored(back: "EmfShape") -> NDArray[np.complex128]:
        """Return the harmonics of a shaft that turns the other way as those of this way: its wave runs backwards and upside down."""
        sign = np.where(np.arange(1, back.harmonics.shape[1] + 1) % 2 == 0, -1.0, 1.0)
        return np.asarray(sign * np.conj(back.harmonics))

    def lags(self, back: "EmfShape") -> FloatArray:
        """Return by how much (rad) the second channel is later in time than the first, the third than the second, the first than the
        third, by the shape of the shaft turning the other way.
        """
        lags = 0.5 * (self.spacings - back.spacings)
        return lags if self.forwards else -lags


def emf_shape(
    time: ArrayLike, channels: ArrayLike, *, harmonics: int = 40, resolution: Sequence[float] = (0.0, 0.0, 0.0)
) -> EmfShape:
    """Return the shape of three voltages (3, n), V, that share one turning shaft, evenly sampled in time (s).

    The total harmonic distortion is the rms of the harmonics of order 2 … `harmonics` over that of the fundamental
    (IEC 61000-4-7, whose highest order is 40 as well), read by least squares over the turned angle instead of a Fourier
    transform over a synchronous window, so that neither the record's length nor a drifting speed matters. What noise adds to
    it is taken out. `resolution` (V) is one converter step a channel. Raises EstimationError on less than a period.
    """
    t, v = np.asarray(time, dtype=np.float64), np.atleast_2d(np.asarray(channels, dtype=np.float64))
    if v.shape[0] != 3:
        raise EstimationError(f"the shape is that of three phases; {v.shape[0]} channels were given")
    fit = fit_back_emf(t, v, harmonics=_LEADING)
    phase, speed = fit.model.phase(t), fit.model.speed(t)
    per_sample = fit.electrical_speed * float(t[-1] - t[0]) / (t.size - 1)
    highest = min(harmonics, int(_USABLE * math.pi / per_sample))
    if highest < 2:
        raise EstimationError(f"{math.tau / per_sample:.1f} samples a period show no harmonic; sample faster")
    if t.size < 4 * highest:
        raise EstimationError(f"{t.size} samples do not suffice for {highest} harmonics; take more points")
    # The EMF is flux times speed: over a drifting speed it is the flux that is periodic in the angle.
    turning = np.exp(1j * phase)
    powers = np.cumprod(np.broadcast_to(turning, (highest, t.size)), axis=0)
    design = np.vstack((1.0 / speed, powers.real, powers.imag))
    normal = design @ design.T
    values = np.linalg.solve(normal, design @ (v / speed).T).T
    left = v / speed - values @ design
    phasors = values[:, 1 : 1 + highest] - 1j * values[:, 1 + highest :]
    size = np.abs(phasors[:, 0])
    noise = np.sqrt(np.sum(left**2, axis=1) / (t.size - design.shape[0]))
    steps = np.array(
        [undithered(float(s), float(r)) for s, r in zip(noise * fit.electrical_speed, resolution, strict=True)]
    )
    # Of the fundamental, on each of its two axes; what the converter's steps leave is no noise, but as large.
    own = np.hypot(noise * math.sqrt(2.0 / t.size), steps / fit.electrical_speed / math.sqrt(t.size / 8.0 + 1.0)) / size
    crest = np.exp(-1j * np.angle(phasors[:, :1]) * np.arange(1, highest + 1))
    share = phasors * crest / size[:, None]
    thd, thd_uncertainty = _distortion(share, own)
    angles = np.angle(phasors[:, 0])
    steps_back = np.mod(angles - np.roll(angles, -1), 2.0 * math.pi)
    forwards = bool(np.sum(steps_back) < 3.0 * math.pi)
    worst = float(np.max(own)) * math.sqrt(fit.colour)
    return EmfShape(
        frequency=fit.frequency,
        flux=size,
        flux_uncertainty=math.hypot(worst, fit.frequency_uncertainty / fit.frequency),
        spacings=steps_back if forwards else 2.0 * math.pi - steps_back,
        spacing_uncertainty=math.sqrt(2.0) * worst,
        thd=thd,
        thd_uncertainty=thd_uncertainty,
        harmonics=share,
        noise=own,
        forwards=forwards,
    )


def _distortion(share: NDArray[np.complex128], own: FloatArray) -> tuple[FloatArray, float]:
    """Return the distortion of each channel without what noise adds to its square, and the largest uncertainty of one."""
    axes = 2 * (share.shape[1] - 1)
    seen = np.sum(np.abs(share[:, 1:]) ** 2, axis=1)
    added = axes * own**2
    thd = np.sqrt(np.maximum(seen - added, 0.0))
    # The length of a vector errs as one of its components does; where it is no longer than noise, as the noise's square.
    scatter = np.sqrt(2.0 * axes) * own**2
    uncertainty = np.where(
        thd > 0.0, np.minimum(own + 0.5 * scatter / np.maximum(thd, 1e-300), np.sqrt(scatter)), np.sqrt(scatter)
    )
    return thd, float(np.max(uncertainty))
