"""Probes, leads and inputs through the oscilloscope's driver: a turning rotor's EMF, and a step of the supply."""

import math

import numpy as np
import pytest

from drivers.interfaces import ChannelSettings, Slope, Trigger, Waveform
from procedures.core.bench import Role
from sim_instruments.disturbances.bench import Disturbances
from sim_instruments.disturbances.channel import ChannelPath
from tests.bench.virtual.disturbances.conftest import Make, Stand

#: 50 rad/s on four pole pairs; √3 · 0.02 V·s/rad between two lines.
ELECTRICAL = 200.0
LINE_EMF = math.sqrt(3.0) * 0.02 * ELECTRICAL


def disturbed(path: ChannelPath) -> Disturbances:
    return Disturbances({2: path})


def turning(one: Stand, screen: float = 16.0, record: float = 0.2) -> dict[int, Waveform]:
    """Return what channels 1 and 2 show of one line voltage, the second being disturbed."""
    world, scope = one.world, one.driver(Role.OSCILLOSCOPE)
    world.couple_dynamometer()
    for channel in (1, 2):
        world.attach_voltage_probe(channel, "A", "B")
        scope.configure_channel(channel, ChannelSettings(screen))
    scope.configure_acquisition(record, 10_000)
    with one.driver(Role.DYNAMOMETER).driving_speed(50.0):
        scope.configure_trigger(Trigger(None))
        scope.initiate()
        one.sleep(1.0)
        waves: dict[int, Waveform] = scope.fetch([1, 2], timeout=5.0)
    return waves


def phasor(wave: Waveform, angular: float = ELECTRICAL) -> complex:
    """Return the amplitude (peak) of a wave at a frequency (rad/s)."""
    lines = [np.exp(-1j * line * wave.time) for line in dict.fromkeys((angular, ELECTRICAL))]
    columns = [part for turns in lines for part in (turns.real, -turns.imag)]
    found = np.linalg.lstsq(np.column_stack([*columns, np.ones_like(wave.time)]), wave.values, rcond=None)[0]
    return complex(found[0], -found[1])


def first_order(corner: float) -> complex:
    """Return 1/(1 + jω/ωc) of a corner (Hz)."""
    return 1.0 / (1.0 + 1j * ELECTRICAL / (2.0 * math.pi * corner))


def second_order(over: float, damping: float) -> complex:
    """Return 1/(1 − x² + 2jζx) at x = 1/`over`."""
    return 1.0 / (1.0 - over**-2 + 2j * damping / over)


@pytest.mark.parametrize(
    ("path", "ratio"),
    [
        (ChannelPath(factor=0.1), 0.1),
        (ChannelPath(factor=1.03), 1.03),
        (ChannelPath(pole=100.0), first_order(100.0)),
        (ChannelPath(skew=1.0e-3), np.exp(-1j * ELECTRICAL * 1.0e-3)),
        (ChannelPath(coupling_corner=10.0), 1.0 - first_order(10.0)),
        # Below its resonance a lead shows more than there is, and later.
        (ChannelPath(resonance=3.0 * ELECTRICAL / (2.0 * math.pi), damping=0.1), second_order(3.0, 0.1)),
        # At ωτ = 1 a divider that passes a tenth more above passes 1 + 0.1·j/(1 + j).
        (ChannelPath(compensation=0.1, compensation_time=1.0 / ELECTRICAL), 1.05 + 0.05j),
        (ChannelPath(coupling_corner=5.0, pole=200.0), (1.0 - first_order(5.0)) * first_order(200.0)),
    ],
    ids=["tenth", "gain", "bandwidth", "skew", "ac-coupled", "ringing", "compensation", "both"],
)
def test_what_a_sine_becomes(stand: Make, path: ChannelPath, ratio: complex) -> None:
    waves = turning(stand(disturbed(path)))
    clean = phasor(waves[1])
    assert abs(clean) == pytest.approx(LINE_EMF, rel=1e-3)
    assert phasor(waves[2]) / clean == pytest.approx(ratio, abs=2e-3)


def test_the_inputs_own_coupling_is_a_high_pass_of_10_hz(stand: Make) -> None:
    one = stand()
    world, scope = one.world, one.driver(Role.OSCILLOSCOPE)
    world.couple_dynamometer()
    for channel in (1, 2):
        world.attach_voltage_probe(channel, "A", "B")
        scope.configure_channel(channel, ChannelSettings(16.0))
    scope.configure_acquisition(0.2, 10_000)
    one.bench.instrument("oscilloscope").settings.put("coupling", "AC", 2)
    with one.driver(Role.DYNAMOMETER).driving_speed(50.0):
        scope.configure_trigger(Trigger(None))
        scope.initiate()
        one.sleep(1.0)
        waves = scope.fetch([1, 2], timeout=5.0)
    assert phasor(waves[2]) / phasor(waves[1]) == pytest.approx(1.0 - first_order(10.0), abs=2e-3)


def test_a_record_beyond_the_range_ends_at_the_converters_last_codes(stand: Make) -> None:
    """Eight divisions are 199 of 256 codes: 2 V a division leave the top code at 128/256 of 256 · 16 V / 199."""
    waves = turning(stand(disturbed(ChannelPath(offset=5.0))))
    step = 16.0 / 199.0
    assert not waves[1].clipped
    assert waves[2].clipped
    assert waves[2].values.max() == pytest.approx(127.996 * step, abs=0.01 * step)
    assert waves[2].values.min() == pytest.approx(5.0 - LINE_EMF, abs=0.25)
    # Where the shifted sine lies above the end: arccos of the end over the amplitude, of a half turn.
    periods = waves[2].time - waves[2].time[0] < 6.0 * 2.0 * math.pi / ELECTRICAL
    flat = np.mean(waves[2].values[periods] > 127.5 * step)
    assert flat == pytest.approx(math.acos((128.0 * step - 5.0) / LINE_EMF) / math.pi, abs=0.01)


