"""What an analysis tells, in the shape of `--json`."""

import math
from collections.abc import Callable, Iterable, Mapping
from pathlib import Path
from typing import Any, TypeVar

from bench.captures import Capture, CaptureError, Channel
from procedures.estimation.fit import EstimationError, Fit, coverage_interval

_Result = TypeVar("_Result")
TYPE_A_ONLY = "uncertainties are statistical (Type A): gain and offset of scope, probes and sensors are not in the file and not included"


class Outcome:
    """Collects parameters, assumptions, warnings and details of one analysis."""

    def __init__(self, procedure: str, section: str, capture: Capture) -> None:
        self._procedure = procedure
        self._section = section
        self._parameters: dict[str, dict[str, Any]] = {}
        self._assumptions = [*capture.assumptions, TYPE_A_ONLY]
        self._warnings: list[dict[str, str]] = []
        self._details: dict[str, Any] = {"source": capture.source, "format": capture.description}

    def parameter(self, name: str, value: float, uncertainty: float, unit: str, freedom: float, **more: Any) -> None:
        """Add a parameter with its standard uncertainty and degrees of freedom; 95 % coverage by Student's t."""
        low, high = coverage_interval(value, uncertainty, freedom)
        self._parameters[name] = {
            "value": float(value),
            "unit": unit,
            "standard_uncertainty": float(uncertainty),
            "coverage_interval": [low, high],
            "degrees_of_freedom": float(freedom) if math.isfinite(freedom) else None,
            "procedure": self._procedure,
            "section": self._section,
            **more,
        }

    def fitted(self, name: str, fit: Fit, unit: str, source: str = "", factor: float = 1.0, **more: Any) -> None:
        """Add a parameter of a fit (named `source` there), multiplied by a factor."""
        source = source or name
        uncertainty = abs(factor) * fit.uncertainty(source)
        self.parameter(name, factor * fit.value(source), uncertainty, unit, fit.degrees_of_freedom, **more)

    def assume(self, *sentences: str) -> None:
        """Say what the file left open and the analysis took for granted."""
        self._assumptions += [sentence for sentence in sentences if sentence not in self._assumptions]

    def warn(self, text: str, erratum: str = "") -> None:
        """Add a warning, with the erratum's id where one applies."""
        self._warnings.append({"id": erratum, "text": text})

    def detail(self, **details: Any) -> None:
        """Add details by name."""
        self._details.update(details)

    def as_dict(self) -> dict[str, Any]:
        """Return the whole as `--json` prints it."""
        return {
            "parameters": self._parameters,
            "assumptions": self._assumptions,
            "warnings": self._warnings,
            "details": self._details,
        }


def estimated(capture: Capture, estimate: Callable[[], _Result]) -> _Result:
    """Return the estimate; what prevents it is told with the file's name. Raises CaptureError."""
    try:
        return estimate()
    except EstimationError as error:
        raise CaptureError(capture.source, str(error)) from error


def pick(capture: Capture, wanted: str | None, units: Iterable[str], what: str, words: Iterable[str] = ()) -> Channel:
    """Return the channel of a given name, or the only one with one of these units, or named by one of these words.

    Raises CaptureError where none or several qualify.
    """
    if wanted is not None:
        return capture.channel(wanted)
    lowered = tuple(words)
    fits = [c for c in capture.channels if c.unit in units] or [
        c for c in capture.channels if any(word in c.name.lower() for word in lowered)
    ]
    if len(fits) != 1:
        there = ", ".join(f"{c.name}{f' ({c.unit})' if c.unit else ''}" for c in capture.channels)
        found = "none" if not fits else "several"
        raise CaptureError(
            capture.source,
            f"{found} of the columns can be the {what}: {there}; name it, or give it the unit {next(iter(units))}",
        )
    return fits[0]


def named(factors: Mapping[str, float] | None) -> Mapping[str, float]:
    """Return the factors, none where not given."""
    return factors or {}


def paths_of(files: Any) -> list[Path | str]:
    """Return one path or several as a list."""
    return [files] if isinstance(files, str | Path) else list(files)
