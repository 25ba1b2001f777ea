"""The estimator of strokes at standstill, on made-up trains of a constant motor: known truth, its frame, and what is refused."""

import math

import numpy as np
import pytest

from procedures.estimation.fitting.fit import EstimationError
from procedures.estimation.flux.gain_ratio import KnownResistance
from procedures.estimation.flux.standstill import StandstillGains, fit_standstill
from procedures.estimation.flux.stroke_train import StrokeTrain, stroke_train
from tests.procedures.estimation.flux.half_widths import half_widths

LAMBDA, LD, LQ, R = 0.05, 2e-3, 3.5e-3, 0.1
TAU, STROKE, STEP = 1e-3, 0.012, 4e-6
GAINS = StandstillGains(0.0, 0.0, 0.0)
POINTS = [3 + 0j, 6 + 0j, 9 + 0j, 0 + 4j, 0 + 9j, -4 + 5j, 4 + 5j, -7 + 3j, 7 + 3j, -3 + 8j, 3 + 8j]


def flux(current: np.ndarray) -> np.ndarray:
    return np.asarray(LAMBDA + LD * current.real + 1j * LQ * current.imag)


def made(
    point: complex,
    *,
    angle: float = 0.7,
    error: float = 0.0,
    frame: float = 0.0,
    resistance: float = R,
    unbalance: float = 0.0,
    noise: float = 0.0,
    gain: float = 0.0,
    locked: bool = False,
) -> StrokeTrain:
    """A rotor that stands at `angle`; the drive's d axis leads by `error`, its frame is turned by `frame`.

    `unbalance` is that of the phases' resistances, `noise` (A) that of what the drive says of its currents,
    which flow larger than that by `gain`.
    """
    other = point.conjugate() if point.imag else -point
    ends = [0j, point, other, point, 0j]
    begins = np.array([0.0, 0.5, 1.5, 2.0]) * STROKE
    time = np.arange(-0.5 * STROKE, 5.0 * STROKE, STEP)
    current = np.zeros(time.size, dtype=complex)
    slope = np.zeros(time.size, dtype=complex)
    for k, begin in enumerate(begins):
        later = time > begin
        left = (ends[k] if k else 0j) - ends[k + 1] if k < 3 else ends[3]
        target = ends[k + 1] if k < 3 else 0j
        decay = np.exp(-(time[later] - begin) / TAU)
        current[later] = target + left * decay
        slope[later] = -left / TAU * decay
    true = current * np.exp(1j * error)
    change = slope * np.exp(1j * error)
    stator = resistance * true * np.exp(1j * angle)
    voltage = stator + unbalance * np.conj(stator) + (LD * change.real + 1j * LQ * change.imag) * np.exp(1j * angle)
    told = [*begins, 3.0 * STROKE]
    random = np.random.default_rng([7, round(1e3 * abs(point)), round(1e3 * abs(point.real))])
    said = [each / (1.0 + gain) + noise * complex(*random.normal(size=2)) for each in (0j, point, other, point, 0j)]
    # The drive's angle is that of its own d axis, which leads by the error.
    return stroke_train(time, voltage * np.exp(1j * frame), told, said, [angle + error] * 5, [0.0] * 5, locked=locked)


def test_a_constant_motor_has_its_inductances_and_its_resistance() -> None:
    found = fit_standstill([made(point) for point in POINTS], LAMBDA, GAINS)
    assert found.resistance == pytest.approx(R, rel=5e-3)
    points = found.map.points[:, 0] + 1j * found.map.points[:, 1]
    true = flux(points)
    off = np.abs(found.map.flux[:, 0] + 1j * found.map.flux[:, 1] - true)
    assert len(points) == 1 + 6 + 8
    assert off.max() < 2e-3 * found.map.full_scale
    assert not found.mirrored
    assert found.frame == 0.0


@pytest.mark.parametrize(("gain", "told"), [(0.01, False), (-0.08, True)])
def test_a_current_that_is_not_as_stated_is_held_where_the_resistance_is_known(gain: float, told: bool) -> None:
    trains = [made(point, gain=gain) for point in POINTS]
    found = fit_standstill(trains, LAMBDA, StandstillGains(0.01, 0.005, 0.0), KnownResistance(R, 0.003 * R))
    assert found.beside_known is not None
    assert found.beside_known.ratio == pytest.approx(1.0 + gain, abs=0.01)
    assert found.beside_known.contradicted == told
    true = flux(found.map.points[:, 0] + 1j * found.map.points[:, 1])
    off = np.abs(found.map.flux - np.column_stack((true.real, true.imag)))
    assert np.all(off <= 1.96 * found.map.uncertainty + 1e-9)


