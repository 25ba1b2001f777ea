"""A plan: what is measured of every motor of a type, within which limits, and what follows a failure."""

import hashlib
import math
import os
import re
import warnings
from collections.abc import Mapping
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any, Literal

from pydantic import Field, field_validator, model_validator

from bench.eol.limits import GuardBand, ParameterLimits
from bench.files.toml_file import Section, read, validate
from bench.i18n.errors import InputError
from bench.plugins.catalogues import Catalogues
from bench.plugins.files import PluginsSection, catalogues_of
from drivers.interfaces.text import text

OnFailure = Literal["stop", "go_on", "retry"]
KeepWaveforms = Literal["all", "failed", "none"]
_MOST_RETRIES = 10


def _per_cent() -> Any:
    return Field(default=0.0, ge=0.0, le=20.0, strict=True, json_schema_extra={"unit": "%"})


class _Plan(Section):
    """`[plan]`: the plan itself."""

    name: str = Field(min_length=1, description="the plan's name")
    motor: str = Field(
        min_length=1, description="the type: a motor file beside the plan, or the name of a shipped motor"
    )
    serial_pattern: str = Field(
        default=r"\S{1,64}", description="regular expression that a whole serial number matches"
    )
    guard: GuardBand = Field(default=GuardBand.STRICT, description="strict, shared or lenient")
    minimum_ratio: float = Field(
        default=1.0, ge=0.0, le=1000.0, strict=True, description="least tolerance over the width of the 95 % interval"
    )
    on_failure: OnFailure = Field(default="stop", description="stop, go_on or retry")
    retries: int = Field(default=1, ge=1, le=_MOST_RETRIES, strict=True, description="how often, where retry is chosen")
    order: Literal["listed", "time over failure rate"] = "listed"
    keep_waveforms: KeepWaveforms = Field(default="all", description="of which motors: all, failed or none")

    @field_validator("serial_pattern")
    @classmethod
    def _compiles(cls, pattern: str) -> str:
        try:
            with warnings.catch_warnings():
                # One whose meaning is going to change is refused as well.
                warnings.simplefilter("error")
                re.compile(pattern)
        except (re.error, Warning, OverflowError, RecursionError) as error:
            raise ValueError(
                text(
                    "serial_pattern = {pattern!r} is no regular expression: {error}",
                    pattern=pattern,
                    error=error,
                )
            ) from None
        return pattern


class _Procedure(Section):
    """`[[procedure]]`: one measurement, with its settings."""

    name: str = Field(min_length=1, description="as motorbench procedures lists it")
    settings: dict[str, Any] = Field(default_factory=dict, description="EOL settings by name")
    every: int = Field(default=1, ge=1, le=1_000_000, strict=True, description="measured of every n-th motor")
    on_failure: OnFailure | None = Field(default=None, description="instead of the plan's")
    retries: int | None = Field(default=None, ge=1, le=_MOST_RETRIES, strict=True)
    after: list[str] = Field(default_factory=list, description="procedures that come before, whatever the order")


class _Limit(Section):
    """`[[limit]]`: bounds on one parameter, absolute or in per cent of its type value or of a golden motor's."""

    parameter: str = Field(min_length=1, description="a parameter's name, as results give it")
    low: float | None = Field(default=None, strict=True, allow_inf_nan=False, description="in the parameter's unit")
    high: float | None = Field(default=None, strict=True, allow_inf_nan=False, description="in the parameter's unit")
    percent: float | None = Field(
        default=None, gt=0.0, le=1000.0, strict=True, description="± per cent of the reference"
    )
    of: Literal["type", "golden"] = Field(default="type", description="what per cent are taken of")

    @model_validator(mode="after")
    def _one_way(self) -> "_Limit":
        absolute = self.low is not None or self.high is not None
        if absolute == (self.percent is not None):
            raise ValueError(
                text("limit on {parameter}: give low and high (or one of them), or percent", parameter=self.parameter)
            )
        if self.low is not None and self.high is not None and self.low > self.high:
            raise ValueError(
                text(
                    "limit on {parameter}: low = {low:g} is above high = {high:g}",
                    parameter=self.parameter,
                    low=self.low,
                    high=self.high,
                )
            )
        return self


