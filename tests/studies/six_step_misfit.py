"""How often the intervals of the armature equivalent resistance hold the truth when the load points are not as the model says.

`python -m tests.studies.six_step_misfit [--records N] [--seed S] [--workers N]`

Drives are drawn at random and solved exactly (`sim_instruments.six_step`); windings and magnets warm from load to load, and the meters'
errors are the study's own: gains anywhere within what is stated, a gain of its own for every range of the oscilloscope, rounding, scatter.
R_11 and L11 − L12 are typed in off by up to 2 and 5 %. Every cause is drawn log-uniform from negligible to gross. Truths hold at the loads
that count. Solving a drive takes longest, so the rows see the same drives, but for those that another drive is about.
"""

import argparse
import math
from collections import Counter
from collections.abc import Sequence
from concurrent.futures import ProcessPoolExecutor
from dataclasses import dataclass, field, replace
from functools import partial
from typing import Any, cast

import numpy as np

from bench.station.clock import SystemClock
from drivers.interfaces import Accuracy, Reading
from procedures.core.bench import Bench, ProcedureError
from procedures.core.nameplate import Nameplate, WindingConnection
from procedures.core.result import ProcedureResult
from procedures.estimation.fitting.fit import EstimationError
from procedures.estimation.six_step.currents import fold
from procedures.six_step.equivalent_resistance import EquivalentResistance
from procedures.six_step.load_points import Averaged, LoadPoint, LoadPoints
from procedures.six_step.settings import EquivalentResistanceSettings
from sim_instruments.six_step import balance
from sim_instruments.six_step.drive import SixStepDrive, SixStepError
from sim_instruments.six_step.emf import mean_line_emf
from sim_instruments.six_step.load import balance_load
from sim_instruments.six_step.state import Bridge
from sim_instruments.six_step.steady_state import SteadyState
from tests.studies.worlds.measured_motor import NoRecord

Random = np.random.Generator
ROWS = (
    "clean", "three loads", "one speed wrong", "one bus voltage wrong", "one bus current wrong", "one torque wrong", "probe factor",
    "bus current's gain", "bus voltage's gain (not in the list)", "speed's gain", "unsettled", "line clipped", "ripple on the bus current",
    "torque's zero", "phase advance", "voltage before the leads, R_t given", "bus voltage drifts (not in the list)",
    "thermometer late (not in the list)", "iron loss (not in the list)", "probe factor and one bus voltage wrong",
)  # fmt: skip
#: Stated limits of the meters, relative: bus voltage, bus current, oscilloscope, tachometer, torque.
VOLTAGE, CURRENT, SCOPE, SPEED, TORQUE = 0.003, 0.01, 0.02, 0.0005, 0.002
#: How far two ranges of the oscilloscope differ (standard deviation), and rounding of the tachometer (rad/s).
RANGES, RPM = 0.001, math.pi / 30.0
COPPER, MAGNETS = 0.00393 / (1.0 + 0.00393 * 5.0), -0.001
SAMPLES, PERIODS, WAVE = 30_000, 40, 10_001
#: Rows that a drive of their own is drawn for.
OWN_DRIVE = ("three loads", "phase advance")
#: So many drives are drawn at a time.
_BATCH = 20


def log(random: Random, low: float, high: float) -> float:
    """Draw a magnitude from negligible to gross."""
    return float(np.exp(random.uniform(np.log(low), np.log(high))))


@dataclass
class Row:
    """Counts of one row: records, those refused and withheld, warned; figures given, held, and beyond 3 U, with their names."""

    records: int = 0
    refused: int = 0
    withheld: int = 0
    warned: int = 0
    figures: int = 0
    held: int = 0
    beyond: int = 0
    width: list[float] = field(default_factory=list)
    missed: Counter[str] = field(default_factory=Counter)
    causes: Counter[str] = field(default_factory=Counter)

    def add(self, other: "Row") -> None:
        """Take more records into account."""
        for name, more in vars(other).items():
            setattr(self, name, getattr(self, name) + more)


