"""The result of an analysis of a table, in the shape of `--json`."""

import math
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any

import numpy as np

from bench.analysis.outcome import beyond_words, unusual_words
from bench.captures.written_digits import FloatArray, last_digit
from drivers.interfaces.text import Text, Translate, text
from procedures.core.budget import Uncertainties
from procedures.core.misfit_text import misfit_row, sentence
from procedures.estimation.fitting.misfit import Misfit
from procedures.estimation.flux.flux_map import MapFigure
from procedures.plausibility.sizes import IMPLAUSIBLE, TOO_UNCERTAIN, UNUSUAL, size_beyond, size_unusual, too_uncertain


def told(path: Path, misfit: Misfit, translate: Translate) -> dict[str, Any]:
    """Return what is told of a table so far: what it shows beyond its model."""
    return {
        "parameters": {},
        "withheld": {},
        "misfit": [misfit_row(finding, translate) for finding in misfit.findings],
        "assumptions": [],
        "warnings": [{"id": f.cause.value, "text": sentence(f).render(translate)} for f in misfit.findings],
        "details": {"source": str(path)},
    }


def digits_of(columns: Mapping[str, FloatArray]) -> float:
    """Return the last digit of the coarsest column's numbers, share of its largest."""
    sizes = {name: float(np.max(np.abs(values), initial=0.0)) for name, values in columns.items()}
    return max((last_digit(columns[name]) / size for name, size in sizes.items() if size > 0.0), default=0.0)


def give(
    made: dict[str, Any],
    name: str,
    unit: str,
    figure: MapFigure,
    procedure: str,
    translate: Translate,
    digits: float = 0.0,
    shared: Mapping[str, Text] | None = None,
) -> None:
    """Add a parameter, or why it is not given: no motor has such a size, or the interval says nothing. `digits` is the last digit of the
    numbers that it comes from, share of the largest, whose error it has at least; `shared` names those of the figure's shared errors
    that are rows of the budget.
    """
    beyond = size_beyond(name, figure.value)
    if beyond is not None:
        made["withheld"] |= withheld_rows(
            (name,), IMPLAUSIBLE, beyond_words(name, figure.value, beyond).render(translate), procedure
        )
        return
    given = _parameter(name, unit, figure, procedure, digits, shared or {})
    low, high = given["coverage_interval"]
    vague = too_uncertain(name, figure.value, (low, high), unit)
    if vague is not None:
        made["withheld"] |= withheld_rows((name,), TOO_UNCERTAIN, vague.render(translate), procedure)
        return
    made["parameters"][name] = given
    unusual = size_unusual(name, figure.value)
    if unusual is not None:
        message = unusual_words(name, figure.value, unusual).render(translate)
        made["warnings"].append({"id": UNUSUAL, "text": message})


def _parameter(
    name: str, unit: str, figure: MapFigure, procedure: str, digits: float, shared: Mapping[str, Text]
) -> dict[str, Any]:
    uncertainties = Uncertainties()
    limits = [(said, abs(figure.shared[key])) for key, said in shared.items() if figure.shared.get(key)]
    left = figure.standard_uncertainty**2 - sum(limit**2 for _, limit in limits) / 3.0
    quantity = uncertainties.statistical(text("the fit"), figure.value, math.sqrt(max(left, 0.0)), math.inf)
    for said, limit in limits:
        quantity = quantity + uncertainties.limit(said, 0.0, limit)
    half = 0.5 * digits * abs(figure.value)
    coarse = figure.standard_uncertainty < half / math.sqrt(3.0)
    if coarse:
        quantity = quantity + uncertainties.limit(text("last digit of the table's numbers"), 0.0, half)
    made = uncertainties.parameter(name, unit, quantity, procedure=procedure, section="", estimator="")
    interval = made.coverage_interval if coarse else figure.coverage_interval
    return {**made.as_dict(), "coverage_interval": list(interval)}


def withheld_rows(names: Sequence[str], cause: str, message: str, procedure: str) -> dict[str, Any]:
    """Return the rows of parameters that are not given, and why."""
    return {name: {"cause": cause, "message": message, "procedure": procedure, "section": ""} for name in names}
