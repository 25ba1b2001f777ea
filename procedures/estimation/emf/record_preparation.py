"""Features of a turning machine's recorded voltages beyond the waveform, and the record without them."""

from collections.abc import Callable, Sequence
from dataclasses import dataclass

import numpy as np

from procedures.estimation.emf.clipping import find_ends, restore
from procedures.estimation.emf.dead_zone import find_dead_zone
from procedures.estimation.emf.dropouts import leave_out_dropouts
from procedures.estimation.emf.even_orders import find_bend
from procedures.estimation.emf.harmonics import HarmonicModel
from procedures.estimation.emf.hum import find_hum, take_out
from procedures.estimation.emf.memory import find_memory
from procedures.estimation.emf.modulation import find_modulation
from procedures.estimation.emf.record import DigitizedChannel
from procedures.estimation.emf.smoothed_noise import find_smoothing
from procedures.estimation.fitting.fit import FloatArray
from procedures.estimation.fitting.misfit import Answer, Cause, Finding
from procedures.estimation.fitting.noise import alike, undithered_sine, white_noise

#: Noise below a tenth of a step, as far as a residual tells it: what is left is the steps' own.
_COARSE = 0.05
#: Where this share of the amplitude, and so many times the samples' noise, is left, the record is none of a turning machine.
_UNLIKE, _UNLIKE_NOISE = 0.12, 3.0
#: What a model leaves of a record whose samples may all be noise, share of the amplitude: beyond, every other one may be none.
_MOST_NOISE = 0.6
#: So many codes at least make a waveform.
_CODES = 8.0
#: Alternations of fit and line until neither moves.
_ROUNDS = 3


@dataclass(frozen=True)
class PreparedRecord:
    """A record as the waveform's model takes it: `values` (C, n), `kept` (C,) the share of readings that are the record's own, by what
    the uncertainties of offset and amplitudes grow (C, 1 + 2H), what is not known of the fundamental flux beside them (C,), how many
    readings share one rounding error (C,), and the findings.
    """

    values: FloatArray
    kept: FloatArray
    growth: FloatArray
    beside: FloatArray
    shared: FloatArray
    findings: tuple[Finding, ...]
    told: bool = True

    def unlike(
        self, model: HarmonicModel, noise: FloatArray, channels: Sequence[DigitizedChannel]
    ) -> tuple[Finding, ...]:
        """Return the finding of a record that is no waveform: of which the `model` leaves much more, `noise` (C,), V, than its samples'
        own noise and the harmonics that a machine may have. Of channels that nobody describes nothing is said.
        """
        sizes = np.abs(model.flux).max(axis=1) * float(model.speed(np.array([model.middle]))[0])
        if not (self.told and np.any(noise > _UNLIKE * sizes)):
            return ()
        own = np.array([white_noise(row, each.resolution) for row, each in zip(self.values, channels, strict=True)])
        unlike = (noise > _UNLIKE * sizes) & (noise > _UNLIKE_NOISE * own)
        if not np.any(unlike | (noise > _MOST_NOISE * sizes)):
            return ()
        score = float(np.max(noise / np.maximum(own, 1e-300)))
        return (Finding(Cause.UNEXPLAINED, Answer.WITHHELD, ("flux_linkage",), score),)


