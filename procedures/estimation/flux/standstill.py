"""Flux linkages at standstill, from strokes between two currents: ψ = ∫(u − R·i)dt in the stator's frame, turned by the rotor's angle.

The magnet's flux lies in no change: it is taken from elsewhere.
"""

import math
from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np

from procedures.estimation.fitting.fit import EstimationError, FloatArray
from procedures.estimation.flux.flux_map import MeasuredFluxMap
from procedures.estimation.flux.gain_ratio import GainRatio, KnownResistance
from procedures.estimation.flux.stroke_course import stroke_course
from procedures.estimation.flux.stroke_train import ComplexArray, FluxOf, StrokeTrain

#: The drive's angle was read within so long (s) of the switching, half-width.
_LAG = 5.0e-5
#: Standard deviation (rad) of a drive's angle zero where nothing tells it.
_ANGLE = math.radians(0.5)
#: Sides of i_q that are unlike by more than this share of the largest flux linkage (rms) mirror no motor.
_UNLIKE = 0.03
#: The stator's frame and the drive's differ by a third of a turn times a whole number, within this (rad).
_THIRD, _NEAR = 2.0 * math.pi / 3.0, math.radians(20.0)
#: Strokes along one axis alone look alike in either order of the phases: one's share of the other.
_ALIKE = 0.98
#: Less of i_q, in shares of i_d, is a current along the d axis.
_ALONG_D = 0.1
#: A record's zero is known to this share of the oscilloscope's step.
_ZERO = 0.2
#: Noise of what is integrated, and what no residual shows, as shares of the flux linkage and of full scale.
_NOISE, _FLOOR = 1.0e-4, 5.0e-4
#: Numbers of a train's flux linkages: d and q of both ends.
_FLUXES = 4
_FEWEST = 8
_ROUNDS = 4


@dataclass(frozen=True)
class StandstillGains:
    """Half-widths (relative) of the gains of voltages and currents, and the standard uncertainty (V·s) of the magnet's flux linkage."""

    voltage: float
    current: float
    flux_linkage: float


@dataclass(frozen=True)
class StandstillMap:
    """A map from strokes, with the `resistance` (Ω, cables included) that closes them.

    `angle` (rad) is by how much the drive's d axis leads the motor's, with its standard uncertainty; `mirrored` whether its phases follow
    each other the other way, and `frame` (rad) how its frame is turned. `residual` (V·s) is what the strokes leave, root mean square;
    `asymmetry` (V·s) by how much ψ at ± i_q differ. `beside_known` is the resistance over the one that is known, None where none is.
    """

    map: MeasuredFluxMap
    resistance: float
    angle: float
    angle_uncertainty: float
    mirrored: bool
    frame: float
    residual: float
    asymmetry: float
    beside_known: GainRatio | None


@dataclass(frozen=True)
class _Location:
    """Currents (A) and flux linkages (V·s) of the two ends of a train's strokes, with their standard uncertainty."""

    current: ComplexArray
    flux: ComplexArray
    uncertainty: float

    @property
    def straight(self) -> bool:
        """True if the strokes go along the d axis, from one sign of i_d to the other; offsets of the sensors add a small i_q."""
        first, last = self.current.tolist()
        return bool(first.real * last.real < 0.0 and abs(first.imag) < _ALONG_D * abs(first.real))