@dataclass
class World:
    """A drawn bench: the drive at 25 °C and its rated torque (N·m), true states at its loads with winding and magnets warm, one period of
    a line's current at each, and what disturbs the meters.
    """

    drive: SixStepDrive
    rated: float
    states: list[SteadyState]
    waves: list[np.ndarray[Any, Any]]
    temperatures: list[float]
    factors: dict[str, np.ndarray[Any, Any]]
    iron: float = 0.0


def drawn_drive(random: Random) -> tuple[SixStepDrive, float]:
    """Draw a drive, and its rated torque (N·m)."""
    volts, current = log(random, 12.0, 60.0), log(random, 2.0, 40.0)
    speed = log(random, 150.0, 600.0)
    ohms = volts / current
    connection = "delta" if random.random() < 0.5 else "wye"
    resistance = ohms * random.uniform(0.02, 0.08) * (1.5 if connection == "delta" else 0.5)
    pairs = int(random.integers(2, 8))
    state = math.pi / 3.0 / (pairs * speed)
    inductance = ohms * state * random.uniform(0.05, 0.15) * (1.5 if connection == "delta" else 0.5)
    mutual = random.uniform(-0.2, 0.05)
    drive = SixStepDrive(
        connection=connection,
        resistance=resistance,
        self_inductance=inductance / (1.0 - mutual),
        mutual_inductance=mutual * inductance / (1.0 - mutual),
        emf_constant=volts / speed * math.pi / 3.0 / (1.0 if connection == "delta" else math.sqrt(3.0)),
        pole_pairs=pairs,
        source_voltage=volts,
        source_resistance=ohms * random.uniform(0.005, 0.05),
        switch_resistance=ohms * random.uniform(0.005, 0.03),
        diode_drop=random.uniform(0.5, 0.9),
        inertia=1.0,
    )
    rated = volts / speed * current
    friction = rated * random.uniform(0.01, 0.1)
    share = random.uniform(0.2, 1.0)
    return replace(drive, coulomb_friction=friction * share, viscous_friction=friction * (1.0 - share) / speed), rated


def world(name: str, random: Random) -> World:
    """Draw a bench that runs at all loads, its drive as a row asks for."""
    while True:
        drive, rated = drawn_drive(random)
        if name == "phase advance":
            drive = replace(drive, advance_angle=random.choice((-1, 1)) * math.radians(log(random, 0.5, 20.0)))
        count = 3 if name == "three loads" else int(random.integers(4, 7))
        loads = rated * np.linspace(random.uniform(0.15, 0.4), random.uniform(0.7, 1.0), count)
        rise = log(random, 0.5, 50.0)
        # Heat goes with the square of the current, which goes with the load; a load lasts 5 s and is read after 4.
        constant, warm, read_warm = log(random, 2.0, 200.0), 0.0, []
        for load in loads:
            read_warm.append(load**2 + (warm - load**2) * math.exp(-4.0 / constant))
            warm = load**2 + (warm - load**2) * math.exp(-5.0 / constant)
        start = random.uniform(20.0, 30.0)
        temperatures = start + rise * np.array(read_warm) / warm
        reach = random.uniform(0.0, 1.0)
        magnets = start + reach * (temperatures - start)
        try:
            states = [
                balance_load(
                    Bridge(
                        replace(
                            drive,
                            resistance=drive.resistance * (1.0 + COPPER * (t - 25.0)),
                            emf_constant=drive.emf_constant * (1.0 + MAGNETS * (m - 25.0)),
                        )
                    ),
                    float(load),
                )
                for load, t, m in zip(loads, temperatures, magnets, strict=True)
            ]
        except SixStepError:
            continue
        if all(s.freewheel_time < 0.8 * s.state_time and s.speed > 0.2 * states[0].speed for s in states):
            break
    ones = np.ones(count)
    factors = {
        "voltage": ones * (1.0 + random.uniform(-VOLTAGE, VOLTAGE)),
        "current": ones * (1.0 + random.uniform(-CURRENT, CURRENT)),
        "line": (1.0 + random.uniform(-SCOPE, SCOPE)) * (1.0 + RANGES * random.standard_normal(count)),
        "speed": ones * (1.0 + random.uniform(-SPEED, SPEED)),
        "torque": ones * (1.0 + random.uniform(-TORQUE, TORQUE)),
        "zero": np.zeros(count),
        "clip": np.full(count, math.inf),
        "thermometer": np.array([start, start + rise]),
    }
    waves = [state.line_currents(np.linspace(0.0, state.period, WAVE))[0] for state in states]
    return World(drive, rated, states, waves, list(temperatures), factors)


