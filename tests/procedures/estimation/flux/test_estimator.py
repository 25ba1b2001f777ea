"""Flux maps from simulated readings whose truth is known; the long study is `python -m tests.studies.flux_map`."""

from dataclasses import replace
from functools import cache

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from procedures.estimation.fitting.fit import EstimationError
from procedures.estimation.fitting.misfit import Cause
from procedures.estimation.flux.estimator import FluxMapEstimate, estimate_flux_map
from procedures.estimation.flux.flux_map import GainLimits
from procedures.estimation.flux.plan import grid_locations, reading_order
from procedures.estimation.flux.readings import FluxReadings, locations_of
from tests.procedures.estimation.flux.half_widths import half_widths
from tests.studies.worlds.flux_benches import CURRENT_GAIN, VOLTAGE_GAIN, RandomBench, random_bench, read
from tests.studies.worlds.flux_truths import Array, TrueMotor, true_motors

MOTORS = {name: motor for name, motor in true_motors(None).items() if motor.symmetric}
GAINS = GainLimits(VOLTAGE_GAIN, CURRENT_GAIN)


def bench_of(motor: TrueMotor, seed: int) -> tuple[RandomBench, FluxReadings, Array]:
    random = np.random.default_rng([seed, 20])
    bench = random_bench(motor, random)
    readings, wanted = read(motor, bench, reading_order(grid_locations(motor.largest_current, 51), random), random)
    return bench, readings, wanted


@cache
def estimate_of(name: str, seed: int) -> FluxMapEstimate:
    """Return the map of a motor's readings as they are, which several tests hold others against."""
    _, readings, wanted = bench_of(MOTORS[name], seed)
    return estimate_flux_map(readings, gains=GAINS, wanted=wanted)


def errors(motor: TrueMotor, made: FluxMapEstimate) -> Array:
    true = motor.flux(made.map.points[:, 0] + 1j * made.map.points[:, 1])
    return made.map.flux - np.column_stack((true.real, true.imag))


@pytest.mark.parametrize(
    "name", [pytest.param(n, marks=() if n == "bridged IPMSM" else pytest.mark.slow) for n in sorted(MOTORS)]
)
def test_every_point_is_within_its_limits_though_nothing_of_the_bench_is_known(name: str) -> None:
    motor = MOTORS[name]
    held, worst = [], []
    assert bench_of(motor, 0)[1].time.size <= 90
    for seed in range(6):
        made = estimate_of(name, seed)
        assert len(made.map.points) == 51
        error = np.abs(errors(motor, made))
        worst.append(np.max(error) / made.map.full_scale)
        held.append(np.mean(error <= half_widths(made.map)))
    assert np.median(worst) < 0.004
    assert max(worst) < 0.008
    assert np.mean(held) > 0.85


def test_what_all_readings_share_is_found() -> None:
    motor = MOTORS["reluctance, little magnet"]
    bench, readings, wanted = bench_of(motor, 3)
    made = estimate_flux_map(readings, gains=GAINS, wanted=wanted).fit
    assert made.angle.value == pytest.approx(bench.angle, abs=5 * made.angle.uncertainty + 2e-4)
    gain = (1.0 + bench.voltage_gain) * (1.0 + bench.current_gain)
    # Drops that stop rising near the largest current look like a resistance, and its uncertainty has that.
    off = made.resistance - gain * bench.resistance_at(readings.time)
    assert np.all(np.abs(off) < 2.0 * made.resistance_uncertainty)
    assert np.max(np.abs(off)) < 0.1 * bench.resistance
    base = motor.flux(np.zeros(1, dtype=complex))[0].real
    assert made.magnet_change[-1] == pytest.approx(-base * bench.magnet_at(readings.time)[-1], abs=0.01 * base)


def test_noise_of_current_sensors_moves_no_flux_linkage() -> None:
    motor = MOTORS["bridged IPMSM"]
    _, readings, wanted = bench_of(motor, 4)
    quiet = estimate_of("bridged IPMSM", 4)
    noise = 2e-3 * motor.largest_current
    d, q = noise * np.random.default_rng(4).normal(size=(2, readings.time.size))
    loud = replace(readings, i_d=readings.i_d + d, i_q=readings.i_q + q, current_noise=readings.current_noise + noise)
    found = estimate_flux_map(loud, gains=GAINS, wanted=wanted)
    assert found.fit.followed.value == pytest.approx(0.0, abs=4 * found.fit.followed.uncertainty)
    assert found.fit.followed.uncertainty < 0.1
    # Taken for real, such noise would be 1 % of the largest flux linkage at small currents.
    assert np.max(np.abs(found.map.flux - quiet.map.flux)) < 3e-3 * quiet.map.full_scale


