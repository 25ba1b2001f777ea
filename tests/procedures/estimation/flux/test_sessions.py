"""Flux maps of readings that were taken in several sessions: another angle, other temperatures and gains, known truths."""

from dataclasses import replace

import numpy as np
import pytest

from procedures.estimation.flux.estimator import estimate_flux_map
from procedures.estimation.flux.flux_map import GainLimits
from procedures.estimation.flux.plan import PlannedReading, grid_locations, reading_order, remaining
from procedures.estimation.flux.readings import FluxReadings
from procedures.estimation.flux.session_ties import broken_tie
from tests.procedures.estimation.flux.half_widths import half_widths
from tests.studies.worlds.flux_benches import CURRENT_GAIN, VOLTAGE_GAIN, RandomBench, random_bench, read
from tests.studies.worlds.flux_truths import Array, TrueMotor, true_motors

MOTOR = true_motors(None)["bridged IPMSM"]
GAINS = GainLimits(VOLTAGE_GAIN, CURRENT_GAIN)
COLUMNS = ("time", "i_d", "i_q", "u_d", "u_q", "electrical_speed", "voltage_noise", "current_noise")


def joined(*parts: tuple[FluxReadings, Array]) -> tuple[FluxReadings, Array]:
    """Return the readings of sessions together."""
    columns = {name: np.concatenate([getattr(each, name) for each, _ in parts]) for name in COLUMNS}
    session = np.concatenate([np.full(each.time.size, number) for number, (each, _) in enumerate(parts)])
    return FluxReadings.of(**columns, session=session), np.vstack([wanted for _, wanted in parts])


def two_sessions(
    seed: int, share: float, motor: TrueMotor = MOTOR, **other: float
) -> tuple[RandomBench, RandomBench, FluxReadings, Array]:
    """Return what a bench reads of a share of the plan, and later of what is left, when it is as `other` says."""
    random = np.random.default_rng([seed, 99])
    bench = random_bench(motor, random)
    plan = reading_order(grid_locations(motor.largest_current, 51), random)
    read_before = plan[: round(share * len(plan))]
    first = read(motor, bench, read_before, random)
    changed = {
        "angle": bench.angle + 0.03,
        "voltage_gain": -bench.voltage_gain,
        "current_gain": -bench.current_gain,
        "magnet_loss": 0.5 * bench.magnet_loss,
        **other,
    }
    later = replace(bench, **changed)  # type: ignore[arg-type]
    second = read(motor, later, remaining(plan, read_before, random), random, start=400.0)
    return bench, later, *joined(first, second)


@pytest.mark.slow
@pytest.mark.parametrize("share", [0.25, 0.5, 0.85])
def test_the_second_session_has_its_own_angle_temperatures_and_gains(share: float) -> None:
    held, worst = [], []
    for seed in range(3):
        before, later, readings, wanted = two_sessions(seed, share)
        made = estimate_flux_map(readings, gains=GAINS, wanted=wanted)
        assert len(made.map.points) == 51
        true = MOTOR.flux(made.map.points[:, 0] + 1j * made.map.points[:, 1])
        error = np.abs(made.map.flux - np.column_stack((true.real, true.imag)))
        held.append(np.mean(error <= half_widths(made.map)))
        worst.append(np.max(error) / made.map.full_scale)
        first, second = made.fit.sessions
        assert first.readings + second.readings == readings.time.size
        assert second.angle.value - first.angle.value == pytest.approx(later.angle - before.angle, abs=2e-3)
        gain = (1.0 + later.voltage_gain) / (1.0 + before.voltage_gain) - 1.0
        assert second.voltage_gain.value == pytest.approx(gain, abs=4.0 * second.voltage_gain.uncertainty)
        assert broken_tie(readings, symmetric=True, gains=GAINS, wanted=wanted) is None
        # What the sessions differ by is a part of the uncertainty, and a row of its own.
        most = int(np.argmax(made.map.flux[:, 1]))
        alone = np.zeros(made.map.flux.size)
        alone[2 * most + 1] = 1.0
        figure = made.map.figure(float(made.map.flux[most, 1]), alone)
        assert figure.sessions > 0.0
        assert np.hypot(figure.sessions, figure.scatter) == pytest.approx(made.map.scatter[most, 1])
    assert np.mean(held) > 0.9
    assert max(worst) < 0.005


@pytest.mark.slow
@pytest.mark.parametrize("gain", [0.02, 0.03])
def test_contradictions_are_found(gain: float) -> None:
    # A drive whose gain is 2 or 3 % off is beyond both limits.
    for seed in range(4):
        *_, readings, wanted = two_sessions(seed, 0.5, current_gain=gain)
        broken = broken_tie(readings, symmetric=True, gains=GAINS, wanted=wanted)
        assert broken is not None
        assert max(abs(broken.gain), broken.share) > 0.01


def test_one_session_contradicts_nothing() -> None:
    random = np.random.default_rng(5)
    bench = random_bench(MOTOR, random)
    plan = reading_order(grid_locations(MOTOR.largest_current, 20), random)
    readings, wanted = read(MOTOR, bench, plan, random)
    assert broken_tie(readings, symmetric=True, gains=GAINS, wanted=wanted) is None


def test_what_is_left_of_a_plan_is_tied() -> None:
    random = np.random.default_rng(7)
    plan = reading_order(grid_locations(20.0, 40), random)
    before = plan[:30]
    left = remaining(plan, before, random)
    asked = {(each.i_d, each.i_q, each.direction) for each in (*before, *left)}
    assert {(each.i_d, each.i_q, each.direction) for each in plan} <= asked
    loaded = {(each.i_d, each.i_q) for each in before if each.i_d or each.i_q}
    ties = [each for each in left if (each.i_d, each.i_q) in loaded]
    assert len({(each.i_d, each.i_q) for each in ties if each.direction > 0}) >= 3
    assert {each.direction for each in left if not (each.i_d or each.i_q)} == {1, -1}
    assert not remaining(plan, plan, random)
    untied = remaining(plan, before, random, tie=False)
    assert sum(bool(each.i_d or each.i_q) for each in untied) == sum(bool(each.i_d or each.i_q) for each in plan[30:])
    assert left[0] == PlannedReading(0.0, 0.0, left[0].direction)