def disturbed(name: str, plain: World, random: Random) -> World:
    """Return a bench with what one row does to its meters."""
    made = replace(plain, factors={key: values.copy() for key, values in plain.factors.items()})
    disturb(name, made, random, plain.rated)
    return made


def disturb(name: str, made: World, random: Random, rated: float) -> None:
    """Do to the meters what a row is about."""
    factors, count = made.factors, len(made.states)
    sign, at = float(random.choice((-1.0, 1.0))), int(random.integers(count))

    def one(of: str, low: float = 1e-4) -> None:
        # A slipped point is as likely as any other size.
        slip = float(random.choice((0.1, 10.0))) if random.random() < 0.2 else 1.0 + sign * log(random, low, 0.5)
        factors[of][at] *= slip

    if name.startswith("one ") or name.endswith("one bus voltage wrong"):
        quantity = "voltage" if "voltage" in name else name.split()[-2]
        one(quantity)
    if name.startswith("probe factor"):
        wrong = (
            float(random.choice((0.1, 0.5, 2.0, 10.0)))
            if random.random() < 0.3
            else 1.0 + sign * log(random, 2e-3, 0.5)
        )
        factors["line"] *= wrong
    if "'s gain" in name:
        quantity = {
            "bus current's gain": "current",
            "bus voltage's gain (not in the list)": "voltage",
            "speed's gain": "speed",
        }[name]
        factors[quantity] *= 1.0 + sign * log(random, 1e-3, 0.5)
    if name == "unsettled":
        # What is left of a settling speed when the tachometer and then the voltage are read, after the current's record.
        speeds = np.array([state.speed for state in made.states])
        factors["later"] = log(random, 1e-3, 0.5) * np.append(0.0, np.diff(speeds)) / speeds
    if name == "line clipped":
        peak = max(float(np.max(np.abs(wave))) for wave in made.waves)
        factors["clip"] = np.full(count, peak * random.uniform(0.6, 1.05))
    if name == "ripple on the bus current":
        factors["current"] *= 1.0 + log(random, 1e-4, 0.1) * random.uniform(-1.0, 1.0, count)
    if name == "torque's zero":
        factors["zero"] += sign * log(random, 1e-3, 0.3) * rated
    if name.startswith("voltage before the leads"):
        leads = log(random, 1e-3, 1.0) * made.drive.switch_resistance * 2.0
        factors["leads"] = np.full(count, leads)
    if name.startswith("bus voltage drifts"):
        factors["voltage"] *= 1.0 + sign * log(random, 1e-4, 0.03) * np.linspace(0.0, 1.0, count) ** 2
    if name.startswith("thermometer late"):
        factors["thermometer"][1] -= log(random, 0.5, 20.0)
    if name.startswith("iron loss"):
        made.iron = log(random, 1e-3, 0.1)


