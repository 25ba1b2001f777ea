"""Checks a given table of flux linkages: holes, exchanged axes, wrong signs, another d axis, rms values, computed torque."""

import math
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from procedures.estimation.fitting.fit import EstimationError, FloatArray
from procedures.estimation.fitting.misfit import Answer, Cause, Finding, Misfit
from procedures.estimation.flux.flux_map import GainLimits, MeasuredFluxMap
from procedures.estimation.flux.surface import FluxSurface, fit_surface

#: More rows are no measurement, and would take minutes.
MOST_ROWS = 1200
_LEAST = 12
#: Odd parts below this share of the largest flux linkage are none.
_SYMMETRIC = 2e-3
#: Less flux at zero current, in shares of the largest, points nowhere.
_NO_MAGNET = 0.02
#: A magnet further off the d axis than this (degrees) lies on another one.
_OTHER_AXIS = 45.0
#: A turn (degrees) and a wrong resistance (share of ψ) that are worth saying.
_TURN, _REMAINDER = 0.2, 2e-3
#: A turn (degrees) from which on flux linkages are so much another axis' that they are not given: 0.4 % of ψ_d, 9 % of it in ψ_q.
_TURNED_FAR = 5.0
#: More current (A) and flux linkage (V·s) than any motor has.
_MOST_CURRENT, _MOST_FLUX = 1e5, 1e3
#: Zero current is this close (share of the largest current), or among the rows.
_NEAR_ZERO = 0.1
#: A row this close to zero current (share of the largest) shows the magnets.
_AT_ZERO = 0.02
#: Currents this close (share of the largest) are the same: what lies between their flux linkages is noise, which a surface must not follow.
_SAME = 2e-3
#: Rows at one current that differ from their mean by more (share of the largest flux linkage) are not of one state of a motor.
_REPEATS = 0.03
#: Standard deviation of normal values over the median of their size.
_NORMAL = 1.4826
#: A row this much farther (times any row elsewhere, share of the largest flux linkage) off the quadratic through its neighbours is odd.
_ODD, _ODD_SHARE, _NEIGHBOURS = 2.5, 0.03, 14
#: A torque column this even over that of the fluxes (relative scatter) was computed.
_COMPUTED = 2e-4
#: Or where no row is farther off than rounding to a step of so much of the largest torque.
_ROUNDED = 0.01
#: A ratio of torques counts as a factor within this; one that no factor of the torque alone explains is a gain of the flux linkages up to
#: that share.
_RATIO, _GAIN = 0.08, 0.25
#: Factors of the torque alone: poles for pole pairs, and units.
_OF_TORQUE = (0.5, 1e-3, 1e3)
#: By 95 % of its half-width a limit of error is in an interval; so much more holds what a known one does to a figure.
_WHOLE = 1.1


@dataclass(frozen=True)
class PublishedMap:
    """A table as a map, and what was found of it.

    `map` is folded to i_q ≥ 0 where it is symmetric. `turn` (rad) is by what the magnet is off the d axis, `resistance_remainder`
    (Ω·s) the ΔR/ω that its reciprocity shows; both stand in the table as they were. `torque_ratio` is the torque column over the
    flux linkages' torque, None without one; gains that it shows are in the map. `repeated` rows stand at currents that an earlier
    row has: the map has the means of such.
    """

    map: MeasuredFluxMap
    turn: float
    resistance_remainder: float
    reciprocity: float
    torque_ratio: float | None
    misfit: Misfit
    repeated: int = 0


