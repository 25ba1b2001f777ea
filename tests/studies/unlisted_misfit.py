"""Results of records whose cause is in no estimator's list: held, reported, withheld, or sure and wrong.

`python -m tests.studies.unlisted_misfit [--records N] [--seed S] [--rows WORD …]`

Magnitudes are log-uniform from negligible to gross; limits of gain of 0.3 % (step: each channel; ramps: torque) and 1 % (back-EMF).
"Sure and wrong" are figures that do not hold the truth while nothing is said, as a share of the records.
"""

import argparse
from collections import Counter
from collections.abc import Callable
from dataclasses import dataclass, field, replace

import numpy as np

from procedures.estimation.emf.back_emf import fit_back_emf
from procedures.estimation.emf.integrated_flux import flux_by_integration
from procedures.estimation.emf.record import DigitizedChannel
from procedures.estimation.fitting.fit import EstimationError, coverage_interval
from procedures.estimation.fitting.misfit import Misfit
from procedures.estimation.mechanics.inertia import fit_ramps
from procedures.estimation.winding.current_step.response import fit_step_response
from tests.studies.worlds.shaft_records import draw, move, record
from tests.studies.worlds.unlisted_worlds import Random, converter, emf, exported, log, step_channel, steps, turned

STEP = (
    "nothing", "60 Hz hum with its third", "aliased ripple", "missing codes", "bent converter", "clock drifts", "winding warms",
    "magnetised probe", "probe's offset drifts", "dropouts at the start", "supply folds back", "samples lost",
    "rows repeated", "one channel's rows repeated",
)  # fmt: skip
EMF = (
    "nothing", "60 Hz hum with its third", "aliased ripple", "missing codes", "bent converter", "clock drifts", "gain warms up",
    "speed wobbles", "dropouts at the start", "polarities unequal", "converter's segments", "second and third order",
    "dead zone", "slews", "remembers", "gaps between magnets", "odd harmonics",
    "rows repeated", "smoothed", "filtered", "one channel's rows repeated",
)  # fmt: skip
RAMPS = (
    "nothing", "a tooth is missing", "one tooth is off", "coupling with backlash", "clock drifts", "display refreshes",
    "tachometer's zero", "rows repeated",
)  # fmt: skip
STEP_GAIN, EMF_GAIN, TORQUE_GAIN = 0.003, 0.01, 0.003
_BATCH = 100


@dataclass
class Tally:
    """What became of a row's records, and of one figure of them."""

    records: int = 0
    given: int = 0
    held: int = 0
    beyond: int = 0
    told: int = 0
    wrong: int = 0
    sizes: list[float] = field(default_factory=list)
    causes: Counter[str] = field(default_factory=Counter)

    def take(self, misfit: Misfit | None, figure: str, truth: float, value: float, half: float) -> None:
        """Take a record's figure; a record without one has no misfit."""
        self.records += 1
        if misfit is None or misfit.withholding(figure):
            return
        off = abs(value - truth)
        self.given += 1
        self.told += bool(misfit)
        self.causes.update({f.cause.value for f in misfit.findings})
        self.held += off <= half
        self.beyond += off > 3.0 * half
        self.wrong += off > half and not misfit
        self.sizes.append(half / truth)


Row = dict[str, Tally]


def of_steps(name: str, records: int, random: Random) -> Row:
    """Take steps of the current."""
    row = {"resistance": Tally(), "inductance": Tally()}
    for begin in range(0, records, _BATCH):
        for time, volts, amperes in zip(*(x.T for x in steps(name, random, min(_BATCH, records - begin))), strict=True):
            tau, code, noise = (
                log(random, 3e-4, 1e-2),
                1.0 / (0.8 * 2 ** int(random.choice([8, 12]))),
                log(random, 0.15, 2.0),
            )
            at, v, i = step_channel(name, random, time, volts, amperes, 2.0 * np.pi * 50.0 * tau)
            read = [
                converter(name, random, code)(
                    x + random.uniform(-0.05, 0.05) + noise * code * random.standard_normal(x.size)
                )
                for x in (v, i)
            ]
            read = exported(name, random, np.array(read))
            try:
                fit = fit_step_response(at * tau, *read, voltage_resolution=code, current_resolution=code)
            except EstimationError:
                for tally in row.values():
                    tally.take(None, "", 1.0, 0.0, 0.0)
                continue
            for figure, truth in (("resistance", 1.0), ("inductance", tau)):
                gain = (1.0 + random.uniform(-STEP_GAIN, STEP_GAIN)) / (1.0 + random.uniform(-STEP_GAIN, STEP_GAIN))
                late = fit.timing / np.sqrt(3.0) if figure == "inductance" else 0.0
                limits = fit.value(figure) * np.hypot(STEP_GAIN * np.sqrt(2.0 / 3.0), late)
                half = 1.96 * float(np.hypot(fit.uncertainty(figure), limits))
                row[figure].take(fit.misfit, figure, truth, fit.value(figure) * gain, half)
    return row


