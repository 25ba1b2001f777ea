"""From readings at constant speed to the flux map: one weighted least squares of all of them."""

from collections.abc import Sequence
from dataclasses import dataclass, field
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray
from scipy import linalg

from procedures.estimation.fitting.fit import EstimationError, FloatArray
from procedures.estimation.flux.flux_map import GainLimits, MeasuredFluxMap, of_gains
from procedures.estimation.flux.reading_model import ReadingModel
from procedures.estimation.flux.readings import FluxReadings, Locations, locations_of
from procedures.estimation.flux.surface import FluxSurface, fit_surface

_ROUNDS = 8
#: A round that moves no flux linkage by more than this share of the largest is the last one.
_SETTLED = 1e-6
#: A fit whose flux linkages move by more than so many times the largest is lost.
_LOST = 100.0
#: Roughness is taken to be this many times what it shows on the whole, as it is larger here and there; modes below this share have none.
_ROUGHER, _NIL = 2.0, 1e-9


@dataclass(frozen=True)
class CommonUnknown:
    """One thing that all readings share: estimate and standard uncertainty (scatter) in its SI unit."""

    value: float
    uncertainty: float


@dataclass(frozen=True)
class SessionUnknowns:
    """The unknowns of one session alone: the angle's zero (rad), the mean resistance (Ω) and change of the magnet (V·s), and the
    relative difference of its voltage and current gains from those of the first session.
    """

    readings: int
    angle: CommonUnknown
    resistance: CommonUnknown
    magnet_change: CommonUnknown
    voltage_gain: CommonUnknown
    current_gain: CommonUnknown


@dataclass(frozen=True)
class MapFit:
    """Result of one least-squares fit of readings, before it is judged.

    `angle` (rad) is what the inverter's zero lies behind the magnet, `delay` (s) that of the voltages against the currents, `followed` the
    share of what was read beside the asked current that the voltages follow, the rest being its sensors' noise; `resistance`
    (n,) in Ω, with its standard uncertainty, and `magnet_change` (n,) in V·s are at the readings' times. `residuals` (2n,) are whitened,
    their squares are `cost`. `angle` is that of the first session; `sessions` tell each, where there are several, and
    `apart` (k, 2) by how much ψ at currents that were read again is other there, where it was left free.
    """

    map: MeasuredFluxMap
    locations: Locations
    surface: FluxSurface
    angle: CommonUnknown
    delay: CommonUnknown
    followed: CommonUnknown
    resistance: FloatArray
    resistance_uncertainty: FloatArray
    magnet_change: FloatArray
    residuals: FloatArray
    cost: float
    degrees_of_freedom: int
    sessions: Sequence[SessionUnknowns] = ()
    apart: FloatArray = field(default_factory=lambda: np.zeros((0, 2)))

    @property
    def variance_ratio(self) -> float:
        """The residuals' variance over what the stated noise makes: 1 where the readings are as the model says."""
        return self.cost / self.degrees_of_freedom


def fit_map(
    readings: FluxReadings,
    *,
    symmetric: bool,
    gains: GainLimits | None = None,
    wanted: FloatArray | None = None,
    unsure: bool = True,
    apart: bool = False,
) -> MapFit:
    """Return the least squares of readings with ψ free at each location, and with `apart` once more in a later session.

    Unless it is `unsure` of it, the smooth surface is taken as it is from a location to where magnets and iron move its readings; such
    fits may be compared by their costs. `wanted` (n, 2) as `locations_of` has it. Raises EstimationError where the readings do not
    determine the map.
    """
    locations = locations_of(readings, symmetric=symmetric, wanted=wanted)
    reference = float(np.min(readings.time[readings.session == 0]))
    model = ReadingModel(readings, locations, symmetric=symmetric, reference_time=reference, gains=gains, apart=apart)
    scale = float(np.max(np.abs(readings.voltage) / np.abs(readings.electrical_speed)))
    reached = _round(readings, model, model.start(), None, scale, unsure=unsure)
    for turn in range(1, _ROUNDS):
        reached = _round(
            readings, model, reached.unknowns, reached.surface, scale, reached.covariance, choose=turn == 1,
            unsure=unsure,
        )  # fmt: skip
        if not reached.moved < _LOST * scale:
            raise EstimationError(
                "the fit of all readings finds no end: their noise outweighs what they show. Read for more turns, at a higher speed or "
                "larger currents"
            )
        if turn > 2 and reached.moved < _SETTLED * scale:
            break
    predicted = model.predict(reached.unknowns, reached.surface)
    residuals = _white(reached.whitener, (readings.voltage - predicted.voltage)[:, None])[:, 0]
    return _result(model, reached, residuals, symmetric, gains or GainLimits())


class _Reached(NamedTuple):
    unknowns: FloatArray
    covariance: FloatArray
    surface: FluxSurface
    whitener: FloatArray
    prior: FloatArray
    moved: float