def read_map(
    points: FloatArray,
    flux: FloatArray,
    *,
    uncertainty: FloatArray | None = None,
    torque: FloatArray | None = None,
    pole_pairs: float | None = None,
    gains: GainLimits | None = None,
) -> PublishedMap:
    """Return a table of currents (n, 2) in A and flux linkages (n, 2) in V·s as a map, with what contradicts itself in it.

    `uncertainty` (n, 2) is standard; without it the scatter round a smooth surface counts. `torque` (n,) in N·m is the table's own column.
    Raises EstimationError for too few or too many rows, or rows on one line.
    """
    whole = np.all(np.isfinite(points), axis=1) & np.all(np.isfinite(flux), axis=1)
    findings: list[Finding] = []
    holes = _holes(points[whole], len(points) - int(np.count_nonzero(whole)))
    if holes:
        findings.append(_finding(Cause.MAP_HOLES, Answer.WIDENED, {"holes": float(holes), "rows": float(len(points))}))
    points, flux = points[whole], flux[whole]
    torque = None if torque is None else torque[whole]
    spread = None if uncertainty is None else uncertainty[whole]
    _check_count(len(points))
    _check_reach(points, flux)
    first, of = _distinct(points)
    repeated = len(points) - first.size
    noise = np.zeros(2)
    if repeated:
        _check_count(first.size)
        mean_flux = _means(flux, of)
        _check_repeats(flux - mean_flux[of], mean_flux)
        noise = np.sqrt(np.sum((flux - mean_flux[of]) ** 2, axis=0) / repeated)
        points, flux = _means(points, of), mean_flux
        torque = None if torque is None else _means(torque, of)
        spread = None if spread is None else _means(spread, of)
    odd = _odd_row(points, flux)
    if odd is not None:
        # Rows without numbers are counted too.
        figures: dict[str, float | str] = {
            "number": float(np.flatnonzero(whole)[first[odd]] + 1),
            "i_d": float(points[odd, 0]),
            "i_q": float(points[odd, 1]),
        }
        findings.append(_finding(Cause.ODD_READING, Answer.WIDENED, figures))
    findings += _orientation(points, flux)
    symmetric, folded = _folded(points, flux, spread)
    at, values, sigma = folded
    surface = fit_surface(at, values, symmetric=symmetric)
    if sigma is None:
        sigma = np.broadcast_to(np.maximum(_scatter(surface, at, values), noise), values.shape)
    gains = gains or GainLimits()
    ratio: float | None = None
    if torque is not None and pole_pairs is not None:
        ratio, of_torque = _torque(points, flux, torque, pole_pairs)
        findings += of_torque
        if any(each.answer is Answer.WIDENED for each in of_torque):
            gains = replace(gains, voltage=gains.voltage + _WHOLE * abs(ratio - 1.0))
    shared = _shared(gains, at, values, surface.slopes(at))
    result = MeasuredFluxMap(at, values, np.diag(sigma.ravel() ** 2), symmetric, shared=shared)
    slopes = surface.slopes(at)
    apart = slopes[:, 0, 1] - slopes[:, 1, 0]
    remainder = 0.0 if symmetric else 0.5 * float(np.median(apart))
    zero = surface(np.zeros((1, 2)))[0]
    scale = result.full_scale
    turn = float(np.arctan2(zero[1], zero[0])) if np.hypot(*zero) > _NO_MAGNET * scale else 0.0
    contradictory = any(f.answer is Answer.WITHHELD for f in findings)
    if not contradictory and abs(math.degrees(turn)) > _TURN:
        answer = Answer.WIDENED if abs(math.degrees(turn)) < _TURNED_FAR else Answer.WITHHELD
        findings.append(_finding(Cause.MAP_TURNED, answer, {"angle": math.degrees(turn)}))
        shared |= {"angle": _turned_back(turn, at, values, surface)}
        result = replace(result, shared=shared)
    if not contradictory and abs(remainder) * result.largest_current > _REMAINDER * scale:
        share = abs(remainder) * result.largest_current / scale
        findings.append(_finding(Cause.RESISTANCE_LEFT, Answer.WIDENED, {"remainder": remainder, "share": share}))
    reciprocity = float(np.sqrt(np.mean(apart**2)))
    return PublishedMap(result, turn, remainder, reciprocity, ratio, Misfit(tuple(findings)), repeated)


def _check_count(rows: int) -> None:
    """Raise EstimationError for fewer currents than carry a map, or more rows than are taken."""
    if not _LEAST <= rows <= MOST_ROWS:
        raise EstimationError(
            f"{rows} rows with numbers at different currents; from {_LEAST} to {MOST_ROWS} are taken, thin the table out or add rows"
        )


def _distinct(points: FloatArray) -> tuple[NDArray[np.intp], NDArray[np.intp]]:
    """Return the first row at each of the currents, and for each row to which of them it belongs."""
    near = _SAME * float(np.max(np.hypot(*points.T)))
    first: list[int] = []
    of = np.zeros(len(points), dtype=np.intp)
    for row, point in enumerate(points):
        apart = np.hypot(*(points[first] - point).T)
        if first and float(np.min(apart)) <= near:
            of[row] = int(np.argmin(apart))
        else:
            of[row] = len(first)
            first.append(row)
    return np.array(first, dtype=np.intp), of


