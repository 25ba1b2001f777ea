"""How often `analyze six-step-loads` holds the truth when a table of load points is not as its model says.

`python -m tests.studies.six_step_tables [--records N] [--seed S] [--row K] [--missed]`

Drives are drawn and solved exactly, with winding and magnets warming from load to load, as in `six_step_misfit`; a table is written as a
person does, rounded and with one reading a load, and read by the command's own analysis, in the last rows with a capture of a line's
current a load. The EMF constant is typed off by up to what is typed of it, the Hall sensors are off by up to 5°. Every cause is drawn from
negligible to gross. The truth of R_eq is at the drive's own terminals, with the open-circuit EMF, at the largest load that counts.
"""

import argparse
import math
import tempfile
from collections import Counter
from dataclasses import dataclass, field, replace
from pathlib import Path
from typing import Any

import numpy as np

from bench.analysis import TypedEmf, TypedWinding, analyze_six_step_loads
from bench.analysis.statements import read_statements
from bench.i18n.errors import InputError
from sim_instruments.six_step.drive import SixStepDrive, SixStepError
from sim_instruments.six_step.emf import mean_line_emf
from sim_instruments.six_step.load import balance_load
from sim_instruments.six_step.state import Bridge
from sim_instruments.six_step.steady_state import SteadyState
from tests.studies.six_step_misfit import (
    COPPER,
    CURRENT,
    MAGNETS,
    SCOPE,
    SPEED,
    TORQUE,
    VOLTAGE,
    Random,
    drawn_drive,
    log,
)

ROWS = (
    "clean", "three loads", "narrow range of loads", "up and down, torque with hysteresis", "one row mistyped", "sense lines open",
    "battery", "winding warms", "bus current's gain (not in the list)", "bus voltage's gain (not in the list)", "ripple misread",
    "tachometer's factor", "tachometer's gain (not in the list)", "tachometer's gain, frequency beside it",
    "electrical speed taken as the shaft's", "torque's arm", "torque's zero drifts", "friction warms",
    "advanced timing", "chopped", "iron saturates", "EMF constant of another magnet temperature (not in the list)",
    "with waveforms", "with waveforms, one row mistyped", "with waveforms, advanced timing", "with waveforms, sense lines open",
)  # fmt: skip
#: Relative half-width that is typed of the EMF constant.
EMF = 0.005
_RPM = 30.0 / math.pi


@dataclass
class Load:
    """One load: what a bench's meters show (V, A, rad/s, N·m, °C), and the state behind it with the drive as warm as it was."""

    state: SteadyState
    emf_constant: float
    voltage: float
    current: float
    speed: float
    torque: float
    temperature: float

    @property
    def truth(self) -> float:
        """R_eq (Ω) at the drive's own terminals, with the EMF constant (V·s/rad) that the magnets have without a current."""
        state = self.state
        return (state.average_bus_voltage - self.emf_constant * state.speed) / state.average_supply_current


@dataclass
class Tally:
    """Counts of one row."""

    records: int = 0
    refused: int = 0
    withheld: int = 0
    warned: int = 0
    held: int = 0
    beyond: int = 0
    silent: int = 0
    widths: list[float] = field(default_factory=list)
    causes: Counter[str] = field(default_factory=Counter)

    def line(self, name: str) -> str:
        """Return the row of the table."""
        given = self.records - self.refused - self.withheld
        held = f"{self.held / given:.1%}" if given else "–"
        width = f"{np.median(self.widths):.1%}" if self.widths else "–"
        causes = ", ".join(f"{name} {count / self.records:.0%}" for name, count in self.causes.most_common())
        return (
            f"| {name} | {held} | {self.beyond} | {self.silent} | {width} | {self.warned / self.records:.0%} | "
            f"{self.withheld / self.records:.0%} | {self.refused / self.records:.0%} | {causes} |"
        )