@pytest.mark.slow
@given(miss=st.floats(0.001, 0.003), seed=st.integers(0, 2**16))
@settings(max_examples=4)
def test_set_points_that_the_inverter_misses_move_it(miss: float, seed: int) -> None:
    motor = MOTORS["bridged IPMSM"]
    random = np.random.default_rng(seed)
    bench = random_bench(motor, random)
    plan = reading_order(grid_locations(motor.largest_current, 51), random)
    off = miss * motor.largest_current * random.normal(size=(len(plan), 2)).clip(-3.0, 3.0)
    taken = [
        replace(each, i_d=each.i_d + beside[0], i_q=each.i_q + beside[1])
        for each, beside in zip(plan, off.tolist(), strict=True)
    ]
    readings, _ = read(motor, bench, taken, random)
    wanted = np.array([(each.i_d, each.i_q) for each in plan])
    found = estimate_flux_map(readings, gains=GAINS, wanted=wanted)
    noise = 4e-4
    assert found.fit.followed.value == pytest.approx(miss**2 / (miss**2 + noise**2), abs=0.15)
    assert np.max(np.abs(errors(motor, found))) < 0.009 * found.map.full_scale


def test_readings_that_contradict_the_others_widen_what_was_read_once_too() -> None:
    motor = MOTORS["surface magnets"]
    _, readings, wanted = bench_of(motor, 2)
    clean = estimate_flux_map(readings, gains=GAINS, wanted=wanted)
    idle = np.flatnonzero(clean.fit.locations.of == clean.fit.locations.zero)
    widths = []
    for count in (1, 2):
        off = np.zeros(readings.time.size)
        off[idle[3 : 3 + 5 * count : 5]] = 60.0 * float(np.mean(readings.voltage_noise))
        made = estimate_flux_map(replace(readings, u_d=readings.u_d + off), gains=GAINS, wanted=wanted)
        odd = [finding for finding in made.misfit.findings if finding.cause is Cause.ODD_READING]
        assert len(odd) == count
        widths.append(float(np.median(made.map.uncertainty)))
    # One may be a slip; several are what the model does not hold.
    assert widths[1] > 1.3 * widths[0]


class Kneed(RandomBench):
    """A bench whose legs' drops stop rising at a current."""

    def drop_at(self, size: Array) -> Array:
        wave = np.cos(np.linspace(0.0, 2.0 * np.pi, 720, endpoint=False))
        leg = np.clip(size[:, np.newaxis] * wave / self.drop_width, -1.0, 1.0)
        return np.asarray(2.0 * self.drop * np.mean(leg * wave, axis=1))


@pytest.mark.parametrize("knee", [0.46, 0.92])
def test_drops_that_stop_rising_anywhere_move_no_point_that_was_read_once(knee: float) -> None:
    motor = MOTORS["surface magnets"]
    random = np.random.default_rng([5, 20])
    given = vars(random_bench(motor, random)) | {"drop": 12.0, "drop_width": knee * motor.largest_current}
    plan = reading_order(grid_locations(motor.largest_current, 51), random)
    readings, wanted = read(motor, Kneed(**given), plan, random)
    made = estimate_flux_map(readings, gains=GAINS, wanted=wanted)
    error = np.abs(errors(motor, made))
    assert np.max(error) < 0.006 * made.map.full_scale
    assert np.all(error <= 1.5 * half_widths(made.map) + 1e-9)
    assert not made.misfit.findings


def test_a_current_that_was_asked_for_beside_an_axis_loses_as_much_in_the_switches_beside_it() -> None:
    """It counts as one on the axis; a drop along the current is no flux linkage all the same."""
    motor = MOTORS["surface magnets"]
    random = np.random.default_rng(5)
    bench = random_bench(motor, random)
    plan = list(reading_order(grid_locations(motor.largest_current, 51), random))
    most = motor.largest_current
    plan.append(replace(plan[0], i_d=-0.008 * most, i_q=0.45 * most, direction=1))
    # Twice the induced voltage: a large dead time at a low speed.
    speed = float(np.max(np.abs(read(motor, bench, plan[:9], random)[0].electrical_speed)))
    drop = 2.0 * speed * abs(complex(motor.flux(np.zeros(1, complex))[0]))
    readings, wanted = read(motor, replace(bench, drop=drop, drop_width=0.05 * most, drop_kind=0), plan, random)
    made = estimate_flux_map(readings, gains=GAINS, wanted=wanted)
    place = int(np.argmin(np.hypot(*(made.map.points - (0.0, 0.45 * most)).T)))
    assert made.map.points[place] == pytest.approx((0.0, 0.45 * most))
    assert np.max(np.abs(errors(motor, made)[place])) < 0.008 * made.map.full_scale


@pytest.mark.slow
def test_gains_are_apart_from_scatter_and_common_to_all_points() -> None:
    motor = MOTORS["surface magnets"]
    _, readings, wanted = bench_of(motor, 1)
    bare = estimate_flux_map(readings, wanted=wanted).map
    whole = estimate_flux_map(readings, gains=GAINS, wanted=wanted).map
    assert not bare.shared
    assert whole.covariance == pytest.approx(bare.covariance)
    assert whole.shared["voltage"] == pytest.approx(VOLTAGE_GAIN * whole.flux.ravel())
    assert np.all(half_widths(whole) >= half_widths(bare))


