"""Open circuit, short circuit and load points on random motors and random instruments, against what is true.

python -m tests.studies.turned_maps [--benches 100] [--seed 1] [--warming 300] [--workers 2]
"""

import argparse
import math
from collections import Counter, defaultdict
from collections.abc import Iterator, Mapping
from concurrent.futures import ProcessPoolExecutor
from dataclasses import dataclass
from functools import partial
from typing import Any

import numpy as np

from bench.plugins.catalogues import installed
from bench.run.plan import make_plan
from procedures.core.result import ProcedureResult
from procedures.estimation.winding.short_circuit import current, peak_speed
from sim_instruments.bench import BenchSetting, VirtualBench
from sim_instruments.instruments.errors import Errors
from sim_instruments.physics.motor.motor import VirtualMotor
from sim_instruments.world.machine_data import Leads
from tests.studies.worlds.measured_motor import THERMOMETER, carry_out
from tests.studies.worlds.random_motors import draw_motor

#: What the three procedures go by, and they themselves.
BEFORE = ("pole-pairs-back-emf", "stator-resistance", "dq-inductance-extremes", "back-emf-constant")
NAMES = ("open-circuit", "short-circuit", "load-points")
_RPM = math.pi / 30.0


@dataclass(frozen=True)
class Judged:
    """One figure: its name, error over standard uncertainty, relative uncertainty, and whether its interval holds the truth."""

    name: str
    z: float
    relative: float
    held: bool


@dataclass(frozen=True)
class BenchOutcome:
    """What one bench gave: judged figures, alarms by identifier, and why procedures were refused or failed."""

    judged: tuple[Judged, ...]
    alarms: tuple[str, ...]
    refused: tuple[str, ...]
    failed: tuple[str, ...]


def short_truths(motor: VirtualMotor, temperature: float, ambient: float) -> dict[str, float]:
    """Return the true figures of the short circuit, leads and link included; the peak's at a winding's temperature (°C)."""
    leads = Leads().resistance
    ratio = motor.resistances_at(temperature)[0] / motor.phase_resistances[0]
    warm, ld, lq = motor.stator_resistance_y * ratio + leads, motor.d_axis_inductance_y, motor.q_axis_inductance_y
    flux = motor.flux_linkage_y * motor.flux_linkage_at(ambient) / motor.flux_linkage
    omega = peak_speed(warm, ld, lq)
    # At 25 °C the leads would be as much less as if they were of the winding's copper.
    cold = motor.stator_resistance_y + leads / ratio
    return {
        "short_circuit_resistance": cold,
        "d_axis_chord_inductance": ld,
        "short_circuit_current": motor.flux_linkage_y / ld,
        "peak_braking_torque": float(1.5 * motor.pole_pairs * warm * current(omega, warm, ld, lq, flux) ** 2 / omega),
        "peak_braking_speed": omega / motor.pole_pairs / _RPM,
        "flux_temperature_coefficient": motor.flux_temperature_coefficient,
    }


def load_truth(motor: VirtualMotor, point: Mapping[str, Any], temperature: float) -> tuple[float, float]:
    """Return true efficiency and loss (W) of a load point that the inverter's current has reached."""
    speed = point["speed_rpm"] * _RPM
    flux = motor.flux_linkage_y * motor.flux_linkage_at(temperature) / motor.flux_linkage
    resistance = motor.stator_resistance_y * motor.resistances_at(temperature)[0] / motor.phase_resistances[0]
    level = point["commanded_current"]
    drag = motor.coulomb_friction + motor.viscous_friction * speed
    shaft = (1.5 * motor.pole_pairs * flux * level - drag) * speed
    loss = 1.5 * resistance * level**2 + drag * speed
    electrical = shaft + loss
    return (shaft / electrical if electrical > 0.0 else electrical / shaft), loss


