"""Readings of one current at one speed that contradict each other: their voltages say it, whatever a surface foresees."""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from procedures.estimation.fitting.fit import FloatArray
from procedures.estimation.flux.map_fit import MapFit
from procedures.estimation.flux.readings import FluxReadings, Locations

#: Repeats contradict each other where one component differs by so many standard deviations, apart from what drifts between them.
_CONTRADICTS = 5.0
#: Or by this share of the largest voltage, which a fit would not survive.
_ROUGH = 0.05
#: Half-width of a location's interval, in shares of what its readings differ by, as a normal one of two standard uncertainties.
_WITHIN = 1.25


@dataclass(frozen=True)
class Contradiction:
    """Repeats of a location that contradict each other: the readings `left_out`, and by how many standard deviations at most.

    `apart` (2,) in V·s is by how much the flux linkages differ where nothing says which reading is right, and the first one stays;
    0 where more readings agree than are left out.
    """

    place: int
    left_out: NDArray[np.intp]
    score: float
    apart: FloatArray

    def widened(self, covariance: FloatArray, place: int) -> FloatArray:
        """Return a map's covariance (2n, 2n) with an interval at its location, now at a `place`, that holds each of the readings."""
        result = covariance.copy()
        here = np.array([2 * place, 2 * place + 1])
        result[here, here] += (0.5 * _WITHIN * self.apart) ** 2
        return result


def rough_repeats(readings: FluxReadings, locations: Locations) -> NDArray[np.bool_] | None:
    """Return the readings (n,) without the repeats, where the voltages of some differ by more than any fit survives; otherwise None.

    No fit is asked: it would find no end with such repeats.
    """
    groups = _repeats(readings, locations)
    if all(
        np.max(np.abs(readings.voltage[here] - readings.voltage[here[0]])) <= _rough(readings) for _, here in groups
    ):
        return None
    first = np.ones(readings.time.size, dtype=np.bool_)
    for _, here in groups:
        first[here[1:]] = False
    return first


def rough_contradiction(
    fit: MapFit, first: NDArray[np.bool_], readings: FluxReadings, locations: Locations
) -> Contradiction | None:
    """Return the repeats whose voltages contradict each other most, without what resistance and magnets drift by, which a fit of the
    `first` readings alone (n,) tells.
    """
    time, speed = readings.time, readings.electrical_speed
    drifts = []
    for drift in (fit.resistance, fit.magnet_change):
        course = np.zeros(time.size)
        for session in np.unique(readings.session):
            own, known = readings.session == session, readings.session[first] == session
            order = np.argsort(time[first][known])
            course[own] = np.interp(time[own], time[first][known][order], drift[known][order])
        drifts.append(course)
    steady = readings.voltage - drifts[0] * readings.current - 1j * speed * drifts[1]
    found = None
    for place, here in _repeats(readings, locations):
        apart = np.abs(steady[here][:, None] - steady[here]) * (_CONTRADICTS / _rough(readings))
        found = _worse(found, readings, place, here, apart)
    return found


def contradiction(fit: MapFit, readings: FluxReadings) -> Contradiction | None:
    """Return the repeats that contradict each other most; None where none do."""
    white, groups = fit.residuals.reshape(-1, 2), _repeats(readings, fit.locations)
    # What repeats differ by tells nothing of the noise here: one wild reading would hide itself.
    among = sum(float(np.sum((white[here] - white[here].mean(axis=0)) ** 2)) for _, here in groups)
    freedom = fit.degrees_of_freedom - sum(2 * (here.size - 1) for _, here in groups)
    noise = float(np.sqrt(max(fit.cost - among, 1e-300) / max(freedom, 1)))
    found = None
    for place, here in groups:
        apart = np.max(np.abs(white[here][:, None] - white[here]), axis=2) / (np.sqrt(2.0) * noise)
        found = _worse(found, readings, place, here, apart)
    return found


def _worse(
    than: Contradiction | None, readings: FluxReadings, place: int, here: NDArray[np.intp], apart: FloatArray
) -> Contradiction | None:
    """Return the contradiction of a location's readings that are so far `apart` (n, n), if they are and it is the worse one."""
    score = float(np.max(apart))
    if score <= _CONTRADICTS or (than is not None and score <= than.score):
        return than
    # The one that lies among the others; of those that agree with it some may contradict each other.
    middle = apart[int(np.argmin(np.sum(apart, axis=1)))]
    far = middle > min(_CONTRADICTS, 0.999 * float(np.max(middle)))
    if 2 * np.count_nonzero(far) < here.size:
        return Contradiction(place, here[far], score, np.zeros(2))
    voltage, speed = readings.voltage[here], readings.electrical_speed[here]
    differ = np.abs(voltage - voltage[0]) / np.abs(speed)
    return Contradiction(place, here[1:], score, np.full(2, float(np.max(differ))))


def _rough(readings: FluxReadings) -> float:
    return _ROUGH * float(np.max(np.abs(readings.voltage)))


def _repeats(readings: FluxReadings, locations: Locations) -> list[tuple[int, NDArray[np.intp]]]:
    """Return the locations that one session read several times, all at one sign of i_q and of the speed, with these readings."""
    of, side = locations.of, locations.mirrored
    found = []
    for place in np.flatnonzero(np.bincount(of) > 1).tolist():
        here = np.flatnonzero(of == place)
        ways = {(side[k], readings.electrical_speed[k] > 0.0, readings.session[k]) for k in here}
        if len(ways) == 1:
            found.append((place, here))
    return found