def _means(values: FloatArray, of: NDArray[np.intp]) -> FloatArray:
    """Return the means (m, …) of the rows that belong to each of the currents."""
    count = np.bincount(of)
    total = np.zeros((count.size, *values.shape[1:]))
    np.add.at(total, of, values)
    return np.asarray(total / count.reshape(-1, *(1,) * (values.ndim - 1)))


def _check_repeats(apart: FloatArray, flux: FloatArray) -> None:
    """Raise EstimationError where rows at one current differ by more than a motor's change of temperature makes."""
    share = float(np.max(np.hypot(*apart.T))) / float(np.max(np.hypot(*flux.T)))
    if share > _REPEATS:
        raise EstimationError(
            f"rows at the same currents differ from their mean by up to {100.0 * share:.2g} % of the largest flux linkage: give the rows "
            "of one motor at one temperature"
        )


def _finding(cause: Cause, answer: Answer, figures: dict[str, float | str]) -> Finding:
    return Finding(cause, answer, ("flux_map",), 0.0, figures)


def _holes(points: FloatArray, missing: int) -> int:
    """Return how many places of a table's grid hold nothing: rows without numbers, and currents inside that no row has."""
    if not on_grid(points):
        return missing
    i_d, i_q = (np.unique(np.round(points[:, k], 6)) for k in (0, 1))
    there = {(round(d, 6), round(q, 6)) for d, q in points.tolist()}
    absent = 0
    for d in i_d:
        row = sorted(q for each, q in there if each == round(float(d), 6))
        # Beyond a row's ends is a circle's edge, not a hole.
        absent += (
            sum(row[0] < q < row[-1] and (round(float(d), 6), round(float(q), 6)) not in there for q in i_q)
            if row
            else 0
        )
    return max(absent, missing)


def _check_reach(points: FloatArray, flux: FloatArray) -> None:
    """Raise EstimationError for figures that no motor has, currents on one line, or none near zero."""
    size, scale = np.hypot(*points.T), float(np.max(np.hypot(*flux.T)))
    most = float(np.max(size))
    if most > _MOST_CURRENT or scale > _MOST_FLUX:
        raise EstimationError(
            f"currents reach {most:.3g} A and flux linkages {scale:.3g} V·s; at most {_MOST_CURRENT:g} A and {_MOST_FLUX:g} V·s are taken: "
            "look at the units"
        )
    spread = np.linalg.svd(points - np.mean(points, axis=0), compute_uv=False)
    if not spread[1] > 1e-3 * spread[0]:
        raise EstimationError("all currents lie on one line of the dq plane; rows over both i_d and i_q are needed")
    within = np.all((np.min(points, axis=0) <= 0.0) & (np.max(points, axis=0) >= 0.0))
    if not within and float(np.min(size)) > _NEAR_ZERO * most:
        raise EstimationError(
            f"the current nearest to zero is {np.min(size):.3g} A, the largest {most:.3g} A: the magnets' flux linkage, by which axes and "
            "signs are told, is not among them; add rows near zero current"
        )


def _odd_row(points: FloatArray, flux: FloatArray) -> int | None:
    """Return the row farthest off the quadratic surface through its neighbours, where it is far off by itself; None where none is."""
    if len(points) < 2 * _NEIGHBOURS:
        return None
    span = np.ptp(points, axis=0)
    away = np.zeros(len(points))
    for row, point in enumerate(points):
        x = (points - point) / span
        near = np.argsort(np.hypot(*x.T))[1 : _NEIGHBOURS + 1]
        d, q = x[near].T
        around = np.sort(np.arctan2(q, d))
        if np.max(np.diff(around, append=around[0] + 2.0 * np.pi)) >= np.pi:
            # At the table's edge its neighbours are on one side, and say little of it.
            continue
        design = np.column_stack((np.ones_like(d), d, q, d * d, d * q, q * q))
        away[row] = np.hypot(*(flux[row] - np.linalg.lstsq(design, flux[near], rcond=None)[0][0]))
    worst = int(np.argmax(away))
    # A row that is off has its neighbours off too; where the surface bends, others far from there are as well.
    apart = np.argsort(np.hypot(*((points - points[worst]) / span).T))[_NEIGHBOURS + 1 :]
    far = max(_ODD * float(np.max(away[apart])), _ODD_SHARE * float(np.max(np.hypot(*flux.T))))
    return worst if away[worst] > far else None


