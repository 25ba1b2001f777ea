"""A six-step drive, measured warm on drawn benches: is the copper's part held, and how well are other loads and voltages predicted?

`python -m tests.studies.six_step_prediction [--benches N] [--seed S]`

Every bench has instruments with errors of its own; its winding starts between 20 and 100 °C, and R_11 and L11 − L12 are typed in off by up
to 2 and 5 %. The run measures at 24.32 V and 0.3 … 0.9 N·m; speed and current are then predicted at 12 … 30 V and 0.1 … 1.2 N·m and held
against the exact steady state of the drive as warm as it then is. Printed is the largest deviation of all benches, in per cent.
"""

import argparse
import math

import numpy as np

from bench.analysis.six_step_prediction import Friction, MeasuredDrive, exact
from bench.motor.motor_file import load_motor
from sim_instruments.bench import VirtualBench
from sim_instruments.six_step import balance
from tests.runs.on_bench import measure

MOTOR = "92bl-30-25l"
VOLTAGES, LOADS = (12.0, 18.0, 24.32, 30.0), (0.1, 0.3, 0.6, 0.9, 1.2)


def study(benches: int, seed: int) -> None:
    """Measure, predict, and print what came of it."""
    motor = load_motor(MOTOR)
    drive = motor.six_step
    assert drive is not None
    friction = Friction(drive.coulomb_friction, drive.viscous_friction)
    generator = np.random.default_rng(seed)
    copper, held, off = [], [], np.zeros((benches, len(VOLTAGES), len(LOADS), 4))
    for number in range(benches):
        warm = generator.uniform(20.0, 100.0)
        resistance = drive.resistance * (1.0 + generator.uniform(-0.02, 0.02))
        inductance = (drive.self_inductance - drive.mutual_inductance) * (1.0 + generator.uniform(-0.05, 0.05))
        with VirtualBench(motor.virtual, seed=seed * 100_000 + number, six_step=drive) as bench:
            bench.world.set_ambient_temperature(warm)
            bench.world.set_winding_temperature(warm)
            found = measure(
                bench,
                motor.nameplate,
                "equivalent-resistance",
                "loads=[0.3,0.5,0.7,0.9]",
                f"winding_resistance={resistance}",
                f"winding_inductance={inductance}",
            )
            stage = bench.world.six_step.stage.at(bench.world.truth()["winding_temperature"])
        point = found.findings["points"][-1]
        steady = stage.steady(point["speed_rpm"] * math.pi / 30.0)
        truth = balance.losses(steady).copper / steady.average_supply_current**2
        told = found.parameter("copper_resistance")
        copper.append(100.0 * (told.value / truth - 1.0))
        held.append(told.coverage_interval[0] <= truth <= told.coverage_interval[1])
        measured = MeasuredDrive(found.findings, "delta", drive.diode_drop, friction)
        for i, voltage in enumerate(VOLTAGES):
            for k, load in enumerate(LOADS):
                said = measured.predict(voltage, load)
                speed, current = exact(stage.drive, voltage, load)
                off[number, i, k] = (
                    said.speed.value / speed,
                    said.current.value / current,
                    said.line_speed / speed,
                    said.line_current / current,
                )
    print(f"copper's part: held on {sum(held)} of {benches} benches, largest deviation {max(map(abs, copper)):.1f} %")
    worst = 100.0 * np.abs(off - 1.0).max(axis=0)
    for name, k in (("speed", 0), ("current", 1), ("speed by the line alone", 2), ("current by the line alone", 3)):
        print(f"{name}, % off at most" + "".join(f"{load:8.1f} N·m" for load in LOADS))
        for i, voltage in enumerate(VOLTAGES):
            print(f"{voltage:15g} V" + " " * (len(name) - 1) + "".join(f"{value:12.2f}" for value in worst[i, :, k]))


if __name__ == "__main__":
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--benches", type=int, default=12)
    parser.add_argument("--seed", type=int, default=1)
    given = parser.parse_args()
    study(given.benches, given.seed)
