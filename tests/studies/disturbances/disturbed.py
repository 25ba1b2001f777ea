"""Benches that something disturbs: does what is said of a figure still hold it, or is it sure and wrong?"""

import math
import re
from collections import Counter
from collections.abc import Iterable, Iterator, Mapping
from dataclasses import dataclass, field, replace
from statistics import median
from typing import Any

import numpy as np

from bench.virtual.true_values import MeasuredAt, true_values
from bench.virtual.virtual_station import dq_inverter_for
from procedures.core.parameters import PARAMETERS
from procedures.core.result import ProcedureResult
from sim_instruments.bench import BenchSetting, VirtualBench
from sim_instruments.catalogue import standard_units
from sim_instruments.instruments.errors import Errors
from sim_instruments.physics.motor.motor import VirtualMotor
from tests.studies.disturbances.causes import Cause, partners
from tests.studies.disturbances.dirt import Dirt
from tests.studies.disturbances.disturbed_maps import flux_at, map_truth, point_errors
from tests.studies.worlds.measured_motor import carry_out, figure, study_plan
from tests.studies.worlds.random_motors import draw_motor
from tests.studies.worlds.units_in_use import as_sold

#: Notices that say how a figure was found, and nothing against it.
_ORDINARY = re.compile(
    r"E\d+|raised-step|saliency|delta-from-outside|hidden-circuits|slow-circuits-unseen|current-not-checked"
)
#: A data sheet's flux linkage is off by up to this share.
_STATED = 0.05
#: A true value that is none.
_NIL = 1e-9
#: The figures that are one another times a number are one.
_ONCE = frozenset({"back_emf_constant_v_per_krpm", "back_emf_constant_v_per_rpm"})


@dataclass(frozen=True)
class Told:
    """One figure of a disturbed bench: its error in half-widths of its interval, whether something was said against it, and the
    half-width relative to the truth, as it is where that is 0.
    """

    name: str
    error: float
    warned: bool
    width: float = 0.0

    @property
    def held(self) -> bool:
        """Whether the interval holds the truth."""
        return self.error <= 1.0

    @property
    def sure_and_wrong(self) -> bool:
        """Whether it does not, and nothing was said."""
        return not self.held and not self.warned


@dataclass
class Row:
    """What became of the figures of one cause; `said` are the identifiers of notices and causes, `reasons` why procedures gave nothing."""

    motors: int = 0
    told: list[tuple[int, Told]] = field(default_factory=list)
    withheld: int = 0
    refused: int = 0
    failed: Counter[str] = field(default_factory=Counter)
    said: Counter[str] = field(default_factory=Counter)
    reasons: Counter[str] = field(default_factory=Counter)

    def share(self, of: str) -> float:
        """Return the share of the given figures that are `held`, `warned` or `sure_and_wrong`."""
        return sum(getattr(one, of) for _, one in self.told) / len(self.told) if self.told else math.nan

    @property
    def width(self) -> float:
        """The median of the half-widths, relative to the truth."""
        return median(one.width for _, one in self.told) if self.told else math.nan

    @property
    def beyond(self) -> int:
        """How many figures are off by more than three half-widths."""
        return sum(one.error > 3.0 for _, one in self.told)

    @property
    def worst(self) -> str:
        """The motor whose sure and wrong figure is furthest off, and by how many half-widths."""
        wrong = [(one.error, index, one.name) for index, one in self.told if one.sure_and_wrong]
        return "–" if not wrong else "{:.3g} U (motor {}, {})".format(*max(wrong))