def loads_of(name: str, random: Random) -> tuple[SixStepDrive, list[Load]]:
    """Draw a drive, and solve it at loads that it carries, as warm as it is there."""
    while True:
        drive, rated = drawn_drive(random)
        advance = math.radians(random.uniform(-5.0, 5.0))
        if name.endswith("advanced timing"):
            advance = math.radians(log(random, 1.0, 30.0))
        drive = replace(drive, advance_angle=advance)
        if name == "battery":
            drive = replace(drive, source_resistance=drive.source_resistance * log(random, 2.0, 10.0))
        count = 3 if name == "three loads" else int(random.integers(4, 8))
        lowest, highest = random.uniform(0.1, 0.4), random.uniform(0.7, 1.0)
        if name.startswith("narrow"):
            lowest = highest * random.uniform(0.8, 0.95)
        torques = rated * np.linspace(lowest, highest, count)
        if name.startswith("up and down"):
            torques = np.concatenate((torques, torques[-2::-1]))
        rise = log(random, 5.0, 90.0) if name == "winding warms" else log(random, 0.5, 30.0)
        # Heat goes with the square of the load, and the winding follows with its own time constant, 5 s a load.
        constant, warm, course = log(random, 2.0, 200.0), 0.0, []
        for torque in torques:
            warm = torque**2 + (warm - torque**2) * math.exp(-5.0 / constant)
            course.append(warm)
        start, reach = random.uniform(18.0, 32.0), random.uniform(0.0, 1.0)
        temperatures = start + rise * np.array(course) / max(course)
        saturates = log(random, 1e-3, 0.1) if name.startswith("iron") else 0.0
        battery = log(random, 1e-3, 0.1) if name == "battery" else 0.0
        try:
            states = [
                balance_load(
                    Bridge(
                        replace(
                            drive,
                            resistance=drive.resistance * (1.0 + COPPER * (t - 25.0)),
                            emf_constant=drive.emf_constant
                            * (1.0 + MAGNETS * (start + reach * (t - start) - 25.0))
                            * (1.0 - saturates * (torque / rated) ** 2),
                            self_inductance=drive.self_inductance * (1.0 - 3.0 * saturates * (torque / rated) ** 2),
                            source_voltage=drive.source_voltage * (1.0 - battery * k / len(torques)),
                        )
                    ),
                    float(torque),
                )
                for k, (torque, t) in enumerate(zip(torques, temperatures, strict=True))
            ]
        except SixStepError:
            continue
        if all(s.speed > 0.2 * states[0].speed for s in states):
            return drive, [
                Load(
                    s,
                    mean_line_emf(s.drive) / (1.0 - saturates * (torque / rated) ** 2),
                    s.average_bus_voltage,
                    s.average_supply_current,
                    s.speed,
                    s.load_torque,
                    float(t),
                )
                for s, t, torque in zip(states, temperatures, torques, strict=True)
            ]


