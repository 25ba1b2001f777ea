"""JSON: every parameter in SI units with its uncertainty, and how the parameters correlate."""

import json
import math
from typing import Any

from procedures.core.result import Parameter
from reports.exports.quantities import correlation
from reports.exports.target import Sheet, Target


def write(sheet: Sheet) -> str:
    """Return one JSON object."""
    subject = sheet.subject
    plate = subject.datasheet
    made = {
        "format": "motorbench parameters",
        "version": 1,
        "motor": {"name": subject.motor, "serial_number": subject.serial_number},
        "run": subject.run,
        "measured_on": subject.measured_on,
        "software": f"motorbench {subject.software}",
        "convention": "SI units; peak; resistance and inductance per phase of the Y-equivalent, at 25 °C where they depend on it",
        "parameters": {name: _entry(parameter) for name, parameter in subject.parameters.items()},
        "withheld": {name: why[0].as_dict() for name, why in subject.withheld.items()},
        "correlations": _correlations(sheet),
        "data_sheet": {
            "rated_current": plate.rated_current,
            "maximum_current": plate.maximum_current,
            "rated_speed_rpm": plate.rated_speed_rpm,
            "maximum_speed_rpm": plate.maximum_speed_rpm,
        },
        "warnings": [notice.as_dict() for notice in subject.warnings],
    }
    text = json.dumps(made, ensure_ascii=False, allow_nan=False, indent=2) + "\n"
    return text.encode("utf-8", "backslashreplace").decode("utf-8")


def _entry(parameter: Parameter) -> dict[str, Any]:
    low, high = parameter.coverage_interval
    return {
        "value": _finite(parameter.value),
        "unit": parameter.unit,
        "standard_uncertainty": _finite(parameter.standard_uncertainty),
        "coverage_interval": [_finite(low), _finite(high)],
        "degrees_of_freedom": _finite(parameter.degrees_of_freedom),
        "convention": parameter.convention,
        "winding": parameter.winding,
        "procedure": parameter.procedure,
        "section": parameter.section,
        "estimator": parameter.estimator,
        "source": parameter.source,
    }


def _correlations(sheet: Sheet) -> dict[str, dict[str, float]]:
    parameters = sheet.subject.parameters
    names = list(parameters)
    result: dict[str, dict[str, float]] = {}
    for position, first in enumerate(names):
        for second in names[position + 1 :]:
            coefficient = correlation(parameters[first], parameters[second])
            if coefficient:
                result.setdefault(first, {})[second] = coefficient
    return result


def _finite(value: float) -> float | None:
    return value if math.isfinite(value) else None


TARGET = Target("json", "JSON", ".json", (), write)