def fit_standstill(
    trains: Sequence[StrokeTrain], flux_linkage: float, gains: StandstillGains, known: KnownResistance | None = None
) -> StandstillMap:
    """Fit trains of strokes in the order of their taking, those along the d axis between ± i_d, others from i_q > 0 to −i_q at one i_d.

    `flux_linkage` (V·s, peak) is the magnet's. The motor is taken to be symmetric: ψ_d even, ψ_q odd in i_q. By what the strokes'
    resistance differs from a `known` one beyond chance, the gains may be beyond their limits, and the map holds that.

    Raises EstimationError for fewer locations than carry a map, or a stator's frame that is not the drive's.
    """
    if not trains:
        raise EstimationError("no strokes were taken at any current")
    mirrored, frame = _frame(trains)
    seen = [(each.mirrored() if mirrored else each).turned(frame) for each in trains]
    resistance, slopes, flux_of = 0.0, np.zeros((0, 2, 2, 2)), None
    noise = _current_noise(seen)
    for number in range(_ROUNDS):
        charges = [each.charge(resistance, flux_of) for each in seen]
        above, below = _resistances(seen, charges, flux_linkage, slopes)
        resistance = float(np.sum(above) / np.sum(below)) if np.any(below) else 0.0
        made = [
            _location(each, charge, resistance, flux_linkage, slopes[k] if number else None, noise)
            for k, (each, charge) in enumerate(zip(seen, charges, strict=True))
        ]
        locations, residuals = [one for one, _ in made], np.concatenate([left for _, left in made])
        flux_of, slopes = _smooth(locations, flux_linkage, gains)
    residual = float(np.sqrt(np.mean(np.abs(residuals) ** 2)))
    angle, spread, asymmetry = _angle(locations, slopes, flux_linkage, residual)
    course = resistance * stroke_course(seen, charges, resistance).half_width
    beside = None
    if known is not None:
        alike = gains.voltage / math.sqrt(3.0), gains.current / math.sqrt(3.0), _unsettled(seen, resistance)
        beside = known.beside(above / np.maximum(below, 1e-300), below, _heat(seen), *alike)
    if beside is not None:
        voltage, current = (math.hypot(stated, beside.excess) for stated in (gains.voltage, gains.current))
        gains = replace(gains, voltage=voltage, current=current)
    made_map = _map(locations, slopes, flux_linkage, gains, angle, spread, course)
    if asymmetry > _UNLIKE * made_map.full_scale:
        raise EstimationError(
            f"the flux linkages at both signs of i_q differ by {asymmetry / made_map.full_scale:.1%} of the largest (rms), where they "
            "are to mirror each other: the drive's d axis lies beside the magnet, or the rotor was moved. Calibrate the drive's angle "
            "(the offset of its encoder), and measure again"
        )
    return StandstillMap(made_map, resistance, angle, spread, mirrored, frame, residual, asymmetry, beside)


def _frame(trains: Sequence[StrokeTrain]) -> tuple[bool, float]:
    """Return whether the phases follow each other the other way, and by what (rad) the drive's frame is turned in the stator's."""
    found = {}
    for mirrored in (False, True):
        total = 0j
        for each in trains:
            train = each.mirrored() if mirrored else each
            change = train.integral[train.places[2]] - train.integral[train.places[1]]
            if train.still:
                # Strokes of many time constants are the resistance's, and phases differ in that.
                charge = train.charge(0.0)
                change -= charge[2] - charge[1]
            wanted = (train.current[2] - train.current[1]) * np.exp(1j * train.angle[1])
            total += change * np.conj(wanted)
        found[mirrored] = total
    mirrored = abs(found[True]) > abs(found[False])
    if abs(found[not mirrored]) > _ALIKE * abs(found[mirrored]):
        raise EstimationError(
            "the currents that are left lie along one axis, and strokes along one axis alone carry no map"
        )
    turned = float(np.angle(found[mirrored]))
    frame = _THIRD * round(turned / _THIRD)
    if abs(turned - frame) > _NEAR:
        raise EstimationError(
            f"voltages lead the drive's currents by {math.degrees(turned):.0f}°, which is no third of a turn: check which phase each "
            "probe is on, and the drive's calibration of its angle"
        )
    return mirrored, frame


def _seen(train: StrokeTrain, charge: ComplexArray, resistance: float, flux_linkage: float) -> ComplexArray:
    """Return ψ (V·s, d + j·q) at the switchings but the first."""
    stator = (
        train.integral[train.places] - train.resisted(resistance) * charge + flux_linkage * np.exp(1j * train.angle[0])
    )
    return np.asarray((stator * np.exp(-1j * train.angle))[1:])


def _visits(train: StrokeTrain) -> tuple[FloatArray, ComplexArray]:
    """Return which end (0, 1; −1 without current) each switching but the first is at, and the two ends' mean currents (A)."""
    count = train.places.size - 1
    ends = np.array([*(k % 2 for k in range(count - 1)), -1])
    means = np.array([np.mean(train.current[1:][ends == end]) for end in (0, 1)])
    return ends, means