def _orientation(points: FloatArray, flux: FloatArray) -> list[Finding]:
    """Return what the mean slopes and the magnet's place say of axes and signs."""
    design = np.column_stack((np.ones(len(points)), points))
    _, *slopes = np.linalg.lstsq(design, flux, rcond=None)[0]
    inductance = np.array(slopes).T
    on_axes, across = np.abs(np.diag(inductance)), np.abs([inductance[0, 1], inductance[1, 0]])
    mean = 0.5 * (inductance + inductance.T)
    sizes = np.linalg.eigvalsh(mean)
    if float(np.min(across)) > float(np.max(on_axes)):
        return [
            _finding(
                Cause.AXES_SWAPPED, Answer.WITHHELD, {"across": float(np.min(across)), "along": float(np.max(on_axes))}
            )
        ]
    if sizes[1] < 0.0:
        return [_finding(Cause.CURRENTS_OUTWARD, Answer.WITHHELD, {"largest": float(sizes[1])})]
    if sizes[0] < 0.0:
        axis = "q" if inductance[1, 1] < inductance[0, 0] else "d"
        return [
            _finding(
                Cause.SIGN_REVERSED, Answer.WITHHELD, {"axis": axis, "inductance": float(np.min(np.diag(inductance)))}
            )
        ]
    scale = float(np.max(np.hypot(*flux.T)))
    size = np.hypot(*points.T)
    zero = flux[np.argmin(size)]
    if float(np.min(size)) >= _AT_ZERO * float(np.max(size)):
        # A plane through all rows would lie beside it where q saturates and only one side of it is there.
        zero = fit_surface(points, flux, symmetric=False)(np.zeros((1, 2)))[0]
    if np.hypot(*zero) < _NO_MAGNET * scale:
        return []
    angle = math.degrees(math.atan2(zero[1], zero[0]))
    if abs(angle) > 180.0 - _OTHER_AXIS:
        return [_finding(Cause.TURNED_180, Answer.WITHHELD, {"psi_d": float(zero[0])})]
    if abs(angle) > _OTHER_AXIS:
        return [_finding(Cause.OTHER_D_AXIS, Answer.WITHHELD, {"angle": angle})]
    return []


_Folded = tuple[FloatArray, FloatArray, FloatArray | None]


def _folded(points: FloatArray, flux: FloatArray, spread: FloatArray | None) -> tuple[bool, _Folded]:
    """Tell whether ψ_d is even and ψ_q odd in i_q, and return the half with i_q ≥ 0, both sides' mean; all rows where it is not."""
    size = float(np.max(np.hypot(*points.T)))
    if np.all(points[:, 1] <= 1e-6 * size):
        points, flux = points * [1.0, -1.0], flux * [1.0, -1.0]
    mirror = np.hypot(*(points[:, None, :] - (points * [1.0, -1.0])[None, :, :]).transpose(2, 0, 1))
    partner, apart = np.argmin(mirror, axis=1), np.min(mirror, axis=1)
    # A row beside the d axis whose image is nearest to itself stands for that axis: measured currents are never exactly zero.
    alone = partner == np.arange(len(points))
    upper = (points[:, 1] >= -1e-6 * size) | alone
    everything = (points, flux, spread)
    if np.any(apart[upper] > 1e-3 * size):
        one_sided = bool(np.all(points[:, 1] >= -1e-6 * size))
        # One side only: nothing says what the other is like, and the d axis tells whether it can be symmetric.
        on_axis = np.abs(points[:, 1]) <= 1e-6 * size
        even = one_sided and bool(np.all(np.abs(flux[on_axis, 1]) < _SYMMETRIC * np.max(np.abs(flux))))
        if not even:
            return False, everything
        cleared = flux.copy()
        cleared[on_axis, 1] = 0.0
        return True, (np.where(np.abs(points) <= 1e-6 * size, 0.0, points), cleared, spread)
    other = flux[partner] * [1.0, -1.0]
    odd = 0.5 * (flux - other)[upper]
    if float(np.sqrt(np.mean(odd**2))) > _SYMMETRIC * float(np.max(np.hypot(*flux.T))):
        return False, everything
    mean = 0.5 * (flux + other)[upper]
    at = 0.5 * (points + points[partner] * [1.0, -1.0])[upper]
    at = np.where(np.abs(at) <= 1e-6 * size, 0.0, at)
    mean[at[:, 1] == 0.0, 1] = 0.0
    return True, (at, mean, None if spread is None else spread[upper])


