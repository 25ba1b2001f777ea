"""A motor whose figures are known, as a run would hand it to the exporters."""

import math
from collections.abc import Callable
from typing import Any

import pytest

from drivers.interfaces import Accuracy
from procedures.core.budget import Uncertainties
from procedures.core.result import Parameter
from reports.exports.subject import Datasheet, Subject

UNITS = {
    "pole_pairs": "1",
    "stator_resistance": "Ω",
    "d_axis_inductance": "H",
    "q_axis_inductance": "H",
    "flux_linkage": "V·s/rad",
    "inertia": "kg·m²",
    "coulomb_friction": "N·m",
    "viscous_friction": "N·m·s/rad",
}
#: The virtual LG-400W.
TRUTH = {
    "pole_pairs": 4.0,
    "stator_resistance": 0.016,
    "d_axis_inductance": 73e-6,
    "q_axis_inductance": 76.5e-6,
    "flux_linkage": 8.5e-3,
    "inertia": 6e-5,
    "coulomb_friction": 0.02,
    "viscous_friction": 2e-5,
}


def parameters(values: dict[str, float], relative: float = 0.01, gain: float = 0.0) -> dict[str, Parameter]:
    """Each with its own relative uncertainty, and a gain error that the inductances have in common."""
    unc = Uncertainties()
    made = {}
    for name, value in values.items():
        own = 0.0 if name == "pole_pairs" else relative * value
        quantity = unc.statistical(f"repeats of {name}", value, own)
        if name.endswith("inductance") and gain:
            quantity = unc.instrument("LCR meter", quantity, Accuracy(gain=gain))
        made[name] = unc.parameter(
            name, UNITS[name], quantity, procedure="p", section="3", estimator="e", convention="c"
        )
    return made


@pytest.fixture
def make_subject() -> Callable[..., Subject]:
    def make(values: dict[str, float] | None = None, **changes: Any) -> Subject:
        relative, gain = changes.pop("relative", 0.01), changes.pop("gain", 0.0)
        given = {
            "motor": "LG-400W",
            "serial_number": "0042",
            "run": "20261121T000000Z-lg-400w",
            "measured_on": "2026-11-21",
            "software": "0.1.0",
            "parameters": parameters(TRUTH if values is None else values, relative, gain),
            "datasheet": Datasheet(29.0, 80.0, 3000.0, 4000.0),
            "given_by": {"flux_linkage": ("back-emf-constant",)},
        }
        return Subject(**{**given, **changes})

    return make


@pytest.fixture
def replaced() -> Callable[..., dict[str, Parameter]]:
    """The motor's parameters with one of them made anew."""
    from dataclasses import replace

    def make(name: str, **changes: Any) -> dict[str, Parameter]:
        found = parameters(TRUTH)
        found[name] = replace(found[name], **changes)
        return found

    return make


def close(a: float, b: float) -> bool:
    return math.isclose(a, b, rel_tol=2e-8)
