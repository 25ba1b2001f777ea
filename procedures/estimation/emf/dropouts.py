"""Detects invalid readings of a turning machine's voltage: a channel that repeats a value while the EMF changes, and single spikes."""

from collections.abc import Callable, Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from procedures.estimation.emf.harmonics import HarmonicModel, waveform_basis
from procedures.estimation.emf.record import DigitizedChannel
from procedures.estimation.fitting.fit import EstimationError, FloatArray
from procedures.estimation.fitting.misfit import Answer, Cause, Finding
from procedures.estimation.fitting.noise import white_noise

BoolArray = NDArray[np.bool_]

#: As many equal readings in a row, while the waveform moves by so many steps and standard deviations and this share of its
#: amplitude, are no readings.
_RUN, _MOVES_STEPS, _MOVES_NOISE, _MOVES_SHARE = 5, 3.0, 8.0, 0.1
#: A spike is so many standard deviations, steps and this share of the amplitude away from its neighbours' residuals.
_SPIKE_NOISE, _SPIKE_STEPS, _SPIKE_SHARE, _NEIGHBOURS = 9.0, 2.0, 0.02, 9
#: What comes more often than this is the waveform's own.
_MOST_SPIKES = 0.02
#: Beyond this share of a channel lost nothing is given.
_MOST_LOST = 0.45
_ROUNDS = 4


@dataclass(frozen=True)
class WithoutDropouts:
    """A record (C, n) with the model's values where readings are none: which were `lost` (C, n), by what the uncertainties of offset
    and amplitudes grow (C, 1 + 2H), and the findings.
    """

    values: FloatArray
    lost: BoolArray
    growth: FloatArray
    findings: tuple[Finding, ...]


def leave_out_dropouts(
    t: FloatArray,
    v: FloatArray,
    orders: Sequence[int],
    model: HarmonicModel,
    channels: Sequence[DigitizedChannel],
    refit: Callable[[FloatArray], HarmonicModel],
) -> WithoutDropouts | None:
    """Return the record (C, n) without frozen readings and spikes, None where it has none; `refit` fits a whole record.

    Raises EstimationError where a channel holds nothing else.
    """
    frozen, spikes = _found(v, v - model.residuals, channels)
    if not (frozen.any() or spikes.any()):
        return None
    values = v
    for _ in range(_ROUNDS):
        lost = frozen | spikes
        basis = waveform_basis(model, orders, t)
        values = np.where(lost, fit_the_rest(v, basis, lost) @ basis, v)
        model = refit(values)
        before = lost
        frozen, spikes = _found(v, values - model.residuals, channels)
        if np.array_equal(frozen | spikes, before):
            break
    lost = before
    basis = waveform_basis(model, orders, t)
    return WithoutDropouts(
        np.where(lost, fit_the_rest(v, basis, lost) @ basis, v),
        lost,
        np.array([growth_without(basis, each) for each in lost]),
        _told(frozen & lost, spikes & lost, lost, channels),
    )


def fit_the_rest(v: FloatArray, basis: FloatArray, lost: BoolArray) -> FloatArray:
    """Return offset and fluxes (C, 1 + 2H) of each channel by least squares over what was not lost."""
    rows = []
    for row, out in zip(v, lost, strict=True):
        kept = basis * ~out
        try:
            rows.append(np.linalg.lstsq(kept @ basis.T, kept @ row, rcond=1e-12)[0])
        except np.linalg.LinAlgError as error:
            raise EstimationError("too few readings are left within the channel's range; take a wider range") from error
    return np.array(rows)


def growth_without(basis: FloatArray, lost: BoolArray) -> FloatArray:
    """Return by what the uncertainties of offset and fluxes (1 + 2H,) grow for readings (n,) that were lost."""
    kept = ~lost
    if kept.all() or not kept.any():
        return np.ones(basis.shape[0])
    inverse = np.linalg.pinv((basis * kept) @ basis.T, hermitian=True)
    whole = np.linalg.inv(basis @ basis.T)
    return np.asarray(np.sqrt(np.maximum(np.diag(inverse) / np.diag(whole), 1.0) / np.mean(kept)))


def _found(v: FloatArray, wave: FloatArray, channels: Sequence[DigitizedChannel]) -> tuple[BoolArray, BoolArray]:
    """Return which readings (C, n) stand still, and which are spikes."""
    frozen, spikes = np.zeros(v.shape, dtype=bool), np.zeros(v.shape, dtype=bool)
    for k, channel in enumerate(channels):
        noise = white_noise(v[k], channel.resolution)
        swing = 0.5 * float(np.ptp(wave[k]))
        moves = max(_MOVES_STEPS * channel.resolution + _MOVES_NOISE * noise, _MOVES_SHARE * swing)
        frozen[k] = _standing_still(v[k], wave[k], moves)
        left = v[k] - wave[k]
        at_least = max(_SPIKE_NOISE * noise + _SPIKE_STEPS * channel.resolution, _SPIKE_SHARE * swing)
        # No residual is further from its neighbours' median than this.
        if 2.0 * np.abs(left).max() <= at_least:
            continue
        beside = np.abs(left - _median_of_neighbours(left))
        usual = 1.4826 * float(np.median(beside))
        limit = max(_SPIKE_NOISE * usual + _SPIKE_STEPS * channel.resolution, at_least)
        out = (beside > limit) & ~frozen[k]
        # The first and last reading of a stretch that stands still are beside the rest, too.
        if np.mean(out) <= _MOST_SPIKES:
            spikes[k] = out
    return frozen, spikes


def _median_of_neighbours(row: FloatArray) -> FloatArray:
    # Most records have no spike, and this takes as long to import as they take to fit.
    from scipy import ndimage

    return np.asarray(ndimage.median_filter(row, _NEIGHBOURS, mode="nearest"), dtype=np.float64)


def _standing_still(row: FloatArray, wave: FloatArray, moves: float) -> BoolArray:
    """Return which readings (n,) are in a run of equal ones during which the waveform moves."""
    starts = np.concatenate(([0], np.flatnonzero(np.diff(row)) + 1))
    lengths = np.diff(np.append(starts, row.size))
    if lengths.max() < _RUN:
        return np.zeros(row.shape, dtype=bool)
    least, most = np.minimum.reduceat(wave, starts), np.maximum.reduceat(wave, starts)
    value, span = row[starts], 0.5 * float(np.ptp(wave))
    # At an end of the range a waveform beyond it is cut off; one that comes back halfway is not followed.
    top, bottom = value > np.max(row) - moves / 3.0, value < np.min(row) + moves / 3.0
    moved = np.where(top | bottom, np.where(top, value - least, most - value) - span, most - least)
    return np.asarray(np.repeat((lengths >= _RUN) & (moved > moves), lengths))


def _told(
    frozen: BoolArray, spikes: BoolArray, lost: BoolArray, channels: Sequence[DigitizedChannel]
) -> tuple[Finding, ...]:
    share = np.mean(lost, axis=1)
    worst = int(np.argmax(share))
    figures: dict[str, float | str] = {
        "record": "emf",
        "channel": channels[worst].name,
        "count": float(np.count_nonzero(lost)),
        "readings": float(lost.size),
        "frozen": float(np.count_nonzero(frozen)),
        "spikes": float(np.count_nonzero(spikes)),
    }
    answer = Answer.WITHHELD if share[worst] > _MOST_LOST else Answer.MODELLED
    return (Finding(Cause.DROPOUTS, answer, ("flux_linkage",), 0.0, figures),)