def points(made: World, random: Random, bench: Bench) -> LoadPoints:
    """Read the meters at every load."""
    f, found = made.factors, []
    zero = np.zeros(len(made.states))
    for k, state in enumerate(made.states):
        later = float(f.get("later", zero)[k])
        frequency = made.drive.pole_pairs * state.speed / (2.0 * math.pi)
        time = np.linspace(0.0, PERIODS / frequency, SAMPLES, endpoint=False) + random.uniform(0.0, 1.0 / frequency)
        line = np.interp(time % state.period, np.linspace(0.0, state.period, WAVE), made.waves[k])
        line = np.clip(line, -f["clip"][k], f["clip"][k]) * f["line"][k]
        step = 2.6 * float(np.max(np.abs(line))) / 256.0
        line = step * np.round((line + random.normal(0.0, 0.7 * step, line.size)) / step)
        current = state.average_supply_current
        volts = state.average_bus_voltage
        # Iron takes its torque before the shaft, from the same current.
        shaft = state.load_torque - made.iron * state.electromagnetic_torque * state.speed / made.states[0].speed

        def averaged(value: float, unit: str, gain: float, resolution: float, scatter: float) -> Averaged:
            read = resolution * np.round((value + random.normal(0.0, scatter, 10)) / resolution)
            accuracy = Accuracy(gain=gain, resolution=resolution, source="study")
            return Averaged(
                Reading(float(read.mean()), unit, accuracy, 0.0), float(read.std(ddof=1) / math.sqrt(10.0)), 9.0
            )

        speed = state.speed * (1.0 + later) * f["speed"][k]
        # The bus voltage goes on with the speed, as from load to load.
        first, last = made.states[0], made.states[-1]
        follows = (last.average_bus_voltage - first.average_bus_voltage) / (last.speed - first.speed)
        volts += follows * later * state.speed
        volts_read = (volts + f.get("leads", zero)[k] * current) * f["voltage"][k]
        found.append(
            LoadPoint(
                torque=state.load_torque,
                shaft_torque=averaged(
                    shaft * f["torque"][k] + f["zero"][k], "N·m", TORQUE, 1e-5 * abs(shaft), 1e-3 * shaft
                ),
                speed=Reading(
                    RPM * round(speed / RPM), "rad/s", Accuracy(gain=SPEED, resolution=RPM, source="study"), 0.0
                ),
                bus_voltage=averaged(volts_read, "V", VOLTAGE, 5e-5 * volts, 1e-4 * volts),
                bus_current=averaged(current * f["current"][k], "A", CURRENT, 1e-4 * current, 1e-3 * current),
                electrical_frequency=frequency * (1.0 + 1e-6 * random.standard_normal()),
                line=fold(time, line, frequency),
                current_accuracy=Accuracy(gain=SCOPE, source="study"),
                begun=5.0 * k,
                read=5.0 * k + 4.0,
            )
        )
    start, end = f["thermometer"]
    thermometer = bench.uncertainties.limit("thermometer", 0.0, 2.0)
    error = random.uniform(-2.0, 2.0)
    return LoadPoints.between(
        found, start + error + thermometer, end + error + thermometer, 5.0 * len(found), bench.uncertainties
    )


def truths(made: World, kept: Sequence[int]) -> dict[str, float]:
    """Return the true figures at the loads that count."""
    switch = made.drive.switch_resistance
    equivalent, copper = [], []
    for k in kept:
        state = made.states[k]
        current = state.average_supply_current
        volts = state.average_bus_voltage + float(made.factors.get("leads", np.zeros(len(made.states)))[k]) * current
        equivalent.append((volts - mean_line_emf(state.drive) * state.speed) / current)
        copper.append(balance.losses(state).copper / current**2)
    commutation = np.array(equivalent) - 2.0 * switch - np.array(copper)
    slope, offset = np.polyfit([made.states[k].speed for k in kept], commutation, 1)
    return {
        "line_emf_constant": mean_line_emf(made.drive),
        "switch_resistance": switch,
        "equivalent_resistance": equivalent[-1],
        "copper_resistance": copper[-1],
        "commutation_resistance": float(commutation[-1]),
        "commutation_resistance_slope": float(slope),
        "commutation_resistance_offset": float(offset),
    }


