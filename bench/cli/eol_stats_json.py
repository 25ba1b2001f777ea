"""What `motorbench eol stats --json` prints: numbers that are not defined are null."""

import math
from collections.abc import Mapping
from dataclasses import asdict
from typing import Any

from bench.eol.line_statistics import LineStatistics, ParameterStatistics
from bench.eol.statistics.gauge import GaugeStudy


def statistics_as_dict(found: LineStatistics) -> dict[str, Any]:
    """Return the statistics as one JSON object."""
    made: dict[str, Any] = _defined(
        {
            "model": found.selection.model,
            "batches": found.selection.batches,
            "golden": found.selection.golden,
            "motors": found.selection.count,
            "verdicts": {verdict.value: count for verdict, count in found.yields.verdicts.items()},
            "yield": {"first_pass": asdict(found.yields.first_pass), "final": asdict(found.yields.final)},
            "failures": {
                "by_parameter": [asdict(each) for each in found.by_parameter],
                "by_procedure": [asdict(each) for each in found.by_procedure],
            },
            "parameters": {name: _parameter(each) for name, each in found.parameters.items()},
        }
    )
    return made


def gauge_as_dict(studies: Mapping[str, tuple[GaugeStudy, str]]) -> dict[str, Any]:
    """Return gauge studies by parameter as one JSON object."""
    made: dict[str, Any] = _defined(
        {"gauge": {name: {"unit": unit, **asdict(study)} for name, (study, unit) in studies.items()}}
    )
    return made


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
        "cp": {"value": each.within.cp, "interval": each.within.cp_interval},
        "cpk": {"value": each.within.cpk, "interval": each.within.cpk_interval},
        "pp": {"value": each.overall.cp, "interval": each.overall.cp_interval},
        "ppk": {"value": each.overall.cpk, "interval": each.overall.cpk_interval},
        "histogram": asdict(found.histogram),
        "chart": chart,
        "latest": [
            {"serial_number": serial, "value": value}
            for serial, value in zip(each.serial_numbers, each.values, strict=True)
        ],
        "golden": [
            {"serial_number": g.serial_number, "times": [at.isoformat() for at in g.times], "values": g.values}
            | {"drift": asdict(g.drift)}
            for g in each.golden
        ],
    }


def _defined(value: Any) -> Any:
    if isinstance(value, float):
        return value if math.isfinite(value) else None
    if isinstance(value, Mapping):
        return {key: _defined(item) for key, item in value.items()}
    if isinstance(value, list | tuple):
        return [_defined(item) for item in value]
    return value
