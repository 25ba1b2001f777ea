"""Back-EMF records with one cause or two that the waveform's model does not hold: what is held, what is said.

`python -m tests.studies.emf_misfit --records N --workers 2`; `--without hum` is the estimator that does not know of hum.
"""

import argparse
from concurrent.futures import ProcessPoolExecutor
from dataclasses import dataclass, field

import numpy as np

from drivers.interfaces import Accuracy
from procedures.core.budget import Uncertainties
from procedures.estimation.emf import agreement, back_emf, integrated_flux, record_preparation
from procedures.estimation.emf.back_emf import fit_back_emf
from procedures.estimation.emf.coupling import coupling_finding, shortfall
from procedures.estimation.emf.integrated_flux import flux_by_integration
from procedures.estimation.emf.record import DigitizedChannel
from procedures.estimation.emf.speed_trend import over_speeds
from procedures.estimation.fitting.fit import EstimationError, coverage_interval
from procedures.estimation.fitting.misfit import Cause, Misfit
from tests.studies.worlds.emf_records import Setup, draw, large, record, spoil

CAUSES = (
    "clipped both sides",
    "clipped one side",
    "one channel's gain",
    "all gains",
    "probe factor",
    "AC coupled",
    "hum",
    "noise below 0.1 LSB",
    "cut before the noise",
    "cut before the noise, one side",
    "one probe cut",
    "one probe soft",
    "trapezoid",
    "frozen",
    "spikes",
    "samples lost",
)
PAIRS = (
    ("clipped both sides", "hum"),
    ("clipped one side", "one channel's gain"),
    ("AC coupled", "all gains"),
    ("hum", "noise below 0.1 LSB"),
)


@dataclass
class Tally:
    """What a row's records came to."""

    given: int = 0
    held: int = 0
    far: int = 0
    withheld: int = 0
    told: int = 0
    records: int = 0
    sizes: list[float] = field(default_factory=list)
    causes: dict[str, int] = field(default_factory=dict)

    def count(self, misfit: Misfit, true: float, interval: tuple[float, float, float]) -> None:
        """Count one record: its misfit, the truth, and lower end, value and upper end of what was given."""
        self.records += 1
        self.told += bool(misfit)
        for finding in misfit.findings:
            self.causes[finding.cause.value] = self.causes.get(finding.cause.value, 0) + 1
        if misfit.withholding("flux_linkage"):
            self.withheld += 1
            return
        low, value, high = interval
        self.given += 1
        self.held += low <= true <= high
        self.far += not value - 3 * (value - low) <= true <= value + 3 * (high - value)
        self.sizes.append(0.5 * (high - low) / true)

    def line(self) -> str:
        """Return it as a row of the table."""
        held = f"{100 * self.held / self.given:.1f}" if self.given else "–"
        half_width = f"{100 * np.median(self.sizes):.2g}" if self.sizes else "–"
        shares = (f"{100 * count / self.records:.1f}" for count in (self.withheld, self.told))
        return " | ".join((held, str(self.far), *shares, half_width))


def judge(tally: Tally, random: np.random.Generator, setup: Setup, *, gain_limit: float, coupling_known: bool) -> None:
    """Estimate one record and count what became of it."""
    time, v = record(random, setup)
    channels = [DigitizedChannel(f"CH{k + 1}", setup.step, None, gain_limit) for k in range(3)]
    try:
        fit = fit_back_emf(time, v, digitized=channels)
        flux, misfit = fit.flux_linkage, fit.misfit
        if fit.drift_significant:
            integrated = flux_by_integration(time, v, frequency=fit.frequency, digitized=channels)
            flux, misfit = integrated.flux_linkage, integrated.misfit
    except EstimationError:
        tally.records += 1
        tally.withheld += 1
        return
    inputs = Uncertainties()
    value = inputs.statistical("fit", flux.value, flux.uncertainty, flux.degrees_of_freedom)
    gains = [inputs.instrument(c.name, 1.0, Accuracy(gain=gain_limit, source="stated")) for c in channels]
    value = value * sum(gains[1:], gains[0]) / 3.0
    if not coupling_known:
        value = value * inputs.one_sided("coupling", 1.0, shortfall(fit.frequency))
        said = coupling_finding(fit.frequency, ["CH1"], stated=False)
        misfit = Misfit.together((misfit, Misfit((said,) if said else ())))
    made = inputs.parameter("flux_linkage", "V·s/rad", value, procedure="", section="", estimator="")
    low, high = made.coverage_interval
    tally.count(misfit, setup.flux, (low, made.value, high))


