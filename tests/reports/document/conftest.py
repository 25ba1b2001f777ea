"""A small run as its keeper hands it over: two procedures, one of which failed."""

import math
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
import pytest
from numpy.typing import NDArray

from bench.i18n.language import translator
from drivers.interfaces import Accuracy
from drivers.interfaces.text import text
from procedures.core.budget import Uncertainties
from procedures.core.nameplate import Nameplate, WindingConnection
from procedures.core.parameter_set import merge
from procedures.core.result import Notice, Parameter, ProcedureResult
from reports.document.compose import compose
from reports.document.model import PlotFigure
from reports.document.record import (
    CalibrationRecord,
    InstrumentRecord,
    JournalEnd,
    ProcedureRecord,
    ProcedureStepRecord,
    ReadingsRecord,
    RunRecord,
)
from reports.document.render import render
from reports.document.speech import Speech
from reports.plots.draw import svg


@dataclass(frozen=True)
class Samples:
    time: NDArray[np.float64]
    values: NDArray[np.float64]
    unit: str
    channel: int = 1


def result() -> ProcedureResult:
    unc = Uncertainties()
    meter = Accuracy(gain=0.002, offset=1e-7, source="its data sheet")
    parameters: list[Parameter] = []
    for axis, value in (("d", 73e-6), ("q", 76.5e-6)):
        quantity = unc.instrument("LCR meter", unc.statistical(f"step fits of L_{axis}", value, 4e-8, 95.0), meter)
        parameters.append(
            unc.parameter(
                f"{axis}_axis_inductance",
                "H",
                quantity,
                procedure="dq-inductance-time-constant",
                section="3.3.1",
                estimator="output-error fit of R, L and offsets to recorded voltage and current",
                note_value=1.1 * value,
                convention="per phase of the Y-equivalent",
            )
        )
    time = np.linspace(0.0, 0.02, 50)
    fitted = 2.9 * (1.0 - np.exp(-time / 4e-3))
    fit = {"time": time.tolist(), "fitted": fitted.tolist(), "residual": (0.01 * np.sin(9e3 * time)).tolist()}
    notice = Notice(
        "E10",
        text(
            "L{axis} from the time constant with the bridge's resistance would be {difference:+.1%} off: the R of L = τ·R is "
            "the whole loop's, with leads, contacts and source",
            axis="d",
            difference=-0.125,
        ),
    )
    return ProcedureResult(
        "dq-inductance-time-constant", "3.3.1", tuple(parameters), (notice,), {"d": {"fit": fit}, "q": {"fit": fit}}
    )


def traces() -> Sequence[Samples]:
    time = np.linspace(-0.005, 0.02, 5000)
    return [Samples(time, np.where(time > 0.0, 0.08, 0.0), "V"), Samples(time, np.maximum(time, 0.0) * 100.0, "A", 4)]


def make_run(**changes: Any) -> RunRecord:
    found = result()
    steps = [
        ProcedureStepRecord(
            "3.3.1-d/1", text("Align the rotor to d: A to plus, B and C to minus"), True, "finished", 1.0, 50.0
        ),
        ProcedureStepRecord(
            "3.3.1-d/4",
            text("Switch on and record the current's step response"),
            False,
            "finished",
            50.0,
            66.5,
            readings=(
                ReadingsRecord("supply", text("voltage"), "V", (0.079,) * 5, was_set=True),
                ReadingsRecord("oscilloscope", text("current"), "A", tuple(float(k) for k in range(9))),
            ),
            traces=(traces,),
        ),
    ]
    failed = ProcedureRecord(
        "pole-pairs-static",
        text("Pole pairs by stable positions"),
        "3.1.2.1",
        {"turns": 1},
        [
            ProcedureStepRecord(
                "3.1.2.1/3",
                text("Mark every stable position over one full turn"),
                True,
                "failed",
                70.0,
                71.0,
                "no mark",
            )
        ],
        None,
        "no stable position was marked",
    )
    measured = ProcedureRecord(
        "dq-inductance-time-constant",
        text("dq inductance, time constant"),
        "3.3.1",
        {"repeats": 4, "curve_shares": [0.5, 1.0], "polarity": "against", "off": None},
        steps,
        found,
    )
    given: dict[str, Any] = {
        "name": "20261121T000000Z-lg-400w",
        "status": "failed",
        "cause": "pole-pairs-static: no stable position was marked",
        "started": "2026-11-21 00:00:00 UTC",
        "ended": "2026-11-21 00:02:00 UTC",
        "nameplate": Nameplate("LG-400W", WindingConnection.WYE, 29.0, 80.0, 3000.0, 24.0, serial_number="0042"),
        "motor_file": "lg-400w",
        "motor_sha256": "ab" * 32,
        "station": "bench 1",
        "station_file": "station.toml",
        "station_sha256": "cd" * 32,
        "operator": "A. Person",
        "performed_by": "terminal",
        "software": {"motorbench": "0.1.0"},
        "instruments": [
            InstrumentRecord(
                "supply",
                "keysight-e36300",
                "TCPIP0::x",
                "Keysight E36313A",
                CalibrationRecord("2025-01-01", "2026-01-01", "C-17", True),
                True,
            ),
            InstrumentRecord("lcr_meter", "manual", "", "", None, False),
        ],
        "parameters": merge([found]),
        "warnings": [
            ("", Notice("consistency-inductance", text("no parameter was measured"))),
            ("dq-inductance-time-constant", found.warnings[0]),
        ],
        "truth": {},
        "procedures": [measured, failed],
        "journal": JournalEnd(42, "ef" * 32, False),
        "bench_time": 71.0,
    }
    return RunRecord(**{**given, **changes})


def speech(*languages: str) -> Speech:
    return Speech([({"en": "en", "zh": "zh-Hans"}[code], translator(code)) for code in languages])


@pytest.fixture
def run() -> Callable[..., RunRecord]:
    return make_run


@pytest.fixture(scope="session")
def rendered() -> Callable[..., dict[str, Any]]:
    """Render a run, changed as named, in the languages given; a language's plots are drawn once."""
    drawn: dict[tuple[str, ...], dict[str, str]] = {}

    def make(*languages: str, **changes: Any) -> dict[str, Any]:
        spoken = languages or ("en",)
        document = compose(make_run(**changes))
        if spoken not in drawn:
            figures = [block.plot for s in document.sections for block in s.blocks if isinstance(block, PlotFigure)]
            drawn[spoken] = {plot.name: svg(plot, speech(*spoken).say) for plot in figures}
        return render(document, speech(*spoken), drawn[spoken])

    return make


def total(parameter: Parameter) -> float:
    return math.sqrt(sum(row.contribution**2 for row in parameter.budget))
