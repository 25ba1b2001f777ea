"""Coast-down captures: friction against inertia, or both with a torque (§3.5)."""

from collections.abc import Sequence
from pathlib import Path
from typing import Any

import numpy as np

from bench.analysis.outcome import Outcome, estimated, paths_of, pick
from bench.captures import Capture, CaptureError, Channel, read_capture
from procedures.estimation.inertia import Ramp, fit_coast_down, fit_ramps

_SPEED_WORDS = ("speed", "rpm", "omega", "ω")


def analyze_coast_down(
    file: str | Path | Sequence[str | Path],
    *,
    inertia: float | None = None,
    inertia_uncertainty: float = 0.0,
    torque: float | None = None,
    speed: str | None = None,
    speed_in_rpm: bool = False,
) -> dict[str, Any]:
    """Return friction over inertia from a coast-down's time and speed; with more to go on, inertia and friction.

    With `inertia` (kg·m²) the frictions follow. With several files, or a torque column (N·m), all ramps are fitted together:
    a file without a torque column is a coast-down, unless it comes first and `torque` (N·m) is given for it. `speed` names the
    column; a speed without unit is rad/s unless `speed_in_rpm`. Raises CaptureError naming file and line.
    """
    captures = [read_capture(path) for path in paths_of(file)]
    if not captures:
        raise CaptureError("capture", "no file given")
    outcome = Outcome("inertia", "3.5", captures[0])
    ramps: list[Ramp] = []
    for k, capture in enumerate(captures):
        channel = _speed(outcome, capture, speed, speed_in_rpm)
        shaft = [c for c in capture.channels if c.unit == "N·m" or "torque" in c.name.lower()]
        driven: float | np.ndarray[Any, np.dtype[np.float64]] = 0.0
        if shaft:
            driven = shaft[0].values
        elif torque is not None and k == 0 and len(captures) > 1:
            driven = torque
        ramps.append(Ramp(capture.times(), channel.values, driven, channel.resolution))
    parts = [part for ramp in ramps for part in _split(ramp)]
    if len(parts) > 1 or any(np.any(ramp.torque) for ramp in parts):
        fit = estimated(captures[0], lambda: fit_ramps(parts))
        outcome.assume(
            "torque of a record without a torque column is 0", "torque is that on the shaft, positive where it drives"
        )
        outcome.fitted("inertia", fit, "kg·m²")
        outcome.fitted("coulomb_friction", fit, "N·m")
        outcome.fitted("viscous_friction", fit, "N·m·s/rad")
        outcome.warn(
            "inertia and friction are those of everything that turned: subtract those of dynamometer and coupling", "E6"
        )
        outcome.detail(ramps=len(parts), residual_rms=fit.residual_rms)
        return outcome.as_dict()
    only = parts[0]
    coast = estimated(
        captures[0], lambda: fit_coast_down(only.time, only.speed, speed_resolution=only.speed_resolution)
    )
    outcome.assume("no torque on the shaft but its own friction")
    outcome.fitted("coulomb_deceleration", coast, "rad/s²")
    outcome.fitted("viscous_rate", coast, "1/s")
    outcome.detail(initial_speed=coast.value("initial_speed"), residual_rms=coast.residual_rms)
    if inertia is None:
        outcome.warn(
            "a coast-down alone gives friction ÷ inertia only; give the inertia, or a driven ramp with its torque"
        )
    elif inertia <= 0 or not np.isfinite(inertia):
        raise CaptureError("inertia", f"{inertia:g} kg·m² is not above zero")
    else:
        outcome.assume(f"inertia {inertia:g} kg·m² with a standard uncertainty of {inertia_uncertainty:g} kg·m²")
        relative = inertia_uncertainty / inertia
        for name, source, unit in (
            ("coulomb_friction", "coulomb_deceleration", "N·m"),
            ("viscous_friction", "viscous_rate", "N·m·s/rad"),
        ):
            value = inertia * coast.value(source)
            uncertainty = float(np.hypot(inertia * coast.uncertainty(source), value * relative))
            outcome.parameter(name, value, uncertainty, unit, coast.degrees_of_freedom)
    return outcome.as_dict()


def _speed(outcome: Outcome, capture: Capture, wanted: str | None, in_rpm: bool) -> Channel:
    only = [c for c in capture.channels if c.unit != "N·m" and "torque" not in c.name.lower()]
    if wanted is None and len(only) == 1:
        wanted = only[0].name
    channel = pick(capture, wanted, ("rad/s",), "speed", _SPEED_WORDS)
    if channel.unit == "rad/s":
        return channel
    if in_rpm or "rpm" in channel.name.lower():
        outcome.assume(f"speed '{channel.name}' taken to be in rpm")
        factor = np.pi / 30
        return Channel(channel.name, "rad/s", channel.values * factor, channel.resolution * factor)
    outcome.assume(f"speed '{channel.name}' taken to be in rad/s")
    return channel


def _split(ramp: Ramp) -> list[Ramp]:
    """Part a record with a torque column where the drive lets go: before it a driven ramp, after it a coast-down."""
    torque = np.asarray(ramp.torque, dtype=np.float64)
    if torque.ndim == 0:
        return [ramp]
    level = float(np.median(np.abs(torque[np.abs(torque) > 0.5 * np.max(np.abs(torque))]))) if np.any(torque) else 0.0
    driving = np.abs(torque) > 0.5 * level
    last = np.flatnonzero(driving)
    if level == 0 or not last.size or last[-1] >= torque.size - 8 or last[-1] < 8:
        return [ramp]
    # The samples around the change belong to neither.
    end, begin = int(last[-1]), int(last[-1]) + 2
    rest = torque[begin:]
    quiet = float(np.mean(np.abs(rest))) < 0.1 * level
    parts = [(slice(0, end), torque[:end]), (slice(begin, None), np.zeros(rest.size) if quiet else rest)]
    return [Ramp(ramp.time[s], ramp.speed[s], t, ramp.speed_resolution) for s, t in parts]
