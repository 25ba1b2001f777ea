"""Readings at a held speed: the torque, and the fundamentals of voltages or currents."""

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import numpy as np
from GTC.lib import UncertainReal

from drivers.interfaces import Accuracy
from drivers.interfaces.text import text
from procedures.core.bench import Bench, ProcedureError
from procedures.core.budget import Uncertainties
from procedures.core.nameplate import Nameplate
from procedures.estimation.emf.agreement import Combined
from procedures.estimation.emf.back_emf import fit_back_emf
from procedures.estimation.emf.record import DigitizedChannel
from procedures.estimation.fitting.fit import FloatArray
from procedures.estimation.fitting.misfit import Misfit
from procedures.estimation.fitting.noise import undithered, white_noise
from procedures.maps.settings import SpeedsSettings
from procedures.techniques.acquisition import ranged_record
from procedures.techniques.shaft.driven_shaft import check_held, driving_speed_rad
from procedures.techniques.shaft.shaft_readings import ShaftReadings

_POINTS = 8_000
#: The shortest and the longest record (s).
_SHORTEST, _LONGEST = 0.02, 2.0
#: A filter of the torque has forgotten what was before after so many time constants.
_FORGOTTEN = 8.0
#: Harmonics that the fundamental is fitted with, so that they do not reach it.
_HARMONICS = (1, 3, 5, 7, 11, 13)


@dataclass(frozen=True)
class HeldTorque:
    """Mean torque (N·m, by the dynamometer on the shaft) and speed (rad/s) of a shaft held at a speed, at bench time `time` (s).

    `uncertainty` (N·m) is the mean's standard uncertainty from its scatter and steps.
    """

    torque: float
    uncertainty: float
    speed: float
    time: float
    torque_accuracy: Accuracy
    speed_accuracy: Accuracy


@dataclass(frozen=True)
class Fundamentals:
    """Amplitudes (V or A, peak) of the channels' fundamentals, their standard uncertainties, and the electrical speed (rad/s).

    `flux` is the mean amplitude over the electrical speed, `phases` (rad) are against the first channel, `accuracies` and `ranges` (full
    scale) are the channels' own.
    """

    amplitudes: tuple[float, ...]
    uncertainties: tuple[float, ...]
    phases: tuple[float, ...]
    electrical_speed: float
    flux: Combined
    accuracies: tuple[Accuracy, ...]
    ranges: tuple[float, ...]
    misfit: Misfit

    @property
    def mean(self) -> float:
        """The channels' mean amplitude."""
        return sum(self.amplitudes) / len(self.amplitudes)

    @property
    def uncertainty(self) -> float:
        """Its standard uncertainty, as far as it is the record's."""
        return math.hypot(*self.uncertainties) / len(self.uncertainties)


def held_torque(bench: Bench, settings: SpeedsSettings, speed: float) -> HeldTorque:
    """Return torque and speed of the shaft as it is held now at a `speed` (rad/s), once what was before is forgotten.

    Raises ProcedureError where it is not held.
    """
    first = bench.dynamometer.measure()
    bench.clock.sleep(max(settings.settle, _FORGOTTEN * first.torque_filter))
    taken, shaft = [], ShaftReadings(bench)
    for _ in range(settings.readings):
        taken.append(shaft.measure())
        bench.clock.sleep(settings.interval)
    check_held(bench, taken, speed)
    torque, resolution = np.array([each.torque for each in taken]), taken[-1].torque_accuracy.resolution
    scatter = white_noise(torque, resolution)
    own = math.hypot(scatter / math.sqrt(torque.size), undithered(scatter, resolution))
    return HeldTorque(
        float(np.mean(torque)),
        max(own, float(np.std(torque, ddof=1)) / math.sqrt(torque.size)),
        float(np.mean([each.speed for each in taken])),
        float(np.mean([each.time for each in taken])),
        taken[-1].torque_accuracy,
        taken[-1].speed_accuracy,
    )


def fundamentals(bench: Bench, ranges: Mapping[int, float], frequency: float, periods: float) -> Fundamentals:
    """Return the fundamentals of channels whose signals have about an electrical frequency (Hz); `ranges` are first full scales."""
    record_time = min(max(periods / frequency, _SHORTEST), _LONGEST)
    bench.oscilloscope.configure_acquisition(record_time, _POINTS, 0.0)
    waves = ranged_record(bench, ranges, 10.0 + record_time)
    channels = list(ranges)
    told = [DigitizedChannel(str(c), waves[c].resolution, waves[c].clipped, waves[c].accuracy.gain) for c in channels]
    fit = fit_back_emf(
        waves[channels[0]].time,
        np.vstack([waves[channel].values for channel in channels]),
        harmonics=_HARMONICS,
        digitized=told,
    )
    found = [fit.fundamental(k) for k in range(len(channels))]
    return Fundamentals(
        tuple(f[0] for f in found),
        tuple(f[1] for f in found),
        tuple(fit.phases.tolist()),
        fit.electrical_speed,
        fit.flux_linkage,
        tuple(waves[c].accuracy for c in channels),
        tuple(waves[c].full_scale for c in channels),
        fit.misfit,
    )


def geometric_speeds(bench: Bench, nameplate: Nameplate, lowest: float, highest: float, count: int) -> list[float]:
    """Return speeds (rad/s), shares of the rated one, evenly spaced by their ratio, within what motor and dynamometer allow."""
    top = driving_speed_rad(bench, nameplate, highest)
    bottom = driving_speed_rad(bench, nameplate, min(lowest, highest))
    return [float(each) for each in np.geomspace(bottom, top, count)]


def pole_pairs_of(electrical: float, mechanical: float, known: float | None) -> int:
    """Return the pole pairs that electrical and mechanical speed (rad/s) show.

    Raises ProcedureError where their ratio is none, or not the known one.
    """
    ratio = electrical / mechanical
    pairs = round(ratio)
    if pairs < 1 or abs(ratio / max(pairs, 1) - 1.0) > 0.02 or (known is not None and pairs != round(known)):
        raise ProcedureError(
            text(
                "the EMF turns {ratio:.4g} times while the shaft turns once{known}: check the speed sensor, and "
                "run pole-pairs-back-emf",
                ratio=ratio,
                known="" if known is None else f" ({known:g})",
            )
        )
    return pairs


def torque_gain(unc: Uncertainties, accuracy: Accuracy, largest: float) -> UncertainReal:
    """Return one, uncertain as torques of a size (N·m) are; where only a share of full scale is stated, it may be a slope."""
    gain = accuracy.gain or (accuracy.offset / largest if largest else 0.0)
    return unc.instrument("dynamometer, torque", 1.0, Accuracy(gain=gain, source=accuracy.source))


def channels_gain(unc: Uncertainties, accuracies: Sequence[Accuracy]) -> UncertainReal:
    """Return one, uncertain as the mean of channels' readings is: the channels share a reference, which does not average out."""
    parts = [
        unc.instrument("oscilloscope, all channels", 1.0, Accuracy(gain=each.gain, source=each.source))
        for each in accuracies
    ]
    return sum(parts[1:], parts[0]) / len(parts)


def line(values: FloatArray | Sequence[float]) -> list[float]:
    """Return figures as a result's findings hold them."""
    return [float(each) for each in values]