def _round(
    readings: FluxReadings,
    model: ReadingModel,
    unknowns: FloatArray,
    surface: FluxSurface | None,
    scale: float,
    known: FloatArray | None = None,
    *,
    choose: bool = True,
    unsure: bool,
) -> _Reached:
    """Solve the linearised least squares about the unknowns, and lay a surface through what it gives, choosing its coordinates anew."""
    predicted = model.predict(unknowns, surface)
    resistance = float(np.mean(model.resistance() @ unknowns[model.layout.resistance]))
    followed = float(np.clip(unknowns[model.layout.followed], 0.0, 1.0))
    around = model.locations.currents() if unsure else None
    whitener = _whitener(readings, surface, predicted.at, around, resistance, followed)
    # Before a first round nothing is known of the resistance but what the largest voltage has room for.
    room = 0.3 * float(np.max(np.abs(readings.voltage))) / readings.largest_current
    room = resistance if resistance > 0.0 else room
    prior = model.known_beforehand(scale, room, model.drop_size(None if known is None else unknowns, room))
    if known is not None and surface is not None:
        prior = np.vstack((prior, _smoothness(model, surface, unknowns, known)))
    data = _white(whitener, (readings.voltage - predicted.voltage)[:, None])[:, 0]
    step, covariance = _solve(_white(whitener, predicted.slopes), data, prior, unknowns)
    unknowns = unknowns + step
    points, variances = model.locations.points, _flux_variances(model, covariance)
    flux, like = model.flux(unknowns), None if choose else surface
    through = fit_surface(points, flux, symmetric=model.symmetric, variances=variances, like=like)
    moved = float(np.max(np.abs(step[: model.layout.resistance.start])))
    return _Reached(unknowns, covariance, through, whitener, prior, moved)


def _result(
    model: ReadingModel, reached: _Reached, residuals: FloatArray, symmetric: bool, gains: GainLimits
) -> MapFit:
    layout, points = model.layout, model.locations.points
    unknowns, covariance, surface, prior = reached.unknowns, reached.covariance, reached.surface, reached.prior
    # What is known beforehand counts as a reading as far as it decides an unknown.
    decided = float(np.einsum("rk,kl,rl->", prior, covariance, prior))
    freedom = residuals.size - layout.size + round(decided)
    if freedom < 1:
        raise EstimationError(
            f"{residuals.size} voltages do not suffice for {layout.size} unknowns: read some locations at both signs of i_q and of the "
            "speed, and zero current every few readings"
        )
    cost = float(residuals @ residuals)
    places = model.flux_places()
    of_map = np.zeros((2 * layout.locations, 2 * layout.locations))
    of_map[np.ix_(places, places)] = covariance[: places.size, : places.size]
    flux = model.flux(unknowns)
    shared = {
        **of_gains(points, flux, surface.slopes(points), voltage=gains.voltage, current=gains.current),
        "speed": -gains.speed * flux.ravel(),
        # At either speed a delay τ is −τ·R·i in ψ.
        "delay": -gains.delay * float(np.mean(model.resistance() @ unknowns[layout.resistance])) * points.ravel(),
    }
    shared = {name: each for name, each in shared.items() if np.any(each)}
    by_sessions = None
    if (other := model.of_later_sessions()).size:
        # What would not be there if it were known by how much the sessions differ.
        among = covariance[np.ix_(np.arange(places.size), other)]
        by_sessions = np.zeros_like(of_map)
        by_sessions[np.ix_(places, places)] = among @ np.linalg.solve(covariance[np.ix_(other, other)], among.T)
    estimate = MeasuredFluxMap(points, flux, of_map, symmetric, float(freedom), shared, by_sessions)

    def common(place: int) -> CommonUnknown:
        return CommonUnknown(float(unknowns[place]), float(np.sqrt(max(covariance[place, place], 0.0))))

    def series(rows: FloatArray, part: slice) -> tuple[FloatArray, FloatArray]:
        spread = np.einsum("nk,kl,nl->n", rows, covariance[part, part], rows)
        return np.asarray(rows @ unknowns[part]), np.sqrt(np.maximum(spread, 0.0))

    def mean(rows: FloatArray, part: slice, own: NDArray[np.bool_]) -> CommonUnknown:
        value, spread = series(np.mean(rows[own], axis=0, keepdims=True), part)
        return CommonUnknown(float(value[0]), float(spread[0]))

    def difference(part: slice, number: int) -> CommonUnknown:
        return common(part.start + number - 1) if number and part.stop > part.start else CommonUnknown(0.0, 0.0)

    sessions = model.sessions()
    told = [
        SessionUnknowns(
            int(np.count_nonzero(own)),
            common(layout.angles.start + number - 1 if number else layout.angle),
            mean(model.resistance(), layout.resistance, own),
            mean(model.magnet(), layout.magnet, own),
            difference(layout.voltage_gains, number),
            difference(layout.current_gains, number),
        )
        for number, own in enumerate(sessions)
    ]
    resistance, magnet = series(model.resistance(), layout.resistance), series(model.magnet(), layout.magnet)[0]
    return MapFit(
        estimate, model.locations, surface, common(layout.angle), common(layout.delay),
        common(layout.followed), *resistance, magnet,
        residuals, cost, freedom, told if len(sessions) > 1 else (), unknowns[layout.apart].reshape(-1, 2),
    )  # fmt: skip