def _scatter(surface: FluxSurface, at: FloatArray, values: FloatArray) -> FloatArray:
    """Return the rows' scatter (V·s) in ψ_d and ψ_q: a surface through every row leaves nothing, what the other rows say of each does."""
    left = np.sqrt(np.mean((values - surface(at)) ** 2, axis=0))
    # At a table's edge the others say little: the median leaves that out.
    others = [_NORMAL * float(np.median(np.abs(each.left_out))) for each in (surface.d, surface.q)]
    return np.maximum(left, others)


def on_grid(points: FloatArray) -> bool:
    """Tell whether currents (n, 2) are the set points of a grid, rather than readings: few values, each of them in many rows."""
    i_d, i_q = (np.unique(np.round(points[:, k], 6)) for k in (0, 1))
    return i_d.size * i_q.size <= 2 * len(points) and min(i_d.size, i_q.size) >= 3


def _shared(gains: GainLimits, at: FloatArray, values: FloatArray, slopes: FloatArray) -> dict[str, FloatArray]:
    made = {
        "voltage": gains.voltage * values.ravel(),
        "current": -gains.current * np.einsum("kab,kb->ka", slopes, at).ravel(),
        "speed": -gains.speed * values.ravel(),
    }
    return {name: each for name, each in made.items() if np.any(each)}


def _turned_back(turn: float, at: FloatArray, values: FloatArray, surface: FluxSurface) -> FloatArray:
    """Return what the flux linkages (2m,) are off where the angle's zero was, as a limit: those of d along the magnet less the table's."""
    turning = np.array([[np.cos(turn), np.sin(turn)], [-np.sin(turn), np.cos(turn)]])
    # Along the magnet a current of the table's has these parts, and so has its flux linkage.
    along = surface(at @ turning) @ turning.T
    return np.asarray(_WHOLE * (along - values).ravel())


def _step(values: FloatArray) -> float:
    """Return the decimal step that values were rounded to; 0 where that is so coarse that measured values would agree within it."""
    largest = float(np.max(np.abs(values)))
    top = math.floor(math.log10(_ROUNDED * largest)) if largest > 0.0 else 0
    for step in (10.0**power for power in range(top, top - 4, -1)):
        if np.allclose(values / step, np.round(values / step), rtol=0.0, atol=1e-3):
            return step
    return 0.0


def _torque(points: FloatArray, flux: FloatArray, torque: FloatArray, pole_pairs: float) -> tuple[float, list[Finding]]:
    """Return a torque column over 1.5·p·(ψ_d·i_q − ψ_q·i_d), and whether it was computed, or peak and rms were mixed."""
    ours = 1.5 * pole_pairs * (flux[:, 0] * points[:, 1] - flux[:, 1] * points[:, 0])
    large = np.isfinite(torque) & (np.abs(ours) > 0.1 * float(np.max(np.abs(ours))))
    if not np.any(large):
        return math.nan, []
    ratios = torque[large] / ours[large]
    ratio = float(np.median(ratios))
    found = []
    rounded = np.max(np.abs(torque[large] - ratio * ours[large])) < 0.6 * _step(torque[large])
    if float(np.std(ratios)) < _COMPUTED * abs(ratio) or rounded:
        found.append(_finding(Cause.TORQUE_COMPUTED, Answer.SAID, {"ratio": ratio}))
    for factor, what in ((math.sqrt(2.0), "one"), (2.0, "both")):
        if abs(ratio / factor - 1.0) < _RATIO:
            found.append(_finding(Cause.RMS_FOR_PEAK, Answer.WITHHELD, {"ratio": ratio, "record": f"rms-{what}"}))
    if abs(1.5 * ratio - 1.0) < _RATIO:
        figures: dict[str, float | str] = {"ratio": ratio, "record": "map-power"}
        found.append(_finding(Cause.RMS_FOR_PEAK, Answer.WITHHELD, figures))
    if abs(ratio - 1.0) > _RATIO and not any(each.cause is Cause.RMS_FOR_PEAK for each in found):
        if any(abs(abs(ratio) / factor - 1.0) < _RATIO for factor in (1.0, *_OF_TORQUE)):
            found.append(_finding(Cause.TORQUE_DIFFERS, Answer.SAID, {"ratio": ratio}))
        else:
            answer = Answer.WIDENED if abs(ratio - 1.0) < _GAIN else Answer.WITHHELD
            found.append(_finding(Cause.TORQUE_DIFFERS, answer, {"ratio": ratio, "record": "map-torque"}))
    return ratio, found