def disturb(name: str, drive: SixStepDrive, loads: list[Load], random: Random) -> None:
    """Do to the meters what a row is about."""
    sign = float(random.choice((-1.0, 1.0)))
    largest = max(each.torque for each in loads)
    if name.startswith("up and down"):
        hysteresis = log(random, 1e-3, 0.03) * largest
        for k, each in enumerate(loads):
            each.torque += hysteresis * (-0.5 if k <= len(loads) // 2 else 0.5)
    if name.endswith("sense lines open"):
        # The meter is at the supply's own terminals, before the leads.
        leads = drive.source_resistance * (1.0 if random.random() < 0.5 else log(random, 0.01, 1.0))
        for each in loads:
            each.voltage += leads * each.current
    if name.startswith(("bus current's", "bus voltage's", "tachometer's gain")):
        off = 1.0 + sign * log(random, 1e-3, 0.1)
        for each in loads:
            quantity = name.split("'")[0].split()[-1]
            quantity = "speed" if quantity == "tachometer" else quantity
            setattr(each, quantity, getattr(each, quantity) * off)
    if name == "ripple misread":
        # A meter that shows the rms of a rippled current: the smaller the load, the larger the ripple beside it.
        ripple = log(random, 0.01, 0.5) * loads[0].current
        for each in loads:
            each.current = math.hypot(each.current, ripple)
    if name == "tachometer's factor":
        factor = float(random.choice((0.25, 0.5, 2.0 / 3.0, 1.5, 2.0, 3.0, 4.0)))
        for each in loads:
            each.speed *= factor
    if name.startswith("electrical speed"):
        for each in loads:
            each.speed *= drive.pole_pairs
    if name == "torque's arm":
        factor = math.exp(sign * log(random, 1e-3, 1.0))
        for each in loads:
            each.torque *= factor
    if name == "torque's zero drifts":
        drift = sign * log(random, 1e-3, 0.2) * largest
        for k, each in enumerate(loads):
            each.torque += drift * k / len(loads)
    if name == "friction warms":
        # What the bearings take falls as their grease warms; the load at the shaft is as it was set.
        falls = random.uniform(0.2, 0.8) * drive.coulomb_friction
        for k, each in enumerate(loads):
            each.torque -= falls * (1.0 - k / len(loads))
    if name == "chopped":
        duty = random.uniform(0.4, 0.98)
        for each in loads:
            each.voltage, each.current = each.voltage / duty, each.current * duty


def mistyped(rows: list[list[str]], random: Random) -> None:
    """Exchange two digits of one number, or move its point."""
    row, column = int(random.integers(len(rows))), int(random.integers(4))
    cell = rows[row][column]
    places = [k for k in range(len(cell) - 1) if cell[k] != cell[k + 1] and "." not in cell[k : k + 2]]
    if places and random.random() < 0.7:
        k = int(random.choice(places))
        rows[row][column] = cell[:k] + cell[k + 1] + cell[k] + cell[k + 2 :]
    else:
        rows[row][column] = f"{float(cell) * float(random.choice((0.1, 10.0))):.6g}"


def written(path: Path, name: str, loads: list[Load], random: Random) -> None:
    """Write the table as read once from meters with gains of their own."""
    gains = [1.0 + random.uniform(-limit, limit) for limit in (VOLTAGE, CURRENT, SPEED, TORQUE)]
    rows = []
    for each in loads:
        read = [
            value * gain * (1.0 + noise * random.standard_normal())
            for value, gain, noise in zip(
                (each.voltage, each.current, each.speed * _RPM, each.torque),
                gains,
                (5e-4, 1e-3, 2e-4, 1e-3),
                strict=True,
            )
        ]
        digits = [
            max(0, places - 1 - math.floor(math.log10(abs(v)))) for v, places in zip(read, (4, 4, 4, 3), strict=True)
        ]
        rows.append([f"{v:.{d}f}" for v, d in zip(read, digits, strict=True)])
    if name.endswith("one row mistyped"):
        mistyped(rows, random)
    error = random.uniform(-2.0, 2.0)
    for row, each in zip(rows, loads, strict=True):
        row.append(f"{each.temperature + error:.0f}")
        if "frequency" in name:
            row.append(f"{each.state.drive.pole_pairs * each.state.speed / (2.0 * math.pi):.6g}")
    heading = "U (V);I (A);n (rpm);M (Nm);Tw (°C)" + (";f (Hz)" if "frequency" in name else "")
    path.write_text("\n".join([heading, *(";".join(row) for row in rows)]).replace(".", ",") + "\n")


def captured(folder: Path, loads: list[Load], random: Random) -> list[Path]:
    """Write a capture of a line's current at each load: eight bits, a probe with a gain of its own, begun anywhere."""
    probe, paths = 1.0 + random.uniform(-SCOPE, SCOPE), []
    for k, each in enumerate(loads):
        state = each.state
        grid = np.linspace(0.0, state.period, 10_001)
        time = np.linspace(0.0, 20.3 * state.period, 20_000) + random.uniform(0.0, state.period)
        line = probe * np.interp(time % state.period, grid, state.line_currents(grid)[0])
        step = 2.6 * float(np.max(np.abs(line))) / 256.0
        line = step * np.round((line + random.normal(0.0, 0.7 * step, line.size)) / step)
        paths.append(folder / f"line{k}.csv")
        np.savetxt(
            paths[-1], np.column_stack((time, line)), delimiter=",", fmt="%.8g", header="t (s),CH1 (A)", comments=""
        )
    return paths


def take(tally: Tally, name: str, random: Random, folder: Path, *, missed: bool) -> None:
    """Take one table into account."""
    drive, loads = loads_of(name, random)
    disturb(name, drive, loads, random)
    path = folder / "loads.csv"
    written(path, name, loads, random)
    aligned = mean_line_emf(replace(drive, advance_angle=0.0)) * (1.0 + random.uniform(-EMF, EMF))
    if name.startswith("EMF constant of"):
        # Measured warm, and taken for one at 25 °C.
        aligned *= 1.0 + MAGNETS * log(random, 1.0, 60.0)
    waves = captured(folder, loads, random) if name.startswith("with waveforms") else []
    tally.records += 1
    try:
        made = analyze_six_step_loads(
            path,
            waves,
            pole_pairs=drive.pole_pairs,
            emf=TypedEmf()
            if waves
            else TypedEmf(
                aligned,
                uncertainty=EMF * aligned,
                commutation=math.radians(15.0 if name == "advanced timing" else 5.0),
            ),
            winding=TypedWinding(
                drive.connection,
                drive.resistance * (1.0 + random.uniform(-0.02, 0.02)),
                inductance=(drive.self_inductance - drive.mutual_inductance) * (1.0 + random.uniform(-0.05, 0.05)),
            ),
            accuracy=read_statements(
                [f"voltage={VOLTAGE:%}", f"current={CURRENT:%}", f"speed={SPEED:%}", f"torque={TORQUE:%}"]
                + ([f"CH1={SCOPE:%}"] if waves else [])
            ),
        )
    except InputError:
        tally.refused += 1
        return
    causes = {each["cause"] for each in made["misfit"]}
    tally.causes.update(causes | {each["cause"] for each in made["withheld"].values()})
    tally.warned += bool(causes)
    if made["withheld"]:
        tally.withheld += 1
        return
    figure: dict[str, Any] = made["parameters"]["equivalent_resistance"]
    point = [each for each in made["details"]["points"] if not each.get("left_out")][-1]
    # A row that counts has the current that was read.
    truth = min(loads, key=lambda each: abs(each.current - point["bus_current"])).truth
    low, high = figure["coverage_interval"]
    half = 0.5 * (high - low)
    off = abs(0.5 * (low + high) - truth)
    tally.widths.append(half / truth)
    tally.held += off <= half
    tally.beyond += off > 3.0 * half
    tally.silent += off > half and not causes
    if missed and off > half:
        print(
            "  ",
            name,
            f"{off / half:.2f} U",
            sorted(causes),
            f"U {half / truth:.1%}",
            f"{len(loads)} loads, {math.degrees(drive.advance_angle):.0f}°",
            flush=True,
        )


def main() -> None:
    """Print the table."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--records", type=int, default=100)
    parser.add_argument("--seed", type=int, default=1)
    parser.add_argument("--row", type=int, action="append", help="this row alone, by its number from 0")
    parser.add_argument("--missed", action="store_true", help="show each figure that was not held")
    given = parser.parse_args()
    print("| table | held | beyond 3 U | missed silently | median U | reported | withheld | refused | named |")
    print("| --- | ---: | ---: | ---: | ---: | ---: | ---: | ---: | --- |")
    with tempfile.TemporaryDirectory() as folder:
        for number in given.row or range(len(ROWS)):
            tally = Tally()
            for index in range(given.records):
                random = np.random.default_rng([given.seed, number, index])
                take(tally, ROWS[number], random, Path(folder), missed=given.missed)
            print(tally.line(ROWS[number]), flush=True)


if __name__ == "__main__":
    main()