def _resistances(
    trains: Sequence[StrokeTrain], charges: Sequence[ComplexArray], flux_linkage: float, slopes: FloatArray
) -> tuple[FloatArray, FloatArray]:
    """Return by train what it weighs times the resistance (Ω) that has its strokes come back to the same flux linkages, or that their
    ends show where the rotor stands, and what it weighs.
    """
    above, below = np.zeros(len(trains)), np.zeros(len(trains))
    for k, (train, charge) in enumerate(zip(trains, charges, strict=True)):
        if train.still:
            # The record's zero is what the first plateau and the last show.
            left = (train.plateaus - train.plateaus[-1]) * np.exp(-1j * train.angle)
            lost = train.current
        else:
            slope = slopes[k] if len(slopes) else None
            left = _apart(train, _seen(train, charge, 0.0, flux_linkage), flux_linkage, slope)
            lost = _apart(train, np.asarray((charge * np.exp(-1j * train.angle))[1:]), 0.0, None)
        above[k] = float(np.real(np.conj(lost) @ left))
        below[k] = float(np.real(np.conj(lost) @ lost))
    return above, below


def _unsettled(trains: Sequence[StrokeTrain], resistance: float) -> float:
    """Return the standard uncertainty (relative) of resistances (Ω) that the strokes' ends show, for what has not settled there."""
    standing = [each for each in trains if each.still]
    missed = sum(float(np.abs(each.current) @ each.plateau_uncertainty) for each in standing)
    whole = sum(float(np.abs(each.current) @ np.abs(each.current)) for each in standing)
    return missed / (resistance * whole) if whole and resistance > 0.0 else 0.0


def _heat(trains: Sequence[StrokeTrain]) -> FloatArray:
    """Return ∫|i|²dt (A²·s) until the middle of each train, of currents that stand at once."""
    each = np.array([float(np.abs(one.current[1:]) ** 2 @ np.diff(one.time[one.places])) for one in trains])
    return np.asarray(np.cumsum(each) - 0.5 * each)


def _current_noise(trains: Sequence[StrokeTrain]) -> float:
    """Return the standard deviation (A) of either component of a current that the drive says, by what it says without current."""
    none = np.array([each.current[place] for each in trains for place in (0, -1)])
    return float(np.sqrt(np.mean(np.abs(none - np.mean(none)) ** 2) / 2.0))


def _apart(train: StrokeTrain, flux: ComplexArray, at_none: float, slope: FloatArray | None) -> ComplexArray:
    """Return by how much visits of the same end differ from their mean, and the end without current from what it has to be."""
    ends, means = _visits(train)
    result = flux.copy()
    for end in (0, 1):
        same = ends == end
        if slope is not None:
            result[same] -= _times(slope[end], train.current[1:][same] - means[end])
        result[same] -= np.mean(result[same])
    result[ends < 0] -= at_none
    return result


def _location(
    train: StrokeTrain,
    charge: ComplexArray,
    resistance: float,
    flux_linkage: float,
    slope: FloatArray | None,
    noise_of_current: float,
) -> tuple[_Location, ComplexArray]:
    """Return both ends of a train, and what is left (V·s) at each switching; the record's zero is what a little of it can be."""
    ends, means = _visits(train)
    flux = _seen(train, charge, resistance, flux_linkage)
    if slope is not None:
        for end in (0, 1):
            same = ends == end
            flux[same] -= _times(slope[end], train.current[1:][same] - means[end])
    target = flux - np.where(ends < 0, flux_linkage, 0.0)
    noise = _NOISE * float(np.max(np.abs(flux)))
    columns, known = _columns(train, ends, resistance, noise_of_current)
    rows = np.vstack((columns / noise, np.diag(1.0 / known)[_FLUXES:]))
    right = np.concatenate((_real(target) / noise, np.zeros(known.size - _FLUXES)))
    values = np.linalg.lstsq(rows, right, rcond=None)[0]
    left = right - rows @ values
    # What is left is told by itself: each end comes back to itself, and the last to no current.
    scale = max(math.sqrt(float(left @ left) / (right.size - known.size)), 1.0)
    inverse = np.linalg.inv(rows.T @ rows)
    spread = scale * math.sqrt(float(np.max(np.diag(inverse)[:_FLUXES])))
    lag = _LAG / math.sqrt(3.0) * float(np.mean(np.abs(train.speed[1:-1])) * np.max(np.abs(flux)))
    ends_flux = np.array([complex(values[0], values[1]), complex(values[2], values[3])])
    # An end's place is the mean of what the drive said there.
    place = 0.0 if slope is None else noise_of_current * float(np.max(np.linalg.norm(slope, axis=(1, 2))))
    return _Location(means, ends_flux, math.hypot(spread, lag, place)), np.asarray(target - _complex(columns @ values))