def test_an_asymmetric_motor_is_found_and_its_map_holds_all_the_same() -> None:
    symmetric = MOTORS["reluctance, little magnet"]

    def turned(current: np.ndarray) -> np.ndarray:
        turn = np.exp(1j * np.radians(4.0) * np.abs(current) / symmetric.largest_current)
        return symmetric.flux(current / turn) * turn

    motor = replace(symmetric, flux=turned, symmetric=False)
    _, readings, wanted = bench_of(motor, 2)
    made = estimate_flux_map(readings, gains=GAINS, wanted=wanted)
    assert not made.symmetric
    assert [f.cause for f in made.misfit.findings if f.cause is Cause.ASYMMETRIC_MAP]
    assert np.max(np.abs(errors(motor, made))) < 0.012 * made.map.full_scale
    assert np.mean(np.abs(errors(motor, made)) <= half_widths(made.map)) > 0.85


@pytest.mark.parametrize(
    "name", [pytest.param(n, marks=() if n == "bridged IPMSM" else pytest.mark.slow) for n in sorted(MOTORS)]
)
def test_a_symmetric_motor_is_not_called_asymmetric(name: str) -> None:
    made = estimate_flux_map(bench_of(MOTORS[name], 4)[1], gains=GAINS)
    assert made.symmetric
    assert made.symmetry_tested


def test_noise_that_is_not_stated_is_found() -> None:
    _, readings, wanted = bench_of(MOTORS["surface magnets"], 5)
    silent = replace(readings, voltage_noise=0.0 * readings.time, current_noise=0.0 * readings.time)
    stated = estimate_flux_map(readings, wanted=wanted).map
    found = estimate_flux_map(silent, wanted=wanted).map
    assert np.median(found.scatter[found.scatter > 0]) == pytest.approx(
        np.median(stated.scatter[stated.scatter > 0]), rel=0.5
    )


def test_a_single_wild_reading_is_told() -> None:
    _, readings, wanted = bench_of(MOTORS["surface magnets"], 6)
    places = locations_of(readings, symmetric=True, wanted=wanted)
    counts = np.bincount(places.of)
    repeated = int(np.flatnonzero(counts[places.of] == 4)[0])
    voltage = readings.u_q.copy()
    voltage[repeated] += 40.0 * readings.voltage_noise[0]
    made = estimate_flux_map(replace(readings, u_q=voltage), gains=GAINS, wanted=wanted)
    assert Cause.RESIDUAL_VARIANCE in {f.cause for f in made.misfit.findings}


def test_what_cannot_be_told_apart_is_refused() -> None:
    motor = MOTORS["surface magnets"]
    n = 12
    i_d, i_q = np.linspace(-10.0, -1.0, n), np.linspace(1.0, 10.0, n)
    flux = motor.flux(i_d + 1j * i_q)
    voltage = 0.5 * (i_d + 1j * i_q) + 1j * motor.electrical_speed * flux
    readings = FluxReadings.of(
        np.arange(n), i_d, i_q, voltage.real, voltage.imag, np.full(n, motor.electrical_speed), 0.01
    )
    with pytest.raises(EstimationError, match="read some locations"):
        estimate_flux_map(readings)


def test_readings_at_standstill_are_refused() -> None:
    ones = np.ones(10)
    with pytest.raises(EstimationError, match="standstill"):
        FluxReadings.of(np.arange(10), ones, ones, ones, ones, np.concatenate((np.ones(9), [0.0])))


@pytest.mark.parametrize("name", ["bridged IPMSM", pytest.param("reluctance", marks=pytest.mark.slow)])
def test_a_wild_reading_of_what_is_read_once_is_told_and_in_the_interval(name: str) -> None:
    motor = MOTORS[name]
    _, readings, wanted = bench_of(motor, 4)
    clean = estimate_of(name, 4)
    assert not [finding for finding in clean.misfit.findings if finding.cause is Cause.ODD_READING]
    of = clean.fit.locations.of
    once = np.flatnonzero(np.bincount(of)[of] == 1)
    for place in (once[5], once[20]):
        off = 0.05 * float(np.max(np.abs(readings.voltage))) * (np.arange(of.size) == place)
        made = estimate_flux_map(replace(readings, u_q=readings.u_q + off), gains=GAINS, wanted=wanted)
        (odd,) = (finding for finding in made.misfit.findings if finding.cause is Cause.ODD_READING)
        assert odd.figures["number"] == place + 1
        there = of[place]
        assert np.all(np.abs(errors(motor, made)[there]) <= 2.0 * made.map.uncertainty[there])
        others = np.arange(len(made.map.points)) != there
        assert np.median(made.map.uncertainty[others]) < 1.3 * np.median(clean.map.uncertainty[others])
