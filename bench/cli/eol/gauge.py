"""The studies of a gauge of `motorbench eol stats`."""

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Literal

from bench.cli.eol.gauge_output import print_gauge, print_linearity, print_range, print_type_one
from bench.cli.eol.narrowing_options import tell_joined
from bench.cli.eol.stats_json import studies_as_dict
from bench.cli.output import print_json
from bench.eol.gauge_studies import gauge_studies, linearity_studies, range_studies, type_one_studies
from bench.eol.line_statistics import StatisticsRequest, parameter_labels
from bench.eol.narrowing import records_of
from bench.eol.store.database import open_for_reading, using
from bench.i18n.errors import UsageError
from drivers.interfaces.text import Translate, text


@dataclass(frozen=True)
class GaugeRequest:
    """A gauge study's request: its appraisers, the motors of known value (by serial number, SI), and the level of pooling."""

    study: Literal["crossed", "range", "type-1", "linearity"]
    appraiser: Literal["person", "socket"]
    references: Mapping[str, float]
    alpha: float


def references(typed: Sequence[str]) -> dict[str, float]:
    """Return motors of known value as they were typed, SERIAL=VALUE. Raises UsageError."""
    known = {}
    for each in typed:
        serial, _, value = each.rpartition("=")
        try:
            known[serial] = float(value)
        except ValueError:
            known[serial] = math.nan
        if not serial or not math.isfinite(known[serial]):
            raise UsageError(text("--reference {typed}: give SERIAL=VALUE, the value in its SI unit", typed=each))
    return known


def show_study(
    records: str, wanted: StatisticsRequest, asked: GaugeRequest, translate: Translate, *, json: bool
) -> int:
    """Print a study of the gauge. Raises UsageError for what it lacks, InputError where the records are none of it."""
    known = len(asked.references)
    if asked.study in ("type-1", "linearity"):
        wanted_here = known == 1 if asked.study == "type-1" else known >= 2
        if len(wanted.parameters) != 1 or not wanted_here:
            raise UsageError(
                text(
                    "--study {study} needs one --parameter, and --reference SERIAL=VALUE {count}",
                    study=asked.study,
                    count=text("once") if asked.study == "type-1" else text("twice at least"),
                )
            )
    elif known:
        raise UsageError(text("--reference goes with --study type-1 and --study linearity"))
    confidence = wanted.confidence
    with using(open_for_reading(records)) as engine:
        tell_joined(records_of(engine, wanted.batches, wanted.narrowing)[1], translate)
        labels = parameter_labels(engine)
        match asked.study:
            case "crossed":
                crossed = gauge_studies(engine, wanted, asked.appraiser, asked.alpha)
                if not json:
                    print_gauge(crossed, labels, confidence, translate)
                printed = studies_as_dict("gauge", crossed)
            case "range":
                ranges = range_studies(engine, wanted, asked.appraiser)
                if not json:
                    print_range(ranges, labels, confidence, translate)
                printed = studies_as_dict("range", ranges)
            case "type-1":
                ones = type_one_studies(engine, wanted, asked.references)
                if not json:
                    print_type_one(ones, labels, confidence, translate)
                printed = studies_as_dict("type_1", ones)
            case "linearity":
                lines = linearity_studies(engine, wanted, asked.references)
                if not json:
                    print_linearity(lines, labels, confidence, translate)
                printed = studies_as_dict("linearity", lines)
    if json:
        print_json(printed)
    return 0
