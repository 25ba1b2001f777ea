"""Current loops with exported gains, closed in motulator on virtual motors: the bandwidth against the one asked for.

Random motors (`random_motors.py`) are measured on the virtual bench; kp of each axis and ki are formed from what was measured, as the
exports do. motulator simulates the true motor with its inverter, sampled, one period of computing delay. The −3 dB frequency is that of
the response to a step of the reference, rotor at standstill.

    python -m tests.studies.current_loop --motors 200
"""

import argparse
import math
from collections.abc import Sequence
from dataclasses import dataclass
from types import SimpleNamespace
from typing import Any

import numpy as np
from motulator.common.control import ControlSystem
from motulator.common.utils import abc2complex
from motulator.drive import model
from motulator.drive.utils import SynchronousMachinePars

from reports.exports.current_loop import DEFAULT_BANDWIDTH, crossover, integral, proportional_d, proportional_q
from tests.studies.worlds.measured_motor import measure, study_plan

PROCEDURES = ("pole-pairs-static", "stator-resistance", "dq-inductance-extremes")
FOUR_WIRES = "stator-resistance-dc"
_NAMES = ("stator_resistance", "d_axis_inductance", "q_axis_inductance")
#: The loop is sampled so many times a period of its bandwidth; a VESC at 20 kHz and 159 Hz: 126.
SAMPLES = 126
#: Time constants of the loop that are simulated.
_LONG = 16.0


@dataclass(frozen=True)
class LoopResponse:
    """An axis' closed loop: −3 dB frequency (Hz), overshoot (share of the step), and whether it settled at the reference."""

    axis: str
    bandwidth: float
    overshoot: float
    settled: bool


class ProportionalIntegral(ControlSystem):  # type: ignore[misc]
    """kp·e + ∫ki·e dt of each axis on the rotor's own angle, which is 0: the current follows a step of one axis."""

    def __init__(self, proportional: tuple[float, float], integral_gain: float, step: complex, sampling: float) -> None:
        super().__init__(sampling)
        self.proportional, self.integral_gain, self.step = proportional, integral_gain, step
        self.integrated = 0j
        self.currents: list[complex] = []

    def get_feedback_signals(self, mdl: Any) -> SimpleNamespace:
        """Return current (A) and bus voltage (V)."""
        return SimpleNamespace(
            i_s=complex(abc2complex(mdl.machine.meas_currents())), u_dc=mdl.converter.meas_dc_voltage()
        )

    def output(self, fbk: SimpleNamespace) -> SimpleNamespace:
        """Return the duty ratios."""
        ref = super().output(fbk)
        self.currents.append(fbk.i_s)
        ref.error = self.step - fbk.i_s
        d, q = self.proportional
        voltage = complex(d * ref.error.real, q * ref.error.imag) + self.integrated
        ref.d_abc = self.pwm(ref.T_s, voltage, fbk.u_dc, 0.0)
        return ref

    def update(self, fbk: SimpleNamespace, ref: SimpleNamespace) -> None:
        """Integrate."""
        super().update(fbk, ref)
        self.integrated += self.integral_gain * ref.error * ref.T_s