class SpreadSection(Section):
    """`[virtual]`: how the virtual motors of a batch differ: standard deviations in per cent, and the share with a defect."""

    resistance: float = _per_cent()
    inductance: float = _per_cent()
    flux: float = _per_cent()
    inertia: float = _per_cent()
    friction: float = _per_cent()
    serial: str = Field(default="V{number:06d}", description="serial numbers of motors that are only counted")
    defects: float = Field(default=0.0, ge=0.0, le=1.0, strict=True, description="share of motors with a defect")

    @field_validator("serial")
    @classmethod
    def _numbered(cls, pattern: str) -> str:
        try:
            differs = pattern.format(number=1) != pattern.format(number=2)
        except (ValueError, LookupError, AttributeError):
            differs = False
        if not differs:
            raise ValueError(
                text('serial = {pattern!r}: put the number in by {{number}}, like "V{{number:06d}}"', pattern=pattern)
            )
        return pattern


class PlanFile(Section):
    """A plan's whole file."""

    plan: _Plan
    procedure: list[_Procedure] = Field(min_length=1, description="at least one")
    limit: list[_Limit] = Field(default_factory=list)
    golden: dict[str, float] = Field(default_factory=dict, description="figures of a golden motor by parameter")
    virtual: SpreadSection = Field(default_factory=SpreadSection)
    plugins: PluginsSection = Field(default_factory=PluginsSection)

    @model_validator(mode="after")
    def _consistent(self) -> "PlanFile":
        for what, names in (
            (text("procedure"), [procedure.name for procedure in self.procedure]),
            (text("limit"), [limit.parameter for limit in self.limit]),
        ):
            twice = sorted({name for name in names if names.count(name) > 1})
            if twice:
                raise ValueError(text("{what} {twice} stands twice", what=what, twice=twice[0]))
        names = [procedure.name for procedure in self.procedure]
        for place, procedure in enumerate(self.procedure):
            for before in procedure.after:
                if before not in names[:place]:
                    raise ValueError(
                        text(
                            "procedure {name}: after {before!r}: it is not listed before it",
                            name=procedure.name,
                            before=before,
                        )
                    )
        for limit in self.limit:
            if limit.of == "golden" and limit.percent is not None and limit.parameter not in self.golden:
                raise ValueError(text("limit on {parameter}: golden.{parameter} is missing", parameter=limit.parameter))
        return self


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
                raise InputError(
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
        if not serial.isprintable() or len(serial) > 64:
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
    content, data = read(path, text("plan"))
    file = validate(PlanFile, data, str(path))
    procedures = catalogues_of(file.plugins, str(path), base).procedures
    for check in file.procedure:
        if check.name not in procedures:
            raise InputError(
                text(
                    "{path}: procedure {name!r}: {hint}",
                    path=path,
                    name=check.name,
                    hint=procedures.why_not(check.name),
                )
            )
    plan = file.plan
    absolute = {
        limit.parameter: ParameterLimits(
            -math.inf if limit.low is None else limit.low, math.inf if limit.high is None else limit.high
        )
        for limit in file.limit
        if limit.percent is None
    }
    golden = {
        limit.parameter: limit.percent for limit in file.limit if limit.percent is not None and limit.of == "golden"
    }
    absolute |= {parameter: _about(file.golden[parameter], percent) for parameter, percent in golden.items()}
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
    )


def plan_schema() -> dict[str, Any]:
    """Return the plan file's JSON schema, for editors."""
    return PlanFile.model_json_schema()


def _about(reference: float, percent: float) -> ParameterLimits:
    spread = abs(reference) * percent / 100.0
    return ParameterLimits(reference - spread, reference + spread)
