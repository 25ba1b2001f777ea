"""What a drive may be made of."""

import math
from dataclasses import replace
from typing import Any

import numpy as np
import pytest

from sim_instruments.physics.circuits.windings import Windings
from sim_instruments.six_step.circuit import Observables
from sim_instruments.six_step.drive import EmfHarmonic, SixStepDrive, SixStepError
from sim_instruments.six_step.emf import emf_phasors, mean_line_emf
from sim_instruments.six_step.machine import virtual_motor
from sim_instruments.six_step.state import Bridge
from sim_instruments.six_step.steady_state import steady_state
from tests.sim_instruments.six_step.trapezoid import trapezoid


@pytest.mark.parametrize(
    ("changes", "message"),
    [
        ({"mutual_inductance": 0.5e-3}, "positive definite only for"),
        ({"mutual_inductance": -0.206e-3}, "positive definite only for"),
        ({"resistance": 0.0}, "resistance is 0: it must be greater than 0"),
        ({"self_inductance": -1.0}, "self_inductance is -1"),
        ({"source_voltage": math.inf}, "source_voltage is inf"),
        ({"diode_drop": -0.1}, "diode_drop is -0.1: it must be 0 or greater"),
        ({"pole_pairs": 0}, "pole_pairs is 0"),
        ({"connection": "star"}, '"delta" or "wye" is allowed'),
        ({"advance_angle": 1.6}, "within ±90°"),
        ({"emf_harmonics": (EmfHarmonic(2, 0.1),)}, "order 2: odd orders from 3"),
        ({"emf_harmonics": (EmfHarmonic(3, 0.1), EmfHarmonic(3, 0.2))}, "order 3 twice"),
        ({"emf_harmonics": (EmfHarmonic(3, math.nan),)}, "must be finite"),
    ],
)
def test_refused(example: SixStepDrive, changes: dict[str, Any], message: str) -> None:
    with pytest.raises(SixStepError, match=message):
        replace(example, **changes)


def test_trapezoid_has_its_flat_top() -> None:
    first, harmonics = trapezoid(2 * math.pi / 3, 399)
    angle = np.linspace(-math.pi / 3 + 0.05, math.pi / 3 - 0.05, 101)
    shape = first * (np.cos(angle) + sum(h.amplitude * np.cos(h.order * angle) for h in harmonics))
    assert shape == pytest.approx(np.ones(101), abs=2e-3)
    # Halfway down the ramp, and the whole square wave as its limit.
    half = 5 * math.pi / 12
    assert first * (math.cos(half) + sum(h.amplitude * math.cos(h.order * half) for h in harmonics)) == pytest.approx(
        0.5, abs=2e-3
    )
    with pytest.raises(ValueError, match="flat_width"):
        trapezoid(4.0, 9)


@pytest.mark.parametrize("connection", ["delta", "wye"])
def test_the_virtual_bench_sees_the_same_machine(example: SixStepDrive, connection: str) -> None:
    harmonics = (EmfHarmonic(3, 0.1, 0.4), EmfHarmonic(5, -0.05, -1.0))
    drive = replace(example, connection=connection, emf_harmonics=harmonics)
    motor = virtual_motor(drive)
    windings = Windings(motor, motor.resistance_temperature)
    orders, phasors = emf_phasors(drive)
    start = math.pi / 6 if connection == "delta" else 0.0
    theta = np.linspace(0.0, 7.0, 50)
    ours = (phasors[:, None, :] * np.exp(1j * orders * theta[:, None])).real.sum(axis=-1)
    # The bench's angle is that of the d axis, a quarter turn behind the EMF's peak.
    d_axis = theta + start - math.pi / 2
    theirs = (windings.emf_phasors @ np.exp(1j * np.multiply.outer(windings.emf_orders, d_axis))).real
    assert ours == pytest.approx(motor.pole_pairs * theirs, abs=1e-12)
    assert windings.inductance_mean[0] == pytest.approx([0.412e-3, -0.0233e-3, -0.0233e-3])


@pytest.mark.parametrize("connection", ["delta", "wye"])
def test_mean_emf_between_the_conducting_terminals(example: SixStepDrive, connection: Any) -> None:
    plain = replace(example, connection=connection)
    windings = 1.0 if connection == "delta" else math.sqrt(3.0)
    assert mean_line_emf(plain) == pytest.approx(3 / math.pi * 0.0613 * windings)
    other = replace(plain, advance_angle=0.2, emf_harmonics=(EmfHarmonic(5, 0.05, 0.4), EmfHarmonic(7, 0.02)))
    averages = steady_state(Bridge(other), 200.0).averages[Observables.emfs]
    line = -averages[2] if connection == "delta" else averages[0] - averages[2]
    assert 200.0 * mean_line_emf(other) == pytest.approx(line)