def respond(
    axis: str, gains: tuple[float, float, float], true: tuple[float, float, float], bandwidth: float, samples: int
) -> LoopResponse:
    """Return the loop's response on a motor of R, Ld, Lq for gains kp_d, kp_q, ki (SI) asked to have a bandwidth (Hz)."""
    resistance, ld, lq = true
    sampling = 1.0 / (samples * bandwidth)
    step = 1.0 if axis == "d" else 1j
    machine = model.SynchronousMachine(SynchronousMachinePars(n_p=1, R_s=resistance, L_d=ld, L_q=lq, psi_f=0.01))
    bus = 20.0 * (max(gains[:2]) + resistance)
    drive = model.Drive(model.VoltageSourceConverter(u_dc=bus), machine, model.ExternalRotorSpeed())
    control = ProportionalIntegral(gains[:2], gains[2], step, sampling)
    model.Simulation(drive, control).simulate(t_stop=_LONG / (2.0 * math.pi * bandwidth))
    seen = np.real(np.array(control.currents) / step)
    return LoopResponse(
        axis,
        minus_three_decibels(np.diff(seen), sampling),
        float(np.max(seen)) - 1.0,
        bool(np.all(np.abs(seen[-samples // 2 :] - 1.0) < 0.1)),
    )


def minus_three_decibels(impulse: np.ndarray, sampling: float) -> float:
    """Return the lowest frequency (Hz) at which a response is 1/√2 of its value at standstill; NaN where there is none."""
    frequencies = np.linspace(0.0, 0.1 / sampling, 4001)
    places = np.arange(impulse.size) * sampling
    size = np.abs(np.exp(-2j * math.pi * np.outer(frequencies, places)) @ impulse)
    below = np.flatnonzero(size < size[0] / math.sqrt(2.0))
    return float(frequencies[below[0]]) if below.size else math.nan


def loops_of(
    seed: int,
    index: int,
    bandwidth: float,
    samples: int = SAMPLES,
    *,
    compensated: bool = True,
    four_wires: bool = False,
) -> Sequence[LoopResponse]:
    """Return both axes' loops of one random motor, their delay reckoned with or not; empty where the bench refused one of the figures.

    With `four_wires` the resistance is that of direct current, where it is the better known one.
    """
    procedures = (*PROCEDURES, FOUR_WIRES) if four_wires else PROCEDURES
    taken = sorted(measure(seed, index, study_plan(procedures)).figures, key=lambda one: -one.uncertainty)
    figures = {figure.name: figure for figure in taken}
    if any(name not in figures for name in _NAMES):
        return ()
    measured = {name: figures[name].value for name in _NAMES}
    of_gains = crossover(bandwidth, samples * bandwidth) if compensated else bandwidth
    quantities = (proportional_d(of_gains), proportional_q(of_gains), integral(of_gains))
    kp_d, kp_q, ki = (float(quantity.formula(measured)) for quantity in quantities)  # type: ignore[arg-type]
    resistance, ld, lq = (figures[name].truth for name in _NAMES)
    return [respond(axis, (kp_d, kp_q, ki), (resistance, ld, lq), bandwidth, samples) for axis in "dq"]


def main() -> None:
    """Print what the loops of so many motors come to."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--motors", type=int, default=200)
    parser.add_argument("--seed", type=int, default=1)
    parser.add_argument("--bandwidth", type=float, default=DEFAULT_BANDWIDTH, help="Hz")
    parser.add_argument("--samples", type=int, default=SAMPLES, help="samples of the loop in a period of its bandwidth")
    parser.add_argument(
        "--no-loop-rate", action="store_true", help="gains as of an export that is not told the loop's rate"
    )
    parser.add_argument("--four-wires", action="store_true", help="measure R with direct current and four wires too")
    given = parser.parse_args()
    made = [
        loops_of(
            given.seed,
            index,
            given.bandwidth,
            given.samples,
            compensated=not given.no_loop_rate,
            four_wires=given.four_wires,
        )
        for index in range(given.motors)
    ]
    loops = [loop for each in made for loop in each]
    ratios = np.array([loop.bandwidth for loop in loops]) / given.bandwidth
    overshoots = np.array([loop.overshoot for loop in loops])
    print(
        f"{given.motors} motors, {sum(not each for each in made)} without figures, {len(loops)} loops asked for {given.bandwidth:.4g} Hz,"
        f" sampled {given.samples} times a period"
    )
    print(f"bandwidth / asked: {np.min(ratios):.3f} … {np.max(ratios):.3f}, median {np.median(ratios):.3f}")
    print(f"within 10 %: {np.mean(np.abs(ratios - 1.0) <= 0.1):.1%}")
    print(f"overshoot: median {np.median(overshoots):.2%}, largest {np.max(overshoots):.2%}")
    print(f"not settled: {sum(not loop.settled for loop in loops)}")


if __name__ == "__main__":
    main()