def _columns(
    train: StrokeTrain, ends: FloatArray, resistance: float, noise_of_current: float
) -> tuple[FloatArray, FloatArray]:
    """Return what each unknown does to the flux linkages that are seen, and its standard deviation as far as that is known beforehand:
    both ends' flux linkages (infinite), the zero of the record, where within its sample each switching was, and what the resistance took
    at the end of each stroke.
    """
    back, after = np.exp(-1j * train.angle[1:]), train.places[1:]
    made = [(ends == end) * unit for end in (0, 1) for unit in (1.0 + 0j, 1j)]
    passed = train.time[after] - train.time[train.places[0]]
    zero = max(_ZERO * train.resolution, 1e-12)
    # What is taken off a record of a rotor that stands has the same zero.
    of_zero = 0.0 if train.still else 1.0
    made += [of_zero * passed * back * unit for unit in (1.0 + 0j, 1j)]
    known = [math.inf] * _FLUXES + [zero, zero]
    step = float(train.time[1] - train.time[0]) / math.sqrt(12.0)
    for place in train.places[:-1]:
        jump = train.voltage[place + 1] - train.voltage[place]
        made.append(np.where(after > place, jump * back, 0.0))
        known.append(step)
    drops = train.plateau_uncertainty if train.still else np.full(train.places.size, resistance * noise_of_current)
    lasting = np.diff(train.time[train.places])
    for place, drop, duration in zip(after, drops[1:], lasting, strict=True):
        made += [np.where(after >= place, duration * back, 0.0) * unit for unit in (1.0 + 0j, 1j)]
        known += [max(float(drop), 1e-12)] * 2
    return np.column_stack([_real(np.asarray(each, dtype=complex)) for each in made]), np.array(known)


def _real(values: ComplexArray) -> FloatArray:
    return np.concatenate((values.real, values.imag))


def _complex(values: FloatArray) -> ComplexArray:
    half = values.size // 2
    return np.asarray(values[:half] + 1j * values[half:])


def _apparent(locations: Sequence[_Location], flux_linkage: float) -> FloatArray:
    """Return the inductances (H, (n, 2, 2, 2), of both ends) of the chords from no current: a first guess of how flux linkages change."""
    result = np.zeros((len(locations), 2, 2, 2))
    currents = np.array([one.current[0] for one in locations])
    fluxes = np.array([one.flux[0] - flux_linkage for one in locations])
    direct = float(np.sum(fluxes.real * currents.real) / max(np.sum(currents.real**2), 1e-300))
    across = float(np.sum(fluxes.imag * currents.imag) / max(np.sum(currents.imag**2), 1e-300))
    result[:, :, 0, 0], result[:, :, 1, 1] = direct, across
    return result


def _smooth(locations: Sequence[_Location], flux_linkage: float, gains: StandstillGains) -> tuple[FluxOf, FloatArray]:
    """Return a surface through the locations, and its differential inductances (H, (n, 2, 2, 2)) at both ends of each."""
    surface = _map(locations, _apparent(locations, flux_linkage), flux_linkage, gains, 0.0, 0.0).surface
    at = np.array([one.current for one in locations]).ravel()
    found = surface.slopes(np.column_stack((at.real, np.abs(at.imag))))
    found[at.imag < 0.0] *= np.array([[1.0, -1.0], [-1.0, 1.0]])

    def flux_of(current: ComplexArray) -> ComplexArray:
        flux = surface(np.column_stack((current.real, np.abs(current.imag))))
        return np.asarray(flux[:, 0] + 1j * np.where(current.imag < 0.0, -flux[:, 1], flux[:, 1]))

    return flux_of, np.asarray(found.reshape(-1, 2, 2, 2))


