"""Step-response captures: loop resistance and inductance (§3.3.1)."""

from collections.abc import Mapping
from pathlib import Path
from typing import Any, Literal

from bench.analysis.outcome import Outcome, estimated, named, paths_of, pick
from bench.captures import CaptureError, read_captures
from procedures.estimation.connections import Connection, ReadingConnection, phase_factor
from procedures.estimation.fit import EstimationError
from procedures.estimation.step_response import fit_step_response, time_constant_63

_READINGS = {
    "line": ReadingConnection.LINE_TO_LINE,
    "series-parallel": ReadingConnection.SERIES_PARALLEL,
    "phase": ReadingConnection.PHASE_TO_STAR,
}


def analyze_step_response(
    file: str | Path | list[str | Path],
    *,
    connection: Connection = "wye",
    reading: ReadingConnection | str = ReadingConnection.SERIES_PARALLEL,
    axis: Literal["d", "q"] | None = None,
    voltage: str | None = None,
    current: str | None = None,
    scale: Mapping[str, float] | None = None,
) -> dict[str, Any]:
    """Return resistance and inductance of a recorded step: of the loop as it was, and of one leg of the equivalent wye.

    `reading` is how the step was applied ("line", "series-parallel", "phase"); `axis` where the rotor was locked, if known;
    `voltage`, `current` name the channels where their units do not tell; `scale` multiplies channels, by name. Raises
    CaptureError naming file and line.
    """
    if isinstance(reading, str):
        if reading not in _READINGS:
            raise CaptureError("reading", f"'{reading}' is not known; it is one of {', '.join(_READINGS)}")
        reading = _READINGS[reading]
    try:
        factor = phase_factor(connection, reading)
    except EstimationError as error:
        raise CaptureError("connection", str(error)) from error
    capture = read_captures(paths_of(file)).evenly_sampled().scaled(named(scale))
    if voltage is None and current is None and [c.unit for c in capture.channels] == ["", ""]:
        first, second = capture.channels
        voltage, current = first.name, second.name
    v = pick(capture, voltage, ("V",), "voltage", ("volt", "u"))
    i = pick(capture, current, ("A",), "current", ("curr", "i"))
    time = capture.times()
    fit = estimated(
        capture,
        lambda: fit_step_response(
            time, v.values, i.values, voltage_resolution=v.resolution, current_resolution=i.resolution
        ),
    )
    outcome = Outcome("dq_inductance_time_constant", "3.3.1", capture)
    outcome.assume(
        f"voltage is '{v.name}' in V, current is '{i.name}' in A",
        f"winding in {connection}, step applied {reading.value}: leg of the equivalent wye = {factor.y_equivalent:.4g} × loop",
        "circuit at rest at the start of the record, rotor locked",
    )
    outcome.fitted("loop_resistance", fit, "Ω", "resistance")
    outcome.fitted("loop_inductance", fit, "H", "inductance")
    name = f"{axis}_axis_inductance" if axis else "inductance"
    winding = factor.winding * fit.value("inductance")
    outcome.fitted(name, fit, "H", "inductance", factor.y_equivalent, winding=winding, convention="y_equivalent")
    if axis is None:
        outcome.assume("rotor position not given: the inductance is Ld, Lq or between, as the rotor stood")
    outcome.warn(
        "the resistance is the whole loop's, leads and contacts included, as far as the voltage probe sees it; it is not "
        "reported as the stator resistance",
        "E10",
    )
    tau = fit.value("inductance") / fit.value("resistance")
    outcome.detail(
        time_constant=tau,
        correlation_resistance_inductance=fit.correlation("resistance", "inductance"),
        current_offset=fit.value("offset"),
        voltage_offset=fit.value("voltage_offset") if "voltage_offset" in fit.names else None,
        residual_rms=fit.residual_rms,
        winding_inductance=winding,
        note_time_constant_63=estimated(capture, lambda: time_constant_63(time, i.values)),
    )
    return outcome.as_dict()
