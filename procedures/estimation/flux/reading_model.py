"""Model of a reading at constant speed for given flux linkages and given faults of bench and motor, with its derivatives."""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from procedures.estimation.fitting.fit import FloatArray
from procedures.estimation.flux.drop_shapes import COUNT as DROP_SHAPES
from procedures.estimation.flux.drop_shapes import drop_shapes
from procedures.estimation.flux.flux_map import GainLimits
from procedures.estimation.flux.readings import FluxReadings, Locations
from procedures.estimation.flux.sessions import MAGNET_KNOTS, in_blocks, repeated, slow_change, splines
from procedures.estimation.flux.surface import FluxSurface

ComplexArray = NDArray[np.complex128]

#: Between knots (s) of the winding's resistance over time.
_RESISTANCE_KNOTS = 80.0
#: What is known beforehand (standard deviations): by how much the resistance bends from knot to knot, in shares of it; drops in shares of
#: the largest voltage, angles in rad, iron's current in shares of the largest one, the magnet in shares of the largest flux linkage,
#: the share of a read deviation that is real.
_BEND, _DROP, _ANGLE, _IRON, _MAGNET, _FOLLOWED = 0.05, 0.2, 0.1, 0.05, 0.05, 1.0
#: The least that is taken for what drops in all may be, in shares of the largest voltage and of what the resistance has of it.
_LITTLE, _OF_RESISTANCE = 1e-3, 0.25
#: Above this ratio of speeds, hysteresis and eddy currents are told apart.
_TWO_SPEEDS = 1.2
#: Two limits of error, rectangular, differ by so much of one (standard deviation).
_TWO_LIMITS = float(np.sqrt(2.0 / 3.0))


@dataclass(frozen=True)
class UnknownsLayout:
    """The order of the unknowns: ψ_d of each location, ψ_q of those where it is free, the unknowns that all readings share, then
    those of each later session: the angle's zero, the differences of its voltage and current gains, and its flux linkages at
    repeated currents if requested.
    """

    locations: int
    free_q: NDArray[np.intp]
    resistance: slice
    drop: slice
    angle: int
    delay: int
    iron: slice
    magnet: slice
    followed: int
    angles: slice
    voltage_gains: slice
    current_gains: slice
    apart: slice
    size: int


@dataclass(frozen=True)
class Predicted:
    """Voltages (n,) that the unknowns give, their derivatives (n, k), and the currents (n, 2) at which the iron is."""

    voltage: ComplexArray
    slopes: ComplexArray
    at: FloatArray


