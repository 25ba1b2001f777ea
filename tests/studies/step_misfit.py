"""How the fit of a current step does on disturbed records: `python -m tests.studies.step_misfit --records N`."""

import argparse
import time
from dataclasses import dataclass, field

import numpy as np

from procedures.estimation.fitting.fit import EstimationError, WithheldError
from procedures.estimation.winding.step_response import StepFit, fit_step_response
from tests.studies.disturbed_steps import ROWS, Sampled, row, sampled

#: Limits of a channel's gain, as its data sheet states them.
GAINS = (0.0, 0.003, 0.01)
NAMES = ("resistance", "inductance")


@dataclass
class Tally:
    """What became of the records of one row; z by estimate and by limit of the gains."""

    withheld: int = 0
    refused: int = 0
    warned: int = 0
    z: dict[tuple[str, float], list[float]] = field(default_factory=dict)
    ratio: dict[str, list[float]] = field(default_factory=dict)
    causes: dict[str, int] = field(default_factory=dict)
    seconds: list[float] = field(default_factory=list)

    def take(self, record: Sampled, random: np.random.Generator) -> None:
        """Fit one record, and add what came of it."""
        begun = time.process_time()
        try:
            fit = fit_step_response(
                record.time,
                record.voltage,
                record.current,
                voltage_resolution=record.voltage_step,
                current_resolution=record.current_step,
                voltage_ends=record.voltage_ends,
                current_ends=record.current_ends,
            )
        except WithheldError:
            self.withheld += 1
            return
        except EstimationError:
            self.refused += 1
            return
        finally:
            self.seconds.append(time.process_time() - begun)
        for cause in {f.cause.value for f in fit.misfit.findings}:
            self.causes[cause] = self.causes.get(cause, 0) + 1
        self.warned += bool(fit.misfit)
        held_back = [name for name in NAMES if fit.misfit.withholding(name)]
        self.withheld += bool(held_back)
        for name in NAMES:
            if name not in held_back:
                self._compare(name, fit, record, random)

    def _compare(self, name: str, fit: StepFit, record: Sampled, random: np.random.Generator) -> None:
        plain = fit.plain_uncertainty(name)
        self.ratio.setdefault(name, []).append(fit.uncertainty(name) / plain)
        truth = record.resistance if name == "resistance" else record.inductance
        for limit in GAINS:
            gains = (1 + random.uniform(-limit, limit)) / (1 + random.uniform(-limit, limit))
            # Each channel's gain, and for the inductance half a sampling interval between them.
            relative = np.sqrt(2.0 / 3.0) * limit
            value = fit.value(name)
            timing = fit.timing * value / np.sqrt(3.0) if name == "inductance" and limit else 0.0
            u = np.sqrt(fit.uncertainty(name) ** 2 + (relative * value) ** 2 + timing**2)
            self.z.setdefault((name, limit), []).append((value * gains - truth) / u)


def line(name: str, tally: Tally, count: int) -> str:
    """Return the row's figures."""
    cells = []
    for estimate in NAMES:
        for limit in GAINS:
            z = np.abs(tally.z.get((estimate, limit), []))
            cells.append(f"{100 * np.mean(z < 1.96):.0f}/{int(np.sum(z > 6)):d}" if z.size else "–")
    ratios = "  ".join(f"{np.mean(tally.ratio[n]):5.2f}" if tally.ratio.get(n) else "    –" for n in NAMES)
    causes = ", ".join(f"{c} {100 * k / count:.0f}" for c, k in sorted(tally.causes.items(), key=lambda x: -x[1]))
    return (
        f"{name:<24}" + "".join(f"{c:>8}" for c in cells) + f"{100 * tally.warned / count:6.0f}"
        f"{100 * (tally.withheld) / count:6.0f}{100 * tally.refused / count:6.0f}   {ratios}"
        f"{1e3 * np.mean(tally.seconds):7.1f}{1e3 * np.max(tally.seconds):7.0f}   {causes}"
    )


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--records", type=int, default=200)
    parser.add_argument("--seed", type=int, default=1)
    parser.add_argument("--bits", type=int, default=None)
    parser.add_argument("--rows", nargs="*", default=ROWS)
    given = parser.parse_args()
    print("held % / beyond 3 U, by limit of the gains; warned, withheld, refused %; mean U over the plain fit's; ms")
    heads = [f"{n[0].upper()} {100 * g:g}%" for n in NAMES for g in GAINS]
    print(
        f"{'row':<24}" + "".join(f"{h:>8}" for h in heads) + "  warn  held  refd    U(R)   U(L)   mean   max  causes %"
    )
    for name in given.rows:
        tally, random = Tally(), np.random.default_rng(given.seed)
        for record in sampled(
            row(name, given.records, given.seed),
            bits=given.bits,
            noise=(0.4 if name in ("clipped", "voltage clipped") else 0.15, 2.0),
        ):
            tally.take(record, random)
        print(line(name, tally, given.records), flush=True)


if __name__ == "__main__":
    main()
