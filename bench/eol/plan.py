"""A plan: what is measured of every motor of a type, within which limits, and what follows a failure."""

import hashlib
import math
import os
import re
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

from bench.eol.limits import GuardBand, ParameterLimits
from bench.eol.plan_file import (
    BrakeSection,
    Figure,
    GoldenTestSection,
    KeepWaveforms,
    LimitSection,
    OnFailure,
    PlanFile,
    RetestSection,
    SpreadSection,
)
from bench.eol.serial_number import is_written
from bench.files.toml_file import read, validate
from bench.i18n.errors import FileError, InputError
from bench.operators.typed import typed_number
from bench.plugins.catalogues import Catalogues
from bench.plugins.files import PluginsSection, catalogues_of
from drivers.interfaces.text import Text, text, text_of
from procedures.core.parameter_definition import Bounds, ParameterDefinition
from procedures.core.parameters import PARAMETERS
from procedures.known_parameters import Procedures, known_parameters


@dataclass(frozen=True)
class PlannedCheck:
    """One procedure of a plan: its settings, of every how many-th motor, and what follows a failure."""

    name: str
    settings: Mapping[str, Any]
    every: int
    on_failure: OnFailure
    retries: int
    after: tuple[str, ...] = ()


@dataclass(frozen=True)
class Plan:
    """A plan that was read; `limits` by parameter, resolved where they do not need the type's values."""

    source: str
    content: str
    sha256: str
    name: str
    motor: str
    serial_pattern: str
    guard: GuardBand
    minimum_ratio: float
    order: str
    checks: tuple[PlannedCheck, ...]
    relative: Mapping[str, float]
    absolute: Mapping[str, ParameterLimits]
    keep_waveforms: KeepWaveforms = "all"
    spread: SpreadSection = field(default_factory=SpreadSection)
    plugins: PluginsSection = field(default_factory=PluginsSection)
    brakes: BrakeSection = field(default_factory=BrakeSection)
    again: RetestSection = field(default_factory=RetestSection)
    golden_test: GoldenTestSection = field(default_factory=GoldenTestSection)

    def catalogues(self, base: Catalogues | None = None) -> Catalogues:
        """Return what can be had with the plan's plug-ins, and with `base`, else with what is installed."""
        return catalogues_of(self.plugins, self.source, base)

    @property
    def limited(self) -> frozenset[str]:
        """The parameters with limits."""
        return frozenset(self.absolute) | frozenset(self.relative)

    def limits(self, expected: Mapping[str, float]) -> dict[str, ParameterLimits]:
        """Return all limits, per cent taken of the type's `expected` values. Raises InputError where one is missing."""
        limits = dict(self.absolute)
        for parameter, percent in self.relative.items():
            if parameter not in expected:
                raise FileError(
                    text(
                        "{source}: limit on {parameter}: the type has no value for it; "
                        "add expected.{parameter} to the motor file {motor}, or give low and high",
                        source=self.source,
                        parameter=parameter,
                        motor=self.motor,
                    )
                )
            limits[parameter] = _about(expected[parameter], percent)
        return limits

    def check_serial(self, serial: str) -> None:
        """Refuse a serial number (InputError) that does not match the plan's pattern or cannot be printed."""
        if not is_written(serial):
            raise InputError(text("serial number {serial!r}: allowed are up to 64 printable characters", serial=serial))
        if re.fullmatch(self.serial_pattern, serial) is None:
            raise InputError(
                text(
                    "serial number {serial!r} does not match the plan's pattern {serial_pattern}",
                    serial=serial,
                    serial_pattern=self.serial_pattern,
                )
            )