def prepare_record(
    t: FloatArray,
    v: FloatArray,
    orders: Sequence[int],
    model: HarmonicModel,
    colour: float,
    channels: Sequence[DigitizedChannel],
    refit: Callable[[FloatArray], HarmonicModel],
) -> PreparedRecord:
    """Leave out what is no reading and what clipped, and take out a line of the mains, where the record (C, n) shows them; `refit` fits
    a whole record.
    """
    values, growth = v, np.ones((v.shape[0], 1 + 2 * len(orders)))
    kept, beside = np.ones(v.shape[0]), np.zeros(v.shape[0])
    whole = np.ones(v.shape[0], dtype=bool)
    findings: list[Finding] = []
    if without := leave_out_dropouts(t, v, orders, model, channels, refit):
        v = values = without.values
        growth, kept = without.growth, 1.0 - np.mean(without.lost, axis=1)
        whole = kept == 1.0
        findings += without.findings
        model = refit(values)
    hum = find_hum(t, orders, model, colour, channels)
    shared = shared_rounding(t, v, model, channels)
    if ends := find_ends(t, v, orders, model, channels, shared, hum):
        restored = restore(t, v, orders, model, ends, channels, shared, refit)
        if restored.lost.any():
            whole &= ~restored.lost.any(axis=1)
            values, growth, beside = restored.values, growth * restored.growth, restored.moved
            kept = np.maximum(kept - np.mean(restored.lost, axis=1), 0.05)
            findings += restored.findings
            model = refit(values)
            hum = find_hum(t, orders, model, colour, channels)
    if hum is not None:
        recorded = values
        for _ in range(_ROUNDS):
            values, more, line = take_out(t, recorded, orders, model, hum)
            model = refit(values)
        growth = growth * more
        findings.append(line.finding(channels))
    share, modulation = find_modulation(t, values, orders, model, whole)
    findings += modulation
    bent, bend = find_bend(t, orders, model, channels, shared, whole)
    findings += bend
    speed = float(model.speed(np.array([model.middle]))[0])
    fundamentals = np.abs(model.flux[:, list(orders).index(1)]) * speed
    lost, zone = find_dead_zone(values, model.residuals, fundamentals, channels, shared)
    findings += zone
    late, memory = find_memory(t, orders, model, channels, whole)
    findings += memory
    smooth, smoothing = find_smoothing(t, orders, model, channels, whole, modulated=bool(modulation))
    findings += smoothing
    moved = np.hypot(share, smooth) * fundamentals / speed
    beside = np.sqrt(beside**2 + moved**2 + bent**2 + (np.hypot(lost, late) / speed) ** 2)
    return PreparedRecord(values, kept, growth, beside, shared, tuple(findings))


def shared_rounding(
    t: FloatArray, v: FloatArray, model: HarmonicModel, channels: Sequence[DigitizedChannel]
) -> FloatArray:
    """Return how many readings of each channel (C,) share one rounding error."""
    phase, shared = model.phase(t), np.ones(v.shape[0])
    for c, (row, left, channel) in enumerate(zip(v, model.residuals, channels, strict=True)):
        # Of a few codes rounding is most of the waveform, and no error beside it.
        if np.ptp(row) > _CODES * channel.resolution:
            shared[c] = alike(phase, row, row - left, float(model.noise[c]), channel.resolution)
    return shared


def as_recorded(v: FloatArray, orders: Sequence[int]) -> PreparedRecord:
    """Return a record (C, n) whose channels nobody describes as it is."""
    count = v.shape[0]
    return PreparedRecord(
        v, np.ones(count), np.ones((count, 1 + 2 * len(orders))), np.zeros(count), np.ones(count), (), told=False
    )


def rounding(
    sizes: FloatArray, noise: FloatArray, channels: Sequence[DigitizedChannel], good: PreparedRecord
) -> FloatArray:
    """Return what the converter's steps leave in each channel's amplitude (C,), V, standard uncertainty.

    Of few places of a turn that come again and again, as in a record sampled at a multiple of its frequency, the steps' errors do not
    average out over the turn either; where places are as dense as steps, the sine's own formula holds alone.
    """
    result = np.empty(sizes.size)
    for c, (size, left, channel) in enumerate(zip(sizes, noise, channels, strict=True)):
        step, shared = channel.resolution, float(good.shared[c])
        places = good.values.shape[1] / shared
        dense = places * step / (2.0 * float(size)) if size > 0.0 else 1.0
        each = max(float(left), step / np.sqrt(12.0)) ** 2 * 2.0 * (shared - 1.0) / good.values.shape[1]
        result[c] = np.sqrt(undithered_sine(float(size), float(left), step) ** 2 + each * max(1.0 - dense, 0.0))
    return result


def too_coarse(noise: FloatArray, channels: Sequence[DigitizedChannel]) -> tuple[Finding, ...]:
    """Return the finding of a channel whose noise (C,), V, quantisation included, is too small beside its steps to average them out."""
    steps = np.array([channel.resolution for channel in channels])
    left = np.sqrt(np.maximum(noise**2 - steps**2 / 12.0, 0.0)) / np.where(steps > 0.0, steps, 1.0)
    coarse = (steps > 0.0) & (left < _COARSE)
    if not coarse.any():
        return ()
    worst = int(np.argmin(np.where(coarse, left, np.inf)))
    figures: dict[str, float | str] = {"channel": channels[worst].name, "resolution": float(steps[worst])}
    return (Finding(Cause.TOO_COARSE, Answer.WIDENED, ("flux_linkage",), 0.0, figures),)
