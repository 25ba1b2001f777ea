"""Meters that are wrong alike at every reading: a current scale, against the flux linkage; a voltmeter that averages.

`python -m tests.studies.wrong_meters [--motors N] [--seed S] [--share LEAST MOST] {current-scale,averaging}`

Random motors on benches whose instruments have errors as specified, and this one besides: the inverter's current is off by a share,
log-uniform between the two, either way; or such a share of the voltage is missing at the first reading. `--share 0 0` is none of it.
"""

import argparse
import math
from collections import Counter
from collections.abc import Callable
from dataclasses import replace
from typing import Any

import numpy as np

from procedures.core.bench import ProcedureError, Role
from procedures.core.result import Parameter, ProcedureResult
from sim_instruments.bench import VirtualBench
from sim_instruments.instruments.errors import Errors
from sim_instruments.physics.motor.motor import VirtualMotor
from tests.runs.on_bench import measure
from tests.studies.worlds.random_motors import draw_motor

#: How well λ is known (relative), and when after switching on a first reading is over (s).
_FLUX, _FIRST = 0.0129, 0.6


class Watched:
    """A supply that notes when it is switched on."""

    def __init__(self, supply: Any, clock: Any) -> None:
        self._supply, self._clock, self.since = supply, clock, 0.0

    def __getattr__(self, name: str) -> Any:
        return getattr(self._supply, name)

    def energised(self, *arguments: Any, **named: Any) -> Any:
        self.since = self._clock.now()
        return self._supply.energised(*arguments, **named)


class Averaging:
    """A voltmeter that comes to a new voltage with a time constant (s)."""

    def __init__(self, meter: Any, supply: Watched, time_constant: float) -> None:
        self._meter, self._supply, self._time_constant = meter, supply, time_constant

    def __getattr__(self, name: str) -> Any:
        return getattr(self._meter, name)

    def measure_voltage(self) -> Any:
        reading = self._meter.measure_voltage()
        missing = math.exp(-(reading.time - self._supply.since) / self._time_constant)
        return replace(reading, value=reading.value * (1.0 - missing))


def averaging(bench: VirtualBench, time_constant: float) -> Callable[[dict[Role, Any], Any], Any]:
    """Return what puts such a voltmeter on a bench."""

    def hands(available: dict[Role, Any], operator: Any) -> Any:
        available[Role.SUPPLY] = supply = Watched(available[Role.SUPPLY], bench.clock)
        available[Role.VOLTMETER] = Averaging(available[Role.VOLTMETER], supply, time_constant)
        return operator

    return hands


def known(motor: VirtualMotor, flux_error: float = 0.0) -> dict[str, Parameter]:
    """Return what other procedures found: the flux linkage, off by a share, and the pole pairs."""

    def given(name: str, value: float, unit: str, share: float) -> Parameter:
        u = share * value
        return Parameter(name, value, unit, u, math.inf, (value - 2.0 * u, value + 2.0 * u), "other", "3", "fit")

    return {
        "flux_linkage": given("flux_linkage", (1.0 + flux_error) * motor.flux_linkage_y, "V·s/rad", _FLUX),
        "pole_pairs": given("pole_pairs", float(motor.pole_pairs), "1", 0.0),
    }


def measured(kind: str, seed: int, share: tuple[float, float]) -> tuple[ProcedureResult, float]:
    """Return the result of one motor, and the truth. Raises ProcedureError."""
    random = np.random.default_rng([seed, 9])
    motor, plate = draw_motor(random)
    errors = Errors.drawn(random)
    size = math.exp(random.uniform(math.log(share[0]), math.log(share[1]))) if share[0] else 0.0
    if kind == "current-scale":
        off = (1.0 + errors.inverter.current_gain) * (1.0 + size * random.choice([-1.0, 1.0])) - 1.0
        errors = replace(errors, inverter=replace(errors.inverter, current_gain=off))
        flux = math.sqrt(3.0) * _FLUX * random.uniform(-1.0, 1.0)
        with VirtualBench(motor, seed=seed, sockets=False, errors=errors) as bench:
            return measure(bench, plate, "torque-constant", known=known(motor, flux)), motor.torque_constant
    with VirtualBench(motor, seed=seed, sockets=False, errors=errors) as bench:
        hands = averaging(bench, _FIRST / math.log(1.0 / size)) if size else lambda _, operator: operator
        return measure(bench, plate, "stator-resistance-dc", hands=hands), motor.stator_resistance_y


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("kind", choices=["current-scale", "averaging"])
    parser.add_argument("--motors", type=int, default=100)
    parser.add_argument("--seed", type=int, default=1)
    parser.add_argument("--share", type=float, nargs=2, default=(1e-3, 0.2))
    given = parser.parse_args()
    counted: Counter[str] = Counter()
    widths = []
    for place in range(given.motors):
        try:
            result, truth = measured(given.kind, 1000 * given.seed + place, tuple(given.share))
        except ProcedureError:
            counted["refused"] += 1
            continue
        said = {notice.identifier for notice in result.warnings} & {"channels-differ", "unsettled"}
        counted["told"] += bool(said)
        counted["withheld"] += bool(result.withheld)
        for parameter in result.parameters:
            low, high = parameter.coverage_interval
            held = low <= truth <= high
            counted["figures"] += 1
            counted["held"] += held
            counted["sure and wrong"] += not held and not said
            counted["beyond 3 U"] += abs(parameter.value - truth) > 1.5 * (high - low)
            widths.append(0.5 * (high - low) / truth)
    names = ("figures", "held", "sure and wrong", "beyond 3 U", "told", "withheld", "refused")
    print(f"{given.kind}, {given.motors} motors: ", ", ".join(f"{name} {counted[name]}" for name in names))
    print(f"median U {np.median(widths):.2%}" if widths else "no figure")


if __name__ == "__main__":
    main()