def _whitener(
    readings: FluxReadings,
    surface: FluxSurface | None,
    at: FloatArray,
    around: NDArray[np.complex128] | None,
    resistance: float,
    followed: float,
) -> FloatArray:
    """Return what makes a reading's d and q residuals independent and of unit variance (n, 2, 2).

    From its location, where `around` says them, to where magnets and iron move a reading the surface may rise otherwise than it says.
    Of a current's noise that share stays which of its deviations is `followed`: where d is real and n noise, their sum tells d to
    within var(n)·var(d)/(var(d) + var(n)).
    """
    n = readings.time.size
    voltage, current = readings.voltage_noise, np.sqrt(followed) * readings.current_noise
    through = np.zeros((n, 2, 2)) if surface is None else surface.slopes(at)
    speed = readings.electrical_speed
    gain = resistance * np.eye(2) + np.stack((-through[:, 1] * speed[:, None], through[:, 0] * speed[:, None]), axis=1)
    floor = 1e-9 * float(np.max(np.abs(readings.voltage)))
    covariance = (voltage**2 + floor**2)[:, None, None] * np.eye(2)
    covariance = covariance + (current**2)[:, None, None] * (gain @ gain.transpose(0, 2, 1))
    if surface is not None and around is not None:
        places, nil = np.column_stack((around.real, around.imag)), np.zeros(n)
        rise = np.column_stack([each.spread(places, nil, at - places) for each in (surface.q, surface.d)])
        covariance = covariance + (speed[:, None] * rise)[:, :, None] ** 2 * np.eye(2)
    return np.asarray(np.linalg.inv(np.linalg.cholesky(covariance)))


def _white(whitener: FloatArray, columns: NDArray[np.complex128]) -> FloatArray:
    """Return complex rows (n, k) as whitened real ones (2n, k)."""
    parts = np.stack((columns.real, columns.imag), axis=1)
    return np.asarray((whitener @ parts).reshape(-1, columns.shape[1]))


def _solve(
    design: FloatArray, data: FloatArray, prior: FloatArray, unknowns: FloatArray
) -> tuple[FloatArray, FloatArray]:
    whole = np.vstack((design, prior))
    right = np.concatenate((data, -prior @ unknowns))
    scale = np.sqrt(np.einsum("nk,nk->k", whole, whole))
    scale[scale == 0.0] = 1.0
    # With the right side as a further column, Q need not be formed.
    both = np.column_stack((whole / scale, right))
    r = linalg.qr(both, mode="r", overwrite_a=True, check_finite=False)[0][: scale.size]
    r, turned = r[:, :-1], r[:, -1]
    sizes = np.abs(np.diag(r))
    if r.shape[0] < r.shape[1] or not float(np.min(sizes)) > 1e-10 * float(np.max(sizes)):
        raise EstimationError(
            "the readings do not determine flux linkages and what they share (resistance over time, drops, angle): read some locations "
            "at both signs of i_q and of the speed, and zero current every few readings"
        )
    inverse = linalg.solve_triangular(r, np.eye(r.shape[1]))
    covariance = inverse @ inverse.T / np.outer(scale, scale)
    return np.asarray(inverse @ turned / scale), np.asarray(covariance)


def _smoothness(model: ReadingModel, surface: FluxSurface, unknowns: FloatArray, covariance: FloatArray) -> FloatArray:
    """Return that flux linkages lie on a random field as rough as they show it: rows as `known_beforehand` gives them.

    Between its locations a map's roughness is far above the readings' noise, which leaves each flux linkage free; but what all readings
    share shows as a pattern of signs, of speed and of i_q, that no roughness has.
    """
    layout = model.layout
    result = []
    for spline, columns in (
        (surface.d, np.arange(layout.locations)),
        (surface.q, layout.locations + np.arange(layout.free_q.size)),
    ):
        rough = spline.roughness
        if spline is surface.q and rough.shape[0] > columns.size:
            # Where the frame has no ψ_q by definition.
            rough = rough[np.ix_(layout.free_q, layout.free_q)]
        sizes, modes = np.linalg.eigh(rough)
        kept = sizes > _NIL * float(np.max(sizes))
        values, known = unknowns[columns], covariance[np.ix_(columns, columns)]
        # Expectation and maximisation: what is not known of the values may be roughness as well.
        square = (float(values @ rough @ values) + float(np.sum(rough * known))) / float(np.count_nonzero(kept))
        rows = np.zeros((int(np.count_nonzero(kept)), layout.size))
        rows[:, columns] = (modes[:, kept] * np.sqrt(sizes[kept])).T / (_ROUGHER * np.sqrt(square))
        result.append(rows)
    return np.vstack(result)


def _flux_variances(model: ReadingModel, covariance: FloatArray) -> FloatArray:
    made = np.zeros(2 * model.layout.locations)
    places = model.flux_places()
    made[places] = np.diag(covariance)[: places.size]
    return made.reshape(-1, 2)
