"""Output of `motorbench eol stats --json`: numbers that are not defined are null."""

import math
from collections.abc import Mapping
from dataclasses import asdict
from typing import Any

from bench.eol.line_statistics import LineStatistics, ParameterStatistics
from bench.eol.yields import MotorYields


def statistics_as_dict(found: LineStatistics) -> dict[str, Any]:
    """Return the statistics as one JSON object."""
    result: dict[str, Any] = _defined(
        {
            "model": found.selection.model,
            "batches": found.selection.batches,
            "golden": found.selection.golden,
            "tests": found.selection.count,
            "motors": found.selection.count,
            "verdicts": {verdict.value: count for verdict, count in found.yields.verdicts.items()},
            "yield": _yields(found.yields.motors),
            "failures": {
                "by_parameter": [asdict(each) for each in found.by_parameter],
                "by_procedure": [asdict(each) for each in found.by_procedure],
            },
            "associations": [asdict(each) for each in found.associations],
            "parameters": {name: _parameter(each) for name, each in found.parameters.items()},
        }
    )
    return result


def _yields(motors: MotorYields) -> dict[str, Any]:
    return {
        "motors": motors.final.count,
        "retested": motors.retested,
        "first_pass": asdict(motors.first_pass),
        "final": asdict(motors.final),
        "rolled": {
            "share": motors.rolled.share,
            "procedures": {name: asdict(each) for name, each in motors.rolled.procedures.items()},
        },
        "by": {grouping: [asdict(group) for group in groups] for grouping, groups in motors.groups.items()},
    }


def studies_as_dict(study: str, studies: Mapping[str, tuple[Any, str]]) -> dict[str, Any]:
    """Return studies of gauges by parameter as one JSON object, under the study's name."""
    result: dict[str, Any] = _defined(
        {study: {name: {"unit": unit, **asdict(found)} for name, (found, unit) in studies.items()}}
    )
    return result


def _parameter(each: ParameterStatistics) -> dict[str, Any]:
    found = each.distribution
    chart = None
    if each.chart is not None:
        signals = [{"serial_number": each.serial_numbers[s.index], **asdict(s)} for s in each.chart.signals]
        chart = {**asdict(each.chart), "signals": signals}
    return {
        "unit": found.unit,
        "limits": {"low": found.limits.low, "high": found.limits.high, "changed": found.changed},
        "count": found.count,
        "mean": found.mean,
        "standard_deviation": {"overall": found.standard_deviation, "within": each.within.standard_deviation},
        "least": found.least,
        "most": found.most,
        "outside": found.outside,
        "normality": {**asdict(each.normality), "rejected": each.percentiles is not None},
        "method": "normal" if each.percentiles is None else "percentiles",
        **_indices(each),
        "histogram": asdict(found.histogram),
        "chart": chart,
        "latest": [
            {"serial_number": serial, "value": value}
            for serial, value in zip(each.serial_numbers, each.values, strict=True)
        ],
        "golden": [
            {"serial_number": g.serial_number, "station": g.station, "socket": g.socket}
            | {"times": [at.isoformat() for at in g.times], "values": g.values}
            | {"drift": asdict(g.drift), "chart": None if g.chart is None else asdict(g.chart)}
            for g in each.golden
        ],
    }


def _indices(each: ParameterStatistics) -> dict[str, Any]:
    """Return Cp, Cpk, Pp, Ppk; the former are null where the figures are not normal, and the percentiles are there."""
    other = each.percentiles
    if other is None:
        within, overall = each.within, each.overall
        return {
            "cp": {"value": within.cp, "interval": within.cp_interval},
            "cpk": {"value": within.cpk, "interval": within.cpk_interval},
            "pp": {"value": overall.cp, "interval": overall.cp_interval},
            "ppk": {"value": overall.cpk, "interval": overall.cpk_interval},
        }
    nothing = {"value": None, "interval": None}
    return {
        "cp": nothing,
        "cpk": nothing,
        "pp": {"value": other.pp, "interval": other.pp_interval},
        "ppk": {"value": other.ppk, "interval": other.ppk_interval},
        "percentiles": other.percentiles,
    }


def _defined(value: Any) -> Any:
    if isinstance(value, float):
        return value if math.isfinite(value) else None
    if isinstance(value, Mapping):
        return {key: _defined(item) for key, item in value.items()}
    if isinstance(value, list | tuple):
        return [_defined(item) for item in value]
    return value