def test_a_probes_amplifier_saturates_below_the_ends_of_the_range(stand: Make) -> None:
    waves = turning(stand(disturbed(ChannelPath(limit=5.0))))
    assert not waves[2].clipped
    assert np.median(waves[2].values[waves[1].values > 5.5]) == pytest.approx(5.0, abs=0.05)


def test_distortion_makes_a_second_harmonic(stand: Make) -> None:
    waves = turning(stand(disturbed(ChannelPath(bow=0.02))))
    assert abs(phasor(waves[2], 2.0 * ELECTRICAL)) == pytest.approx(0.02 * LINE_EMF**2 / 2.0, rel=0.02)


@pytest.mark.parametrize(
    ("path", "frequency"),
    [
        (ChannelPath(hum=0.5, hum_frequency=50.0, hum_phase=1.0), 50.0),
        (ChannelPath(hum=0.5, hum_frequency=16.7), 16.7),
        (ChannelPath(wander=0.5, wander_period=0.1), 10.0),
    ],
    ids=["mains", "railway", "wander"],
)
def test_a_lead_picks_up_a_line(stand: Make, path: ChannelPath, frequency: float) -> None:
    one = stand(disturbed(path))
    scope = one.driver(Role.OSCILLOSCOPE)
    one.world.attach_voltage_probe(2, "A", "B")
    scope.configure_channel(2, ChannelSettings(2.0))
    scope.configure_acquisition(0.6, 10_000)
    scope.configure_trigger(Trigger(None))
    scope.initiate()
    one.sleep(1.0)
    wave = scope.fetch([2], timeout=5.0)[2]
    assert abs(phasor(wave, 2.0 * math.pi * frequency)) == pytest.approx(0.5, rel=0.01)


def test_jitter_is_noise_in_proportion_to_the_slope(stand: Make) -> None:
    waves = turning(stand(disturbed(ChannelPath(jitter=5.0e-4))))
    noise = float(np.std(waves[2].values - waves[1].values))
    # Two channels' own noise of 0.02 divisions comes on top.
    expected = math.hypot(LINE_EMF * ELECTRICAL * 5.0e-4 / math.sqrt(2.0), math.sqrt(2.0) * 0.02 * 2.0)
    assert noise == pytest.approx(expected, rel=0.05)


def test_the_gain_warms_up(stand: Make) -> None:
    one = stand(disturbed(ChannelPath(warm_up=0.2, warm_up_time=100.0)))
    one.sleep(100.0 - 3.0)
    waves = turning(one)
    at = one.bench.clock.now() - 1.0
    assert abs(phasor(waves[2]) / phasor(waves[1])) == pytest.approx(
        1.0 + 0.2 * (1.0 - math.exp(-at / 100.0)), abs=3e-3
    )


def stepped(one: Stand) -> dict[int, Waveform]:
    """Return channels 1 and 2 on terminals A and B while the supply goes from 0 to 5 V, at 1 V/ms."""
    scope, supply = one.driver(Role.OSCILLOSCOPE), one.driver(Role.SUPPLY)
    one.world.lock_rotor()
    one.world.connect({"A": "supply+", "B": "supply-"})
    for channel in (1, 2):
        one.world.attach_voltage_probe(channel, "A", "B")
        scope.configure_channel(channel, ChannelSettings(8.0, 2.0))
    scope.configure_acquisition(0.1, 10_000, pre_trigger=0.2)
    scope.configure_trigger(Trigger(1, 1.0, Slope.RISING))
    scope.initiate()
    with supply.energised(5.0, 9.0):
        waves: dict[int, Waveform] = scope.fetch([1, 2], timeout=5.0)
    return waves


def test_a_step_droops_behind_ac_coupling(stand: Make) -> None:
    waves = stepped(stand(disturbed(ChannelPath(coupling_corner=20.0))))
    time, droop = waves[2].time, 1.0 / (2.0 * math.pi * 20.0)
    late = (time > 0.010) & (time < 0.025)
    slope = np.polyfit(time[late], np.log(waves[2].values[late]), 1)[0]
    assert -1.0 / slope == pytest.approx(droop, rel=0.01)
    # A ramp of 5 ms that ends 4 ms after the trigger at 1 V leaves τ/T·(1 − e^(−T/τ)) of its height.
    at = np.abs(time - 0.004) < 5e-5
    assert np.mean(waves[2].values[at]) == pytest.approx(
        5.0 * droop / 0.005 * (1.0 - math.exp(-0.005 / droop)), abs=0.05
    )
    assert np.mean(waves[1].values[late]) == pytest.approx(5.0, abs=0.02)


def test_a_skewed_channel_comes_later_by_that(stand: Make) -> None:
    waves = stepped(stand(disturbed(ChannelPath(skew=1.0e-3))))
    rising = (waves[1].values > 1.5) & (waves[1].values < 3.0) & (waves[1].time < 0.01)
    early = np.interp(waves[1].time[rising] + 1.0e-3, waves[2].time, waves[2].values)
    assert np.mean(early - waves[1].values[rising]) == pytest.approx(0.0, abs=0.01)
