"""The periodic state against a second reading of the circuit, stepped by solve_ivp until it repeats."""

import math
from dataclasses import replace

import numpy as np
import pytest

from sim_instruments.six_step.drive import EmfHarmonic, SixStepDrive
from sim_instruments.six_step.state import Bridge
from sim_instruments.six_step.steady_state import steady_state
from tests.sim_instruments.six_step.reference import Reference
from tests.sim_instruments.six_step.trapezoid import trapezoid

LIVELY = (EmfHarmonic(3, 0.15, 0.3), EmfHarmonic(5, 0.2, 1.0))
U, L, O = "UPPER_DIODE", "LOWER_DIODE", "OPEN"  # noqa: E741
# name, changes to the example, speed relative to the no-load speed, what the idle leg does in turn (* a clamped switch)
CASES = [
    ("freewheel ends", {}, 0.82, [U, O]),
    ("generating, freewheel does not end", {"source_resistance": 0.0, "switch_resistance": 0.0}, 2.5, [L]),
    (
        "motoring, freewheel does not end",
        {"advance_angle": 0.6, "resistance": 0.05, "switch_resistance": 0.0, "source_resistance": 0.0},
        0.2,
        [U],
    ),
    ("generating, lower diode", {}, 1.1, [L, O]),
    ("generating, clamped switch, upper diode late", {}, 6000 / 3967.4, [L, L + "*", L, O, U]),
    ("rectifying, clamped switch", {}, 2.5, [L, L + "*"]),
    ("wye, diode to diode", {"connection": "wye", "advance_angle": 0.2, "mutual_inductance": 4e-5}, 0.9, None),
    ("trapezoid, wye", {"connection": "wye", "emf_harmonics": trapezoid(2.0, 9)[1]}, 0.8, None),
    ("trapezoid, delta with circulating current", {"emf_harmonics": trapezoid(2.0, 9)[1]}, 0.8, None),
    ("late commutation", {"advance_angle": -0.5}, 0.8, None),
    ("lively EMF, wye", {"connection": "wye", "emf_harmonics": LIVELY}, 1.3, None),
    ("no drops at all", {"diode_drop": 0.0, "switch_resistance": 0.0, "source_resistance": 0.0}, 1.05, None),
    ("loose magnetic coupling upwards", {"mutual_inductance": 1e-4, "emf_harmonics": LIVELY}, 1.1, None),
]


@pytest.mark.parametrize(("changes", "relative", "sequence"), [c[1:] for c in CASES], ids=[c[0] for c in CASES])
def test_currents_agree(example: SixStepDrive, changes: dict, relative: float, sequence: list[str] | None) -> None:
    bridge = Bridge(replace(example, **changes))
    speed = relative * bridge.no_load_speed
    steady = steady_state(bridge, speed)
    if sequence is not None:
        seen = [s.circuit.conduction for s in steady.segments]
        assert [c.idle.name + "*" * (c.upper_clamped or c.lower_clamped) for c in seen] == sequence
    other = Reference(bridge.drive, speed)
    # From rest a loosely coupled machine takes hundreds of turns to the state that the model claims to repeat.
    start = steady.winding_currents(0.0)[:, 0] if "mutual_inductance" in changes else None
    y = np.concatenate([other.periodic(start)[0], [0.0]])
    # Through the six states too: the model folds them into one.
    for number in range(6):
        assert steady.winding_currents(number * steady.state_time)[:, 0] == pytest.approx(y[:3], abs=1e-6)
        y, _ = other.run_state(y, number)
        y[3] = (number + 1) * math.pi / 3


def test_every_start_leads_to_the_same_state(bridge: Bridge) -> None:
    expected = steady_state(bridge, 700.0)
    for guess in ([100.0, -50.0, 30.0], [-400.0, 0.0, 400.0], [1e4, 1e4, -1e4]):
        found = steady_state(bridge, 700.0, np.array(guess))
        assert found.start_currents == pytest.approx(expected.start_currents, abs=1e-8)
