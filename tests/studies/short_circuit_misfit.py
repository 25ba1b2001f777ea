"""How often the intervals of `analyze short-circuit` hold, on tables by formula of random motors with and without disturbances.

python -m tests.studies.short_circuit_misfit [--tables 100] [--seed 1] [--rows NAME …] [--torques no yes] [--limits none]

Sizes of disturbances are log-uniform. Rows of instruments' errors are judged with the limits that the command takes where none is
stated (--saturation 0 for motors of constants), the others with none, so that nothing hides what the disturbance does.
"""

import argparse
import math
import zlib
from collections.abc import Callable
from dataclasses import dataclass, field

import numpy as np

from bench.analysis.short_circuit import USUAL_FLUX, LimitsOfTable, limits_of
from procedures.estimation.flux.short_circuit import fit_short_circuit
from procedures.estimation.flux.short_limits import ShortLimits
from tests.studies.worlds.short_circuit_worlds import WORLDS, Constant, Shorted, constants

PAIRS, ROWS = 4, 9
NAMES = {
    "chord_inductance": "d_axis_inductance",
    "q_axis_inductance": "q_axis_inductance",
    "resistance": "stator_resistance",
}
#: Between which a size is drawn.
Ends = tuple[float, float] | None


@dataclass(frozen=True)
class Disturbance:
    """What befalls a table, in shares; sizes are drawn between these ends, nothing where there are none.

    Warming takes a share of the flux linkage and adds three to six times as much to the resistance; iron takes a share of the heat at the
    highest speed, friction and zero one of the largest torque; the phase probed is off alike at all speeds, or otherwise at low speed
    than at high.
    """

    warming: Ends = None
    iron: Ends = None
    phase: Ends = None
    windings: Ends = None
    speed: Ends = None
    current: Ends = None
    torque: Ends = None
    zero: Ends = None
    friction: Ends = None
    flux: Ends = None
    drop: Ends = None
    limits: bool = False
    world: Callable[[np.random.Generator], Shorted] = field(default=constants)


ROWS_OF: dict[str, Disturbance] = {
    "clean": Disturbance(),
    "warming": Disturbance(warming=(5e-4, 0.04)),
    "iron loss": Disturbance(iron=(1e-3, 0.1)),
    "strong iron loss": Disturbance(iron=(0.05, 0.4)),
    "friction": Disturbance(friction=(1e-3, 0.1)),
    "voltage drop": Disturbance(drop=(1e-4, 0.05)),
    "clean, usual limits": Disturbance(limits=True),
    "unequal phases": Disturbance(phase=(5e-4, 0.03), limits=True),
    "unequal windings": Disturbance(windings=(5e-4, 0.03), limits=True),
    "speed error": Disturbance(speed=(1e-4, 0.01), limits=True),
    "current gain": Disturbance(current=(2e-4, 0.02), limits=True),
    "torque gain": Disturbance(torque=(1e-4, 5e-3), limits=True),
    "torque zero": Disturbance(zero=(1e-4, 5e-3), limits=True),
    "flux linkage's error": Disturbance(flux=(2e-4, 0.02), limits=True),
    "warming and phases": Disturbance(warming=(5e-4, 0.04), phase=(5e-4, 0.03), limits=True),
    "iron loss and friction": Disturbance(iron=(1e-3, 0.1), friction=(1e-3, 0.1)),
    **{name: Disturbance(limits=True, world=world) for name, world in WORLDS.items()},
}
#: Rows that only a torque shows.
OF_TORQUE = (
    "iron loss",
    "strong iron loss",
    "friction",
    "voltage drop",
    "torque gain",
    "torque zero",
    "iron loss and friction",
)