def measured(seed: int, warming: float, index: int) -> BenchOutcome:
    """Measure bench `index` of the study; depends on nothing else."""
    random = np.random.default_rng([seed, index])
    motor, plate = draw_motor(random)
    ambient = float(random.uniform(18.0, 28.0))
    settings = [f"temperature_uncertainty={THERMOMETER}"]
    if warming:
        settings += [f"open-circuit.warming_time={warming}", f"short-circuit.warming_time={warming}"]
    plan = make_plan([*BEFORE, *NAMES], settings, installed().procedures)
    setting = BenchSetting(ambient_temperature=ambient, initial_angle=float(random.uniform(0.0, 2.0 * np.pi)))
    bench = VirtualBench(
        motor, seed=int(random.integers(1 << 31)), errors=Errors.drawn(random), setting=setting, sockets=False
    )
    with bench:
        done = carry_out(bench, plate, int(random.integers(1 << 31)), plan)
    judged = [each for result in done.results for each in judged_of(result, motor, ambient)]
    alarms = [warning.identifier for result in done.results if result.procedure in NAMES for warning in result.warnings]
    return BenchOutcome(
        tuple(judged),
        tuple(alarms),
        tuple(f"{name}: {why}" for name, why in done.refused),
        tuple(f"{name}: {why}" for name, why in done.failed),
    )


def judged_of(result: ProcedureResult, motor: VirtualMotor, ambient: float) -> Iterator[Judged]:
    """Give the figures of one result beside the truth."""
    truths = {
        "open-circuit": {
            "flux_linkage": motor.flux_linkage_y,
            "flux_temperature_coefficient": motor.flux_temperature_coefficient,
        },
        "short-circuit": short_truths(motor, ambient, ambient),
    }.get(result.procedure, {})
    if result.procedure == "open-circuit":
        top = max(result.findings["drag"]["speed"])
        truths["open_circuit_loss"] = (motor.coulomb_friction + motor.viscous_friction * top) * top
    for parameter in result.parameters:
        if parameter.name in truths:
            truth, (low, high) = truths[parameter.name], parameter.coverage_interval
            yield Judged(
                f"{result.procedure} {parameter.name}",
                (parameter.value - truth) / parameter.standard_uncertainty,
                parameter.standard_uncertainty / abs(parameter.value),
                low <= truth <= high,
            )
    if result.procedure != "load-points":
        return
    warm = 0.5 * (result.findings["winding_temperature"]["before"] + result.findings["winding_temperature"]["after"])
    for point in result.findings["points"]:
        if abs(point["reported_current"] / point["commanded_current"] - 1.0) > 0.03:
            # The voltage did not suffice, so that the current is not known to this study.
            continue
        efficiency, loss = load_truth(motor, point, warm)
        for name, truth, interval in (
            ("efficiency", efficiency, "efficiency_interval"),
            ("loss", loss, "loss_interval"),
        ):
            if point[name] is not None:
                low, high = point[interval]
                uncertainty = point[f"{name}_uncertainty"]
                yield Judged(
                    f"load-points {name} of each point",
                    (point[name] - truth) / uncertainty,
                    uncertainty / abs(point[name]),
                    low <= truth <= high,
                )


def main() -> None:
    """Measure and print."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--benches", type=int, default=100)
    parser.add_argument("--seed", type=int, default=1)
    parser.add_argument("--warming", type=float, default=0.0)
    parser.add_argument("--workers", type=int, default=2)
    given = parser.parse_args()
    rows, counts = defaultdict[str, list[Judged]](list), Counter[str]()
    with ProcessPoolExecutor(given.workers) as pool:
        for done in pool.map(partial(measured, given.seed, given.warming), range(given.benches)):
            for each in done.judged:
                rows[each.name].append(each)
            counts.update(f"alarm {name}" for name in done.alarms)
            counts.update(f"refused {why}" for why in done.refused)
            counts.update(f"FAILED {why}" for why in done.failed)
    print(f"{given.benches} benches, seed {given.seed}, warming {given.warming:g} s")
    print(f"{'figure':55s} {'n':>5s} {'held':>7s} {'rms z':>6s} {'median u':>9s}")
    for name, found in sorted(rows.items()):
        rms = math.sqrt(sum(each.z**2 for each in found) / len(found))
        held = sum(each.held for each in found) / len(found)
        print(f"{name:55s} {len(found):5d} {held:7.1%} {rms:6.2f} {np.median([e.relative for e in found]):9.2%}")
    for name, count in counts.most_common():
        print(f"{count:5d} × {name}")


if __name__ == "__main__":
    main()
