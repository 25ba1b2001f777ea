"""Readings at constant speed, and which location of the map each belongs to."""

from dataclasses import dataclass, fields

import numpy as np
from numpy.typing import ArrayLike, NDArray

from procedures.estimation.fitting.checks import same_length, series
from procedures.estimation.fitting.fit import EstimationError, FloatArray

#: Currents closer than this share of the largest are one location.
_ONE_LOCATION = 0.01
_LEAST = 8


@dataclass(frozen=True)
class FluxReadings:
    """Readings (n,): `time` (s), currents and voltages (A, V, peak) in the frame that the inverter's angle gives, electrical speed
    (rad/s, signed), the standard deviation of one voltage's and one current's noise, and the `session` each was taken in, counted from
    0: times of different sessions have nothing to do with each other.

    A noise of 0 for all means that it is not known: the fit's residuals say it.
    """

    time: FloatArray
    i_d: FloatArray
    i_q: FloatArray
    u_d: FloatArray
    u_q: FloatArray
    electrical_speed: FloatArray
    voltage_noise: FloatArray
    current_noise: FloatArray
    session: NDArray[np.intp]

    @classmethod
    def of(
        cls,
        time: ArrayLike,
        i_d: ArrayLike,
        i_q: ArrayLike,
        u_d: ArrayLike,
        u_q: ArrayLike,
        electrical_speed: ArrayLike,
        voltage_noise: ArrayLike = 0.0,
        current_noise: ArrayLike = 0.0,
        session: ArrayLike = 0,
    ) -> "FluxReadings":
        """Return readings of these values. Raises EstimationError where they are too few, not numbers, or no speed."""
        names = ("time", "i_d", "i_q", "u_d", "u_q", "electrical speed")
        values = (time, i_d, i_q, u_d, u_q, electrical_speed)
        arrays = [series(name, each, least=_LEAST) for name, each in zip(names, values, strict=True)]
        same_length(**dict(zip(names, arrays, strict=True)))
        still = np.flatnonzero(arrays[5] == 0.0)
        if still.size:
            raise EstimationError(
                f"reading {still[0]} was taken at standstill, where the voltage holds nothing of the flux; turn the shaft"
            )
        n = arrays[0].size
        noises = [np.broadcast_to(np.asarray(each, dtype=np.float64), n) for each in (voltage_noise, current_noise)]
        # Whatever they are numbered by, the earliest is 0.
        numbers = np.unique(np.broadcast_to(np.asarray(session, dtype=np.intp), n), return_inverse=True)[1]
        at, d, q, u_d, u_q, speed = arrays
        return cls(at, d, q, u_d, u_q, speed, noises[0], noises[1], numbers.astype(np.intp))

    def those(self, kept: NDArray[np.bool_]) -> "FluxReadings":
        """Return those of the readings that are kept (n,)."""
        return FluxReadings(*(getattr(self, each.name)[kept] for each in fields(self)))

    def sessions(self) -> list[NDArray[np.bool_]]:
        """Return which readings each session has (n,)."""
        return [self.session == number for number in range(int(np.max(self.session)) + 1)]

    def later_sessions(self) -> FloatArray:
        """Return for each session but the first 1 for its readings and 0 for all others (n, sessions − 1)."""
        return np.column_stack([*self.sessions()]).astype(np.float64)[:, 1:]

    @property
    def noise_stated(self) -> bool:
        """True if the noise of voltage or current is known beforehand."""
        return bool(np.any(self.voltage_noise) or np.any(self.current_noise))

    @property
    def current(self) -> NDArray[np.complex128]:
        """i_d + j·i_q (A)."""
        return self.i_d + 1j * self.i_q

    @property
    def voltage(self) -> NDArray[np.complex128]:
        """u_d + j·u_q (V)."""
        return self.u_d + 1j * self.u_q

    @property
    def largest_current(self) -> float:
        """Largest |i| of all readings (A)."""
        return float(np.max(np.abs(self.current)))


@dataclass(frozen=True)
class Locations:
    """The locations of the readings on the current plane: `points` (m, 2) in A, the point of each reading `of` (n,), and
    `mirrored` (n,), true for readings at its mirror image at −i_q.

    `asked` (n,) is the current i_d + j·i_q of each reading where it was asked for, which may lie beside its point by the tolerance;
    without it, that of its point.
    """

    points: FloatArray
    of: NDArray[np.intp]
    mirrored: NDArray[np.bool_]
    asked: NDArray[np.complex128] | None = None

    @property
    def zero(self) -> int | None:
        """The point without current; None where none was read."""
        found = np.flatnonzero(~np.any(self.points, axis=1))
        return int(found[0]) if found.size else None

    def currents(self) -> NDArray[np.complex128]:
        """Return each reading's point as i_d + j·i_q (n,), on the side where it was read."""
        at = self.points[self.of]
        return np.asarray(at[:, 0] + 1j * np.where(self.mirrored, -at[:, 1], at[:, 1]))


def locations_of(readings: FluxReadings, *, symmetric: bool, wanted: FloatArray | None = None) -> Locations:
    """Return the locations of readings: those within a hundredth of the largest current are one, and where `symmetric` their mirror
    images at −i_q too.

    `wanted` (n, 2) are the currents (A) that were asked for, at which the map is then given; without it, at the mean that was read.
    """
    near = _ONE_LOCATION * readings.largest_current
    asked = np.column_stack((readings.i_d, readings.i_q)) if wanted is None else np.asarray(wanted, dtype=np.float64)
    mirrored = (asked[:, 1] < -near) if symmetric else np.zeros(len(asked), dtype=bool)
    folded = np.column_stack((asked[:, 0], np.where(mirrored, -asked[:, 1], asked[:, 1])))
    members: list[list[int]] = []
    for k, place in enumerate(folded):
        away = folded[[group[0] for group in members]] - place
        found = np.flatnonzero(np.hypot(away[:, 0], away[:, 1]) <= near)
        if found.size:
            members[found[0]].append(k)
        else:
            members.append([k])
    of = np.empty(len(asked), dtype=np.intp)
    points = np.empty((len(members), 2))
    for m, group in enumerate(members):
        of[group] = m
        points[m] = folded[group].mean(axis=0)
    # What is off an axis by less than the tolerance is on it.
    points[np.abs(points) <= near] = 0.0
    return Locations(points, of, mirrored, None if wanted is None else asked[:, 0] + 1j * asked[:, 1])