def judged(
    seed: int, index: int, row: str, torques: bool, limited: bool | None = None
) -> dict[str, tuple[bool, bool, float] | None]:
    """Return of each figure whether it is held, whether it lies beyond 3 U, and U/value; None where it is withheld."""
    random = np.random.default_rng([seed, index])
    given = ROWS_OF[row]
    motor = given.world(random)
    noise = math.exp(random.uniform(math.log(5e-4), math.log(5e-3)))
    readings = random.standard_normal((2, ROWS))
    chance = np.random.default_rng([seed, index, zlib.crc32(row.encode())])

    def size(ends: Ends) -> float:
        return math.exp(chance.uniform(*np.log(ends))) if ends else 0.0

    def signed(ends: Ends) -> float:
        return float(chance.choice([-1.0, 1.0])) * size(ends)

    warming, along = size(given.warming), np.linspace(0.0, 1.0, ROWS)
    speed = motor.speeds(ROWS)
    amplitude, heat, y = motor.turned(
        speed, 1.0 + chance.uniform(3.0, 6.0) * warming * along, 1.0 - warming * along, size(given.drop)
    )
    relative = speed / speed[-1]
    heat = heat * (1.0 + size(given.iron) * relative**2)
    torque = heat * PAIRS / speed
    torque = torque + np.max(torque) * (size(given.friction) + size(given.friction) * relative + signed(given.zero))
    low, high = signed(given.windings), signed(given.windings)
    probed = signed(given.phase) + high + (low - high) / (1.0 + y**2)
    torque = torque * (1.0 + signed(given.torque)) * (1.0 + noise * readings[1])
    limits = ShortLimits()
    usual = given.limits if limited is None else limited
    if usual:
        stated = LimitsOfTable(saturation=0.0 if isinstance(motor, Constant) else None)
        limits = limits_of(stated, largest_torque=float(np.max(np.abs(torque))) if torques else 0.0)
    fit = fit_short_circuit(
        speed * (1.0 + signed(given.speed)),
        amplitude * (1.0 + probed) * (1.0 + signed(given.current)) * (1.0 + noise * readings[0]),
        torque if torques else None,
        pole_pairs=PAIRS,
        flux_linkage=motor.flux * (1.0 + signed(given.flux)),
        u_flux_linkage=USUAL_FLUX * motor.flux if usual else 0.0,
        limits=limits,
    )
    result: dict[str, tuple[bool, bool, float] | None] = {}
    for name, truth in zip(NAMES, motor.truths(speed), strict=True):
        figure = getattr(fit, name) or (fit.resistance_by_current if name == "resistance" else None)
        if figure is None or fit.misfit.withholding(NAMES[name]) is not None:
            result[name] = None
            continue
        low_end, high_end = figure.coverage_interval
        side = high_end - figure.value if truth > figure.value else figure.value - low_end
        result[name] = (
            low_end <= truth <= high_end,
            abs(truth - figure.value) > 3.0 * side,
            0.5 * (high_end - low_end) / figure.value,
        )
    return result


def main() -> None:
    """Measure and print."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--tables", type=int, default=100)
    parser.add_argument("--seed", type=int, default=1)
    parser.add_argument("--rows", nargs="*", default=[*ROWS_OF], metavar="NAME")
    parser.add_argument("--torques", nargs="*", default=["no", "yes"], choices=["no", "yes"])
    parser.add_argument("--limits", choices=["none", "usual"], default=None, help="instead of each row's own")
    given = parser.parse_args()
    if unknown := set(given.rows) - set(ROWS_OF):
        parser.error(f"no such row: {', '.join(unknown)}; there are {', '.join(ROWS_OF)}")
    limited = None if given.limits is None else given.limits == "usual"
    print(
        "| table | torques | figure | held | beyond 3 U | median U | withheld |\n| --- | --- | --- | ---: | ---: | ---: | ---: |"
    )
    for row in given.rows:
        for torques in given.torques:
            if torques == "no" and row in OF_TORQUE:
                continue
            found = [judged(given.seed, index, row, torques == "yes", limited) for index in range(given.tables)]
            for name in NAMES:
                kept = [each for one in found if (each := one[name]) is not None]
                held, beyond, width = zip(*kept, strict=True) if kept else ((0,), (0,), (0.0,))
                print(
                    f"| {row} | {torques} | {NAMES[name]} | {np.mean(held):.1%} | {sum(beyond)} "
                    f"| {np.median(width):.2%} | {len(found) - len(kept)} |",
                    flush=True,
                )


if __name__ == "__main__":
    main()