def _angle(
    locations: Sequence[_Location], slopes: FloatArray, flux_linkage: float, residual: float
) -> tuple[float, float, float]:
    """Return by how much (rad) the drive's d axis leads, its standard uncertainty, and what of the asymmetry (V·s, rms) is left.

    A frame that is turned by ε shows ψ − conj(ψ at −i_q) = 2ε·(−jΔψ + L·(j·i)), Δψ from that of no current: nothing without saliency.
    """
    odd, like = [], []
    for one, slope in zip(locations, slopes, strict=True):
        other = one.flux[0] if one.straight else one.flux[1]
        odd.append(one.flux[0] - np.conj(other))
        like.append(2.0 * (-1j * (one.flux[0] - flux_linkage) + _times(slope[0], np.array([1j * one.current[0]]))[0]))
    shown, shape = np.array(odd), np.array(like)
    weight = float(np.sum(np.abs(shape) ** 2))
    noise = max(residual, 1e-9)
    found = 0.0
    for _ in range(2):
        found = float(np.real(np.conj(shape) @ shown)) / (weight + (noise / _ANGLE) ** 2)
        left = shown - found * shape
        noise = max(float(np.sqrt(np.mean(np.abs(left) ** 2))), residual)
    spread = noise / math.sqrt(weight + (noise / _ANGLE) ** 2)
    return found, spread, float(np.sqrt(np.mean(np.abs(left) ** 2)))


def _map(
    locations: Sequence[_Location],
    slopes: FloatArray,
    flux_linkage: float,
    gains: StandstillGains,
    angle: float,
    spread: float,
    course: float = 0.0,
) -> MeasuredFluxMap:
    """Return the map, no current first: the mean of both sides of i_q, the drive's frame turned into the motor's.

    `course` (H) is what is not known of the flux linkages for the currents' courses, a half-width.
    """
    turn = np.exp(1j * angle)
    points, flux, own = [0j], [complex(flux_linkage)], [0.0]
    turning, moving = [0j], [0j]
    for one, slope in zip(locations, slopes, strict=True):
        current, seen = one.current * turn, (one.flux - flux_linkage) * turn + flux_linkage
        straight = one.straight
        sides = [(current[0], seen[0]), (current[1], seen[1])]
        if not straight:
            mean = 0.5 * (current[0] + np.conj(current[1])), 0.5 * (seen[0] + np.conj(seen[1]))
            sides = [mean]
        for end, (i, psi) in enumerate(sides):
            at = complex(i.real, 0.0) if straight else i
            points.append(at)
            flux.append(complex(psi.real, 0.0) if straight else psi)
            own.append(one.uncertainty if straight else one.uncertainty / math.sqrt(2.0))
            turning.append(-1j * (psi - flux_linkage) + _times(slope[end], np.array([1j * at]))[0])
            moving.append(_times(slope[end], np.array([at]))[0])
    if len(points) < _FEWEST:
        raise EstimationError(f"{len(points)} locations do not carry a map; at least {_FEWEST} are needed")
    linkages: ComplexArray = np.array(flux, dtype=np.complex128)
    scale = float(np.max(np.abs(linkages)))
    scatter = np.hypot(np.array(own), _FLOOR * scale * (np.arange(len(own)) > 0))
    changed: ComplexArray = np.asarray(linkages - flux_linkage, dtype=np.complex128)
    root = math.sqrt(3.0)
    shared = {
        "voltage": gains.voltage * _pairs(changed),
        "current": gains.current * _pairs(np.array(moving)),
        "magnet": root * gains.flux_linkage * _pairs(np.ones(len(points), dtype=np.complex128)),
        "angle": root * spread * _pairs(np.array(turning)),
        "course": course * _pairs(np.array(points)),
    }
    return MeasuredFluxMap(
        _pairs(np.array(points)).reshape(-1, 2),
        _pairs(linkages).reshape(-1, 2),
        np.diag(np.repeat(scatter**2, 2)),
        True,
        shared=shared,
    )


def _pairs(values: ComplexArray) -> FloatArray:
    return np.column_stack((values.real, values.imag)).ravel()


def _times(slope: FloatArray, change: ComplexArray) -> ComplexArray:
    """Return by how much (V·s) flux linkages change with currents (A)."""
    return np.asarray(
        slope[0, 0] * change.real
        + slope[0, 1] * change.imag
        + 1j * (slope[1, 0] * change.real + slope[1, 1] * change.imag)
    )
