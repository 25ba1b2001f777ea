"""Course of the current within a stroke, which only the voltage shows, and the uncertainty that remains."""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from procedures.estimation.fitting.fit import EstimationError
from procedures.estimation.flux.stroke_train import ComplexArray, StrokeTrain

#: The current's lag is known to this share where the flux's voltage leads by far, and so much less the less it leads; it is no more than
#: guessed where it leads by less than the second share of the lag.
_KNOWN, _LEADS = 0.02, 0.05


@dataclass(frozen=True)
class StrokeCourse:
    """By how much (s) currents lag behind the steps that they make in all, `lag`, and the flux's time constant beyond that, `lead`.

    A stroke's voltage less what the resistance takes at its end integrates to Δψ − R·Δi·lag: where a drive's loop is as slow as the
    winding by itself, the two are one, and where it is slower still, Δψ is the difference of two larger figures.
    """

    lag: float
    lead: float

    @property
    def half_width(self) -> float:
        """The half-width (s) of the lag, which a resistance makes a flux linkage of.

        Raises EstimationError where the voltages do not tell it.
        """
        if self.lead < _LEADS * self.lag:
            raise EstimationError(
                "the current settles no faster than the winding by itself would, so that the resistance hides what the flux linkages "
                "take of the voltage: raise the bandwidth of the drive's current loop, or measure at speed (flux-map)"
            )
        return _KNOWN * self.lag * (1.0 + self.lag / self.lead)


def stroke_course(trains: Sequence[StrokeTrain], charges: Sequence[ComplexArray], resistance: float) -> StrokeCourse:
    """Return the course of trains' currents, of the axis that leads least, by what their charges have found of it."""
    lags, leads, sizes, along_d = [], [], [], []
    for train, charge in zip(trains, charges, strict=True):
        taking = train.resisted(resistance)
        rotor = train.plateaus * np.exp(-1j * train.angle) if train.still else train.current
        ends = taking * rotor * np.exp(1j * train.angle)
        step, lasting = np.diff(ends), np.diff(train.time[train.places])
        settled = ends[1:] * lasting
        lags.append(np.real(np.conj(step) * (settled - taking * np.diff(charge))))
        leads.append(np.real(np.conj(step) * (np.diff(train.integral[train.places]) - settled)))
        sizes.append(np.abs(step) ** 2)
        change = np.diff(train.current)
        along_d.append(np.abs(change.real) > np.abs(change.imag))
    lag, lead, size, direct = (np.concatenate(each) for each in (lags, leads, sizes, along_d))
    found = [float(np.sum(lead[axis]) / np.sum(size[axis])) for axis in (direct, ~direct) if np.any(axis)]
    return StrokeCourse(max(float(np.sum(lag) / np.sum(size)), 0.0), min(found))