def measure_disturbed(seed: int, index: int, cause: Cause, two: bool = False) -> Row:
    """Draw motor `index`, make its bench dirty with a cause, or with `two`, and return what its figures say.

    Depends on nothing else. The instruments' own errors are drawn as a user of their data sheets meets them.
    """
    random = np.random.default_rng([seed, index])
    motor, plate = draw_motor(random)
    ambient = float(random.uniform(18.0, 28.0))
    errors, start = Errors.drawn(random, as_sold), float(random.uniform(0.0, 2.0 * math.pi))
    dirt = Dirt(np.random.default_rng([seed, index, *cause.drawn_by.encode()]), motor, plate)
    cause.soil(dirt)
    procedures: Iterable[str] = cause.procedures
    drive = None
    if cause.drive:
        # Off as it may be by the data sheet.
        stated = motor.flux_linkage_y * float(dirt.random.uniform(-_STATED, _STATED) + 1.0)
        plate = replace(plate, pole_pairs=motor.pole_pairs, expected={"flux_linkage": stated})
        drive = dq_inverter_for(plate)
    if two and (others := partners(cause)):
        other: Cause = dirt.either(*others)
        other.soil(dirt)
        procedures = [name for name in cause.procedures if name in other.procedures]
    setting = BenchSetting(ambient_temperature=ambient, initial_angle=start, disturbances=dirt.disturbances())
    units = standard_units(dq_inverter=drive) if drive else None
    made = VirtualBench(
        dirt.motor, units, seed=int(random.integers(1 << 31)), errors=errors, setting=setting, sockets=False
    )
    # A free rotor that is light has no map at standstill.
    plan = study_plan((*cause.before, *procedures), {"lock": True, **cause.choices})
    with made as bench:
        if dirt.warmth:
            bench.world.set_winding_temperature(ambient + dirt.warmth)
        done = carry_out(bench, plate, int(random.integers(1 << 31)), plan, drive=drive)
    flux = flux_at(dirt.motor, ambient)
    row = Row(1, refused=len(done.refused), failed=Counter(dict(done.failed).values()))
    row.reasons += Counter(dict(done.refused).values())
    for result in done.results:
        if result.procedure in cause.before:
            continue
        at = MeasuredAt(inductance_frequency=float(result.findings.get("inductance_at", 0.0)))
        truth = true_values(PARAMETERS, dirt.motor, None, at)
        row.said += Counter(notice.identifier for notice in result.warnings)
        row.said += Counter(str(finding["cause"]) for finding in result.findings.get("misfit", []))
        row.told += [(index, one) for one in _told(result, {**truth, **map_truth(dirt.motor, result, flux)})]
        row.told += [(index, one) for one in _points(dirt.motor, result, flux)]
        row.withheld += sum(one.name in truth and one.name not in _ONCE for one in getattr(result, "withheld", ()))
    return row


def _points(motor: VirtualMotor, result: ProcedureResult, flux: float) -> Iterator[Told]:
    """Give a map's flux linkages; what is said of the map is said of them."""
    against = any(not _ORDINARY.fullmatch(notice.identifier) for notice in result.warnings)
    against = against or bool(result.findings.get("misfit"))
    for name, error, width in point_errors(motor, result, flux):
        yield Told(name, error, against, width)


def _told(result: ProcedureResult, truth: Mapping[str, float]) -> Iterator[Told]:
    against = any(not _ORDINARY.fullmatch(notice.identifier) for notice in result.warnings)
    misfit: list[dict[str, Any]] = result.findings.get("misfit", [])
    for parameter in result.parameters:
        if parameter.name not in truth or parameter.name in _ONCE:
            continue
        one = figure(parameter, truth)
        half = 0.5 * (one.high - one.low)
        off = abs(0.5 * (one.high + one.low) - one.truth)
        seen = any(not row["parameters"] or parameter.name in row["parameters"] for row in misfit)
        error = off / half if half else math.inf if off else 0.0
        yield Told(one.name, error, against or seen, half / (abs(one.truth) if abs(one.truth) > _NIL else 1.0))


def add(total: Row, one: Row) -> None:
    """Put a motor's row into its cause's."""
    total.motors += one.motors
    total.told += one.told
    total.withheld += one.withheld
    total.refused += one.refused
    total.failed += one.failed
    total.said += one.said
    total.reasons += one.reasons


def table(rows: Mapping[str, Row]) -> Iterator[str]:
    """Give the lines of the table, the row with the largest share of sure and wrong figures first."""
    columns = ("sure and wrong", "held", "beyond 3 U", "median U", "warned", "withheld", "refused", "worst unsaid")
    yield f"| cause · procedure | motors | figures | {' | '.join(columns)} |"
    yield "| --- | ---: | ---: | ---: | ---: | ---: | ---: | ---: | ---: | ---: | --- |"
    for name, row in sorted(rows.items(), key=lambda item: (-_number(item[1].share("sure_and_wrong")), item[0])):
        shares = " | ".join(
            (
                _percent(row.share("sure_and_wrong")),
                _percent(row.share("held")),
                str(row.beyond),
                _percent(row.width),
                _percent(row.share("warned")),
            )
        )
        yield f"| {name} | {row.motors} | {len(row.told)} | {shares} | {row.withheld} | {row.refused} | {row.worst} |"
    for name, row in rows.items():
        for reason, number in row.failed.items():
            yield f"- {number} × {name} failed: {reason}"


def _number(share: float) -> float:
    return 0.0 if math.isnan(share) else share


def _percent(share: float) -> str:
    return "–" if math.isnan(share) else f"{share:.1%}"