#: Flux linkages that change along a record; last, so that the other rows draw what they drew before.
CHANGING = ("once per turn", "part of a turn", "slow drift", "once per turn, slow drift")
ROWS = {
    "nothing": (),
    **{cause: (cause,) for cause in CAUSES},
    **{" and ".join(pair): pair for pair in PAIRS},
    **{cause: (cause,) for cause in CHANGING},
}


def row(name: str, records: int, gain_limit: float, seed: int) -> Tally:
    """Return the tally of records with what a row is named by."""
    random = np.random.default_rng([seed, list(ROWS).index(name)])
    tally = Tally()
    for _ in range(records):
        setup = draw(random, gain_limit=gain_limit)
        for cause in ROWS[name]:
            setup = spoil(random, setup, cause)
        judge(tally, random, setup, gain_limit=gain_limit, coupling_known="AC coupled" not in ROWS[name])
    return tally


#: What the estimator is without a cause: where it looks for it, and what it then finds.
WITHOUT: dict[Cause, tuple[object, str, object]] = {
    Cause.CLIPPED: (record_preparation, "find_ends", lambda *_: False),
    Cause.HUM: (record_preparation, "find_hum", lambda *_: None),
    Cause.DROPOUTS: (record_preparation, "leave_out_dropouts", lambda *_: None),
    Cause.PROBE_FACTOR: (agreement, "_contradicting", lambda *_: None),
    Cause.CHANNELS_DIFFER: (agreement, "_CHANCE", 1e-300),
    Cause.TOO_COARSE: (record_preparation, "undithered_sine", lambda *_: 0.0),
}


def forget(cause: str) -> None:
    """Take a cause out of the estimator in this process; lost samples go with the dropouts."""
    if not cause:
        return
    known = Cause(cause)
    setattr(*WITHOUT[known])
    if known is Cause.DROPOUTS:
        for module in (back_emf, integrated_flux):
            module.find_jump = lambda *_: None  # type: ignore[assignment]


#: What a flux linkage follows over frequency (Hz, over 100 Hz).
TRENDS = {
    "no trend": lambda f: 0.0 * f,
    "f²": np.square,
    "f": np.positive,
    "√f": np.sqrt,
    "1/f": np.reciprocal,
}


SPEED_ROWS = {f"{count} speeds, {trend}": (count, trend) for count in (3, 6) for trend in TRENDS}


def speed_row(name: str, records: int, seed: int) -> Tally:
    """Return the tally of a trend over three speeds or six."""
    count, course_of = SPEED_ROWS[name]
    random = np.random.default_rng([seed, 100 * count + list(TRENDS).index(course_of)])
    tally = Tally()
    for _ in range(records):
        f = np.geomspace(30.0, 400.0, count)
        course = TRENDS[course_of](f / 100.0)
        u = large(random, 1e-5, 1e-3)
        size = large(random, 1e-4, 5e-2) * random.choice([-1, 1]) / max(float(np.ptp(course)), 1e-12)
        values = 1.0 + size * course + random.normal(0.0, u, count)
        over = over_speeds(f, values, np.full(count, u))
        low, high = coverage_interval(over.value, over.uncertainty, over.degrees_of_freedom)
        tally.count(over.misfit, 1.0, (low, over.value, high))
    return tally


def counted(name: str, given: argparse.Namespace) -> Tally:
    """Return a row's tally, as a worker does it."""
    return (
        speed_row(name, given.records, given.seed)
        if name in SPEED_ROWS
        else row(name, given.records, given.gain_limit, given.seed)
    )


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--records", type=int, default=1000)
    parser.add_argument("--gain-limit", type=float, default=0.01)
    parser.add_argument("--only", default="", help="rows whose name holds this")
    parser.add_argument("--seed", type=int, default=1)
    parser.add_argument(
        "--without", default="", choices=["", *WITHOUT], help="a cause that the estimator does not know"
    )
    parser.add_argument("--workers", type=int, default=1)
    given = parser.parse_args()
    print("| record | held, % | beyond 3 U | withheld, % | reported, % | U, % | causes reported |")
    print("| --- | --- | --- | --- | --- | --- | --- |")
    names = [name for name in (*ROWS, *SPEED_ROWS) if given.only in name]
    with ProcessPoolExecutor(given.workers, initializer=forget, initargs=(given.without,)) as pool:
        made = {name: pool.submit(counted, name, given) for name in names}
        for name, promise in made.items():
            tally = promise.result()
            causes = ", ".join(f"{cause} {count}" for cause, count in tally.causes.items())
            print(f"| {name} | {tally.line()} | {causes} |", flush=True)


if __name__ == "__main__":
    main()