def test_ends_of_strokes_that_have_not_settled_accuse_no_current() -> None:
    # The first stroke, of half the impulse, ends after six time constants here.
    trains = [made(point, locked=True) for point in POINTS]
    beside = fit_standstill(
        trains, LAMBDA, StandstillGains(0.001, 0.001, 0.0), KnownResistance(R, 0.001 * R)
    ).beside_known
    assert beside is not None
    assert not beside.contradicted
    assert beside.ratio > 1.1


def test_noise_of_currents_and_unequal_phases_move_nothing_where_the_rotor_stands() -> None:
    # A stroke lasts for eight of the winding's time constants: what is wrong with R·i counts as many times in ψ.
    trains = [made(point, resistance=1.0, unbalance=0.02, noise=0.02, locked=True) for point in POINTS]
    found = fit_standstill(trains, LAMBDA, GAINS)
    points = found.map.points[:, 0] + 1j * found.map.points[:, 1]
    off = found.map.flux[:, 0] + 1j * found.map.flux[:, 1] - flux(points)
    assert np.abs(off).max() < 5e-3 * found.map.full_scale
    assert found.resistance == pytest.approx(1.0, rel=0.03)
    halves = half_widths(found.map)
    assert np.all(np.abs(off.real) <= halves[:, 0] + 1e-9)
    assert np.all(np.abs(off.imag) <= halves[:, 1] + 1e-9)


def test_noise_of_currents_is_in_the_intervals_of_a_rotor_that_is_free() -> None:
    found = fit_standstill([made(point, resistance=0.5, noise=0.02) for point in POINTS], LAMBDA, GAINS)
    points = found.map.points[:, 0] + 1j * found.map.points[:, 1]
    off = found.map.flux[:, 0] + 1j * found.map.flux[:, 1] - flux(points)
    held = np.abs(np.column_stack((off.real, off.imag))) <= half_widths(found.map) + 1e-9
    assert np.mean(held) > 0.9


def test_a_current_that_settles_no_faster_than_the_winding_is_refused() -> None:
    trains = [made(point, resistance=2.5, locked=True) for point in POINTS]
    with pytest.raises(EstimationError, match="raise the bandwidth"):
        fit_standstill(trains, LAMBDA, GAINS)


@pytest.mark.parametrize("thirds", [1, -1])
def test_terminals_in_another_order_are_seen(thirds: int) -> None:
    turned = 2.0 * math.pi / 3.0 * thirds
    found = fit_standstill([made(point, frame=turned) for point in POINTS], LAMBDA, GAINS)
    assert found.frame == pytest.approx(turned)
    assert found.resistance == pytest.approx(R, rel=5e-3)


def test_phases_that_follow_each_other_the_other_way_are_seen() -> None:
    trains = [made(point).mirrored() for point in POINTS]
    turned = [StrokeTrain(t.time, t.voltage, t.places, t.current, t.angle, t.speed) for t in trains]
    found = fit_standstill(turned, LAMBDA, GAINS)
    assert found.mirrored


def test_the_zero_of_the_drives_angle_is_found_where_the_axes_differ() -> None:
    error = math.radians(0.4)
    found = fit_standstill([made(point, error=error) for point in POINTS], LAMBDA, GAINS)
    assert found.angle == pytest.approx(error, abs=max(3.0 * found.angle_uncertainty, math.radians(0.05)))


def test_no_strokes_at_all_are_refused() -> None:
    with pytest.raises(EstimationError, match="no strokes"):
        fit_standstill([], 0.05, StandstillGains(0.0, 0.0, 0.0))


def test_too_few_locations_are_refused() -> None:
    with pytest.raises(EstimationError, match="do not carry a map; at least 8 are needed"):
        fit_standstill([made(point) for point in POINTS[2:4]], LAMBDA, GAINS)


def test_one_axis_alone_is_no_map_and_no_sign_of_wrong_phases() -> None:
    with pytest.raises(EstimationError, match="along one axis"):
        fit_standstill([made(point) for point in POINTS if not point.imag], LAMBDA, GAINS)


def test_a_record_without_strokes_is_refused() -> None:
    train = made(3 + 0j)
    with pytest.raises(EstimationError, match="no beginning of the strokes"):
        stroke_train(train.time, 0.0 * train.voltage, [0.0, 1.0], [0j, 0j], [0.0] * 2, [0.0] * 2)
    short = slice(0, 4000)
    with pytest.raises(EstimationError):
        stroke_train(
            train.time[short], train.voltage[short], [0.0, 0.006, 0.018, 0.024, 0.036], [0j] * 5, [0.0] * 5, [0.0] * 5
        )