def load_plan(path: Path, base: Catalogues | None = None) -> Plan:
    """Read a plan; `base` is what can be had besides its own plug-ins, usually what is installed.

    Raises InputError naming file, key and what is allowed.
    """
    content, data = read(path, text("plan"), text("motorbench eol plan writes one from a measured motor"))
    file = validate(PlanFile, data, str(path))
    procedures = catalogues_of(file.plugins, str(path), base).procedures
    for check in file.procedure:
        if check.name not in procedures:
            raise FileError(
                text(
                    "{path}: procedure {name!r}: {hint}",
                    path=path,
                    name=check.name,
                    hint=procedures.why_not(check.name),
                )
            )
    plan = file.plan
    units = _Units(str(path), procedures, [check.name for check in file.procedure])
    absolute = {limit.parameter: units.limits(limit) for limit in file.limit if limit.percent is None}
    golden = {
        limit.parameter: limit.percent for limit in file.limit if limit.percent is not None and limit.of == "golden"
    }
    absolute |= {
        parameter: _about(units.figure(parameter, f"golden.{parameter}", file.golden[parameter]), percent)
        for parameter, percent in golden.items()
    }
    beside = path.parent / plan.motor
    return Plan(
        source=str(path),
        content=content.decode("utf-8"),
        sha256=hashlib.sha256(content).hexdigest(),
        name=plan.name,
        motor=str(beside) if os.path.isfile(beside) else plan.motor,
        serial_pattern=plan.serial_pattern,
        guard=plan.guard,
        minimum_ratio=plan.minimum_ratio,
        order=plan.order,
        checks=tuple(
            PlannedCheck(
                p.name, p.settings, p.every, p.on_failure or plan.on_failure, p.retries or plan.retries, tuple(p.after)
            )
            for p in file.procedure
        ),
        relative={
            limit.parameter: limit.percent for limit in file.limit if limit.percent is not None and limit.of == "type"
        },
        absolute=absolute,
        keep_waveforms=plan.keep_waveforms,
        spread=file.virtual,
        plugins=file.plugins,
        brakes=file.brakes,
        again=file.again,
        golden_test=file.golden_test,
    )


class _Units:
    """Takes figures as a plan has them into their parameters' units; `source` is the plan's in errors, `names` its procedures'."""

    def __init__(self, source: str, procedures: Procedures, names: Sequence[str]) -> None:
        self._source = source
        self._procedures = procedures
        self._names = names

    def figure(self, parameter: str, key: str, given: Figure) -> float:
        """Return a figure in its parameter's unit. Raises InputError for a unit of something else, and where no motor could have it."""
        definition = self._definition(parameter)
        unit = definition.unit if definition else ""
        try:
            figure = typed_number(given, "" if unit == "1" else unit) if isinstance(given, str) else given
            if definition is not None:
                _check_bounds(figure, definition.bounds, key)
        except ValueError as fault:
            raise FileError(
                text(
                    "{source}: limit on {parameter}: {key}: {finding}",
                    source=self._source,
                    parameter=parameter,
                    key=key,
                    finding=text_of(fault),
                )
            ) from None

        return figure

    def _definition(self, parameter: str) -> ParameterDefinition | None:
        # Only a procedure's own parameter needs the procedures, whose import takes long.
        if parameter not in PARAMETERS:
            own = known_parameters({name: self._procedures[name] for name in self._names})
            # That nobody gives a parameter is told with the procedures that would.
            return own.get(parameter)
        return PARAMETERS[parameter]

    def limits(self, limit: LimitSection) -> ParameterLimits:
        """Return absolute limits. Raises InputError where they are reversed."""
        low, high = (
            open_side if given is None else self.figure(limit.parameter, key, given)
            for key, given, open_side in (("low", limit.low, -math.inf), ("high", limit.high, math.inf))
        )
        if low > high:
            raise FileError(
                text(
                    "{source}: limit on {parameter}: low = {low} is above high = {high}",
                    source=self._source,
                    parameter=limit.parameter,
                    low=_typed(limit.low),
                    high=_typed(limit.high),
                )
            )
        return ParameterLimits(low, high)


def _check_bounds(figure: float, bounds: Bounds, key: str) -> None:
    """Raise ValueError for a limit that no figure of its parameter can be near, as below zero for a resistance."""
    high = math.inf if bounds.high is None else bounds.high
    nothing_left = bounds.open and key == "high" and figure == bounds.low
    if bounds.low <= figure <= high and not nothing_left:
        return
    within = text("above {low:g}") if bounds.open else text("at least {low:g}")
    if math.isfinite(high):
        within = text("above {low:g} and at most {high:g}") if bounds.open else text("{low:g} to {high:g}")
    raise ValueError(
        text(
            "{figure:g} is not possible; figures of this parameter are {within}. Leave out a side that has no limit",
            figure=figure,
            within=Text(within.template, {"low": bounds.low, "high": high}),
        )
    )


def _typed(given: Figure | None) -> str:
    return given if isinstance(given, str) else f"{given:g}"


def plan_schema() -> dict[str, Any]:
    """Return the plan file's JSON schema, for editors."""
    return PlanFile.model_json_schema()


def _about(reference: float, percent: float) -> ParameterLimits:
    spread = abs(reference) * percent / 100.0
    return ParameterLimits(reference - spread, reference + spread)