def of_emf(name: str, records: int, random: Random) -> Row:
    """Take records of a back-EMF."""
    tally = Tally()
    for _ in range(records):
        time, v, truth, step = emf(name, random, EMF_GAIN)
        channels = [DigitizedChannel(f"CH{k + 1}", step, None, EMF_GAIN) for k in range(3)]
        try:
            fit = fit_back_emf(time, v, digitized=channels)
            flux, misfit = fit.flux_linkage, fit.misfit
            if fit.drift_significant:
                whole = flux_by_integration(time, v, frequency=fit.frequency, digitized=channels)
                flux, misfit = whole.flux_linkage, whole.misfit
        except EstimationError:
            tally.take(None, "", 1.0, 0.0, 0.0)
            continue
        low, high = coverage_interval(flux.value, flux.uncertainty, flux.degrees_of_freedom)
        half = float(np.hypot(0.5 * (high - low), 2.0 * flux.value * EMF_GAIN / 3.0))
        tally.take(misfit, "flux_linkage", truth, flux.value, half)
    return {"flux_linkage": tally}


def of_ramps(name: str, records: int, random: Random) -> Row:
    """Take driven ramps with their coast-downs."""
    row = {figure: Tally() for figure in ("inertia", "coulomb_friction", "viscous_friction")}
    for begin in range(0, records, _BATCH):
        shafts = [draw(random) for _ in range(min(_BATCH, records - begin))]
        for shaft, motion in zip(shafts, move(shafts), strict=True):
            gain = 1.0 + random.uniform(-TORQUE_GAIN, TORQUE_GAIN)
            ramps = record(shaft, turned(name, random, shaft, motion), random)
            ramps = [replace(ramp, speed=exported(name, random, ramp.speed[None])[0]) for ramp in ramps]
            try:
                fit = fit_ramps(ramps)
            except EstimationError:
                for tally in row.values():
                    tally.take(None, "", 1.0, 0.0, 0.0)
                continue
            for figure, truth in zip(row, (shaft.inertia, shaft.coulomb, shaft.viscous), strict=True):
                half = 2.0 * float(np.hypot(fit.uncertainty(figure), fit.value(figure) * TORQUE_GAIN / np.sqrt(3.0)))
                row[figure].take(fit.misfit, figure, truth, fit.value(figure) * gain, half)
    return row


KINDS: dict[str, tuple[Callable[[str, int, Random], Row], tuple[str, ...]]] = {
    "step": (of_steps, STEP),
    "back-EMF": (of_emf, EMF),
    "ramps": (of_ramps, RAMPS),
}


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--records", type=int, default=100)
    parser.add_argument("--seed", type=int, default=1)
    parser.add_argument("--rows", nargs="*", default=[""], help="parts of the rows' names")
    given = parser.parse_args()
    print(
        "| record | figure | held, % | beyond 3 U | sure and wrong, % | reported, % | not given, % | median U, % | named |"
    )
    print("| --- | --- | ---: | ---: | ---: | ---: | ---: | ---: | --- |")
    for kind, (measured, names) in KINDS.items():
        for name in names:
            title = f"{kind}: {name}"
            if not any(word in title for word in given.rows):
                continue
            seed = np.random.default_rng([given.seed, *title.encode()])
            for figure, t in measured(name, given.records, seed).items():
                causes = ", ".join(f"{c} {100 * k // t.records}" for c, k in t.causes.most_common(4))
                held, told = (100.0 * x / max(t.given, 1) for x in (t.held, t.told))
                wrong, gone = 100.0 * t.wrong / t.records, 100.0 * (1.0 - t.given / t.records)
                size = 100.0 * float(np.median(t.sizes)) if t.sizes else np.nan
                print(
                    f"| {title} | {figure} | {held:.1f} | {t.beyond} | {wrong:.1f} | {told:.1f} | {gone:.1f} | {size:.2g} | {causes} |",
                    flush=True,
                )


if __name__ == "__main__":
    main()