class ReadingModel:
    """u = e^(−jωτ)·[R(t)·i + f(|i|)·i/|i| + jω·e^(−jε)·ψ(e^(jε)·i − iron + magnet)], all as read.

    i is the current that was asked for, or the location's, and a share, common to all readings, of what was read beside it: a regulator
    that misses its set-point moves the flux (1), a sensor's noise does not (0), and the voltages tell which.
    `reference_time` (s), of the first session, is when the magnet is as the map shall show it. Source: the machine's equations in the
    rotor's frame; the iron's current is (k_h + k_e·|ω|)·sign(ω)·jψ, a change of the magnet's flux Δλ a shift of i_d by Δλ/L_d(0).
    A later session has R, ε and magnet of its own, and gains that may differ from the first one's as far as `gains` has limits for them;
    with `apart` its flux linkages at the currents that were read before are its own as well.
    """

    def __init__(
        self,
        readings: FluxReadings,
        locations: Locations,
        *,
        symmetric: bool,
        reference_time: float,
        gains: GainLimits | None = None,
        apart: bool = False,
    ) -> None:
        self._readings = readings
        self.locations, self.symmetric = locations, symmetric
        time, count = readings.time, readings.time.size
        self._speed = readings.electrical_speed
        self._largest, self._largest_voltage = readings.largest_current, float(np.max(np.abs(readings.voltage)))
        # Noise of a current sensor drives nothing through a switch; beside its location a current that was asked for does.
        self._places = locations.currents()
        self._at = self._places if locations.asked is None else locations.asked
        size = np.abs(self._at)
        self._direction = self._at / np.where(size > 0.0, size, 1.0)
        self._gains = gains or GainLimits()
        self._later = readings.later_sessions()
        self._apart = repeated(readings.session, locations) if apart else []
        self._resistance = in_blocks(
            readings.session,
            [splines(time[own], _RESISTANCE_KNOTS, int(np.count_nonzero(own))) for own in readings.sessions()],
        )
        self._drops = drop_shapes(size, self._largest)
        first, *others = readings.sessions()
        magnet = splines(np.append(time[first], reference_time), MAGNET_KNOTS, int(np.count_nonzero(first)))
        # What the splines have in common is the map itself.
        own = [(magnet[:-1] - magnet[-1])[:, 1:], *(slow_change(time[other]) for other in others)]
        self._magnet = in_blocks(readings.session, own)
        self._first_magnet = own[0].shape[1]
        fastest, slowest = np.max(np.abs(self._speed)), np.min(np.abs(self._speed))
        self._iron = np.sign(self._speed)[:, None] * np.ones((count, 1))
        if fastest > _TWO_SPEEDS * slowest:
            self._iron = np.column_stack((self._iron[:, 0], self._speed / fastest))
        self.layout = self._lay_out()
        self._sign_q = np.where(locations.mirrored, -1.0, 1.0)

    def _lay_out(self) -> UnknownsLayout:
        points = self.locations.points
        # The d axis is where the magnet is, or where the motor is symmetric about.
        nil = (points[:, 1] == 0.0) if self.symmetric else ~np.any(points, axis=1)
        free_q = np.flatnonzero(~nil)
        edges = np.cumsum(
            [
                len(points) + free_q.size,
                self._resistance.shape[1],
                DROP_SHAPES,
                1,
                1,
                self._iron.shape[1],
                self._magnet.shape[1],
                1,
                self._later.shape[1],
                self._later.shape[1] if self._gains.voltage > 0.0 else 0,
                self._later.shape[1] if self._gains.current > 0.0 else 0,
                2 * len(self._apart),
            ]
        ).tolist()
        return UnknownsLayout(
            len(points), free_q, slice(edges[0], edges[1]), slice(edges[1], edges[2]), edges[2], edges[3],
            slice(edges[4], edges[5]), slice(edges[5], edges[6]), edges[6], slice(edges[7], edges[8]),
            slice(edges[8], edges[9]), slice(edges[9], edges[10]), slice(edges[10], edges[11]), edges[11],
        )  # fmt: skip

    def of_later_sessions(self) -> NDArray[np.intp]:
        """Return which unknowns say what is other in a later session: magnet, angle's zero, gains."""
        layout = self.layout
        magnet = np.arange(layout.magnet.start + self._first_magnet, layout.magnet.stop)
        return np.concatenate((magnet, np.arange(layout.angles.start, layout.current_gains.stop)))

    def start(self) -> FloatArray:
        """Return unknowns to begin with."""
        return np.zeros(self.layout.size)

    def flux(self, unknowns: FloatArray) -> FloatArray:
        """Return the flux linkages (m, 2) of the locations."""
        result = np.zeros((self.layout.locations, 2))
        result[:, 0] = unknowns[: self.layout.locations]
        result[self.layout.free_q, 1] = unknowns[self.layout.locations : self.layout.resistance.start]
        return result

    def flux_places(self) -> NDArray[np.intp]:
        """Return for the unknowns that are flux linkages their places in `flux`, laid out in a row."""
        return np.concatenate((2 * np.arange(self.layout.locations), 2 * self.layout.free_q + 1))

    def resistance(self) -> FloatArray:
        """Return what each of its unknowns counts for the resistance at the readings (n, k)."""
        return self._resistance

    def magnet(self) -> FloatArray:
        """Return what each of its unknowns counts for the change of the magnet's flux linkage at the readings (n, k)."""
        return np.asarray(self._magnet)

    def sessions(self) -> list[NDArray[np.bool_]]:
        """Return which readings each session has (n,)."""
        return self._readings.sessions()

    def predict(self, unknowns: FloatArray, surface: FluxSurface | None) -> Predicted:
        """Return the voltages that the unknowns give; `surface` tells how the flux changes about each location."""
        layout, speed = self.layout, self._speed
        deviation = self._readings.current - self._at
        current = self._at + unknowns[layout.followed] * deviation
        more_current = 1.0 + self._of_later(unknowns, layout.current_gains)
        more_voltage = 1.0 + self._of_later(unknowns, layout.voltage_gains)
        angle = unknowns[layout.angle] * (1.0 - np.sum(self._later, axis=1)) + self._of_later(unknowns, layout.angles)
        turn, late = np.exp(-1j * angle), more_voltage * np.exp(-1j * speed * unknowns[layout.delay])
        current = more_current * current
        true = current / turn
        at_location = self._flux_at_locations(unknowns)
        shift = self._magnet @ unknowns[layout.magnet]
        if surface is None:
            flux, inductance, at = at_location, np.zeros((current.size, 2, 2)), true
            per_flux = 0.0
        else:
            per_flux = 1.0 / max(float(surface.slopes(np.zeros((1, 2)))[0, 0, 0]), 1e-12)
            iron = self._iron @ unknowns[layout.iron]
            at = true - 1j * iron * at_location + per_flux * shift
            places = np.column_stack((at.real, at.imag))
            inductance = surface.slopes(places)
            change = surface(places) - surface(np.column_stack((self._places.real, self._places.imag)))
            flux = at_location + change[:, 0] + 1j * change[:, 1]
        voltage = self._resistance @ unknowns[layout.resistance] * current
        voltage = voltage + self._drops @ unknowns[layout.drop] * self._direction
        through = 1j * speed * turn * late
        slopes = np.zeros((current.size, layout.size), dtype=np.complex128)
        rows = np.arange(current.size)
        slopes[rows, self.locations.of] = through
        place_q = np.full(layout.locations, -1)
        place_q[layout.free_q] = layout.locations + np.arange(layout.free_q.size)
        column = place_q[self.locations.of]
        has = column >= 0
        slopes[rows[has], column[has]] = (1j * self._sign_q * through)[has]
        slopes[:, layout.resistance] = self._resistance * (current * late)[:, None]
        slopes[:, layout.drop] = self._drops * (self._direction * late)[:, None]
        of_angle = through * (-1j * flux + _act(inductance, 1j * true))
        slopes[:, layout.angle] = of_angle * (1.0 - np.sum(self._later, axis=1))
        slopes[:, layout.angles] = of_angle[:, None] * self._later
        slopes[:, layout.delay] = -1j * speed * (late * voltage + through * flux)
        slopes[:, layout.iron] = (through * _act(inductance, -1j * at_location))[:, None] * self._iron
        slopes[:, layout.magnet] = (through * _act(inductance, np.full_like(true, per_flux)))[:, None] * self._magnet
        resisted = self._resistance @ unknowns[layout.resistance] * deviation * late
        slopes[:, layout.followed] = resisted + through * _act(inductance, deviation / turn)
        predicted = late * voltage + through * flux
        if layout.voltage_gains.stop > layout.voltage_gains.start:
            slopes[:, layout.voltage_gains] = predicted[:, None] * self._later
        if layout.current_gains.stop > layout.current_gains.start:
            moved = late * (self._resistance @ unknowns[layout.resistance]) * current + through * _act(inductance, true)
            slopes[:, layout.current_gains] = moved[:, None] * self._later
        for number, own in enumerate(self._apart):
            place = layout.apart.start + 2 * number
            slopes[own, place] = through[own]
            slopes[own, place + 1] = (1j * self._sign_q * through)[own]
        return Predicted(predicted, slopes, np.column_stack((at.real, at.imag)))

    def drop_size(self, unknowns: FloatArray | None, resistance: float) -> FloatArray:
        """Return what each drop may be (V, standard deviation), by the unknowns of a fit before and the resistance (Ω).

        One knee may have all of what drops: where the fit before gives one more than its share, it may be as large as that. One near the
        largest current looks like a resistance.
        """
        if unknowns is None:
            return np.full(DROP_SHAPES, _DROP * self._largest_voltage)
        drops = unknowns[self.layout.drop]
        like = _OF_RESISTANCE * resistance * self._largest
        share = max(float(np.linalg.norm(drops)), like, _LITTLE * self._largest_voltage) / float(np.sqrt(DROP_SHAPES))
        # Whatever rises ever less has no weight below zero.
        return np.maximum(share, drops)

    def known_beforehand(self, flux_scale: float, resistance: float, drop: FloatArray) -> FloatArray:
        """Return what is known of the unknowns without readings: rows (r, k) whose products with them are 0 with a standard uncertainty
        of 1; each drop to its `drop` (V).
        """
        layout = self.layout
        spread = np.full(layout.size, np.inf)
        spread[layout.drop] = drop
        spread[layout.angle] = _ANGLE
        spread[layout.delay] = _ANGLE / float(np.max(np.abs(self._speed)))
        spread[layout.iron] = _IRON * self._largest / flux_scale
        spread[layout.magnet] = _MAGNET * flux_scale
        spread[layout.followed] = _FOLLOWED
        spread[layout.angles] = _ANGLE
        spread[layout.voltage_gains] = _TWO_LIMITS * self._gains.voltage
        spread[layout.current_gains] = _TWO_LIMITS * self._gains.current
        rows = [np.diag(1.0 / spread)[np.isfinite(spread)]]
        for own in self._readings.sessions() if resistance > 0.0 else ():
            places = layout.resistance.start + np.flatnonzero(np.any(self._resistance[own] != 0.0, axis=0))
            bends = np.zeros((places.size - 2, layout.size))
            bends[:, places] = np.diff(np.eye(places.size), 2, axis=0) / (_BEND * resistance)
            rows.append(bends)
        return np.vstack(rows)

    def _of_later(self, unknowns: FloatArray, part: slice) -> FloatArray:
        """Return what each reading has of an unknown of the later sessions (n,): 0 in the first, and where there is none."""
        return self._later @ unknowns[part] if part.stop > part.start else np.zeros(self._speed.size)

    def _flux_at_locations(self, unknowns: FloatArray) -> ComplexArray:
        flux = self.flux(unknowns)[self.locations.of]
        for number, own in enumerate(self._apart):
            flux[own] += unknowns[self.layout.apart][2 * number : 2 * number + 2]
        return np.asarray(flux[:, 0] + 1j * self._sign_q * flux[:, 1])


def _act(inductance: FloatArray, current: ComplexArray) -> ComplexArray:
    """Return the change of flux linkage that a small complex current makes."""
    d = inductance[:, 0, 0] * current.real + inductance[:, 0, 1] * current.imag
    q = inductance[:, 1, 0] * current.real + inductance[:, 1, 1] * current.imag
    return np.asarray(d + 1j * q)