def measured(made: World, name: str, random: Random) -> ProcedureResult:
    """Return what the procedure finds of a bench's readings. Raises EstimationError or ProcedureError where it refuses them."""
    drive, nobody, record = made.drive, cast("Any", None), cast("Any", NoRecord())
    bench = Bench({}, nobody, SystemClock(), record)
    plate = Nameplate(
        name="drawn", connection=WindingConnection(drive.connection), rated_current=1.0, pole_pairs=drive.pole_pairs
    )
    settings = EquivalentResistanceSettings(
        winding_resistance=drive.resistance * (1.0 + random.uniform(-0.02, 0.02)),
        winding_inductance=(drive.self_inductance - drive.mutual_inductance) * (1.0 + random.uniform(-0.05, 0.05)),
        switch_resistance=drive.switch_resistance if "R_t given" in name else None,
    )
    read = points(made, random, bench)

    procedure: Any = EquivalentResistance(bench, plate, settings, {})
    procedure.load_points = lambda: read
    found: ProcedureResult = procedure.run()
    return found


def take(row: Row, name: str, made: World, random: Random) -> None:
    """Take one record into account."""
    row.records += 1
    try:
        result = measured(made, name, random)
    except (EstimationError, ProcedureError):
        row.refused += 1
        return
    misfit = result.findings.get("misfit", ())
    causes = {finding["cause"] for finding in misfit}
    row.causes.update(causes)
    row.warned += bool(causes)
    row.withheld += bool(result.withheld)
    counting = {each["load_torque"] for each in result.findings["points"]}
    kept = [k for k, state in enumerate(made.states) if state.load_torque in counting]
    expected = truths(made, kept)
    for parameter in result.parameters:
        low, high = parameter.coverage_interval
        truth, half = expected[parameter.name], 0.5 * (high - low)
        row.figures += 1
        held = low <= truth <= high
        row.held += held
        if not held:
            row.missed[parameter.name] += 1
        row.beyond += abs(0.5 * (low + high) - truth) > 3.0 * half
        if parameter.name == "line_emf_constant":
            row.width.append(half / truth)


def rows_of(numbers: Sequence[int], seed: int, batch: Sequence[int]) -> list[Row]:
    """Return the rows of some numbers from the drives of one batch."""
    rows = [Row() for _ in numbers]
    for index in batch:
        plain = world("", np.random.default_rng([seed, index]))
        for row, number in zip(rows, numbers, strict=True):
            name, random = ROWS[number], np.random.default_rng([seed, index, number])
            own = world(name, random) if name in OWN_DRIVE else plain
            take(row, name, disturbed(name, own, random), random)
    return rows


def line_of(name: str, row: Row) -> str:
    """Return a row of the table."""
    causes = ", ".join(f"{c} {n / row.records:.0%}" for c, n in row.causes.most_common())
    held = f"{row.held / row.figures:.1%}" if row.figures else "–"
    width = f"{np.median(row.width):.2%}" if row.width else "–"
    return (
        f"| {name} | {held} | {row.beyond} | {width} | {row.warned / row.records:.1%} | "
        f"{row.withheld / row.records:.1%} | {row.refused / row.records:.1%} | {causes} |"
    )


def main() -> None:
    """Print the table."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--records", type=int, default=100)
    parser.add_argument("--seed", type=int, default=1)
    parser.add_argument("--workers", type=int, default=1, help="processes of this machine")
    parser.add_argument("--missed", action="store_true", help="name the figures that were not held")
    parser.add_argument("--row", type=int, action="append", help="this row alone, by its number from 0")
    given = parser.parse_args()
    numbers = given.row or range(len(ROWS))
    print("| record | held, total | beyond 3 U | median U of k_e | reported | withheld | refused | named |")
    print("| --- | ---: | ---: | ---: | ---: | ---: | ---: | --- |")
    batches = [range(given.records)[begin : begin + _BATCH] for begin in range(0, given.records, _BATCH)]
    rows = [Row() for _ in numbers]
    with ProcessPoolExecutor(given.workers) as pool:
        for made in pool.map(partial(rows_of, numbers, given.seed), batches):
            for row, more in zip(rows, made, strict=True):
                row.add(more)
    for number, row in zip(numbers, rows, strict=True):
        print(line_of(ROWS[number], row), flush=True)
        if given.missed:
            print("  ", dict(row.missed), flush=True)


if __name__ == "__main__":
    main()
