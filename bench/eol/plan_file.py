"""A plan's file: its tables, and what they allow."""

import datetime
import re
import warnings
from typing import Annotated, Any, Literal

from pydantic import Field, field_validator, model_validator

from bench.eol.limits import GuardBand
from bench.eol.serial_number import spelled, spelled_pattern
from bench.files.toml_file import Section
from bench.plugins.files import PluginsSection
from drivers.interfaces.text import text

OnFailure = Literal["stop", "go_on", "retry"]
KeepWaveforms = Literal["all", "failed", "none"]
_MOST_RETRIES = 10
#: What a plan takes that says nothing of its serial numbers.
ANY_SERIAL = r"\S{1,64}"


def _per_cent() -> Any:
    return Field(default=0.0, ge=0.0, le=20.0, strict=True, json_schema_extra={"unit": "%"})


class _Plan(Section):
    """`[plan]`: the plan itself."""

    name: str = Field(min_length=1, description="the plan's name")
    motor: str = Field(
        min_length=1, description="the type: a motor file beside the plan, or the name of a shipped motor"
    )
    serial_pattern: str = Field(default=ANY_SERIAL, description="regular expression that a whole serial number matches")
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
                re.compile(spelled_pattern(pattern))
        except (re.error, Warning, OverflowError, RecursionError) as error:
            raise ValueError(
                text(
                    "serial_pattern = {pattern!r} is no regular expression: {error}",
                    pattern=pattern,
                    error=error,
                )
            ) from None
        return spelled_pattern(pattern)


class _Procedure(Section):
    """`[[procedure]]`: one measurement, with its settings."""

    name: str = Field(min_length=1, description="as motorbench procedures lists it")
    settings: dict[str, Any] = Field(default_factory=dict, description="EOL settings by name")
    every: int = Field(default=1, ge=1, le=1_000_000, strict=True, description="measured of every n-th motor")
    on_failure: OnFailure | None = Field(default=None, description="instead of the plan's")
    retries: int | None = Field(default=None, ge=1, le=_MOST_RETRIES, strict=True)
    after: list[str] = Field(default_factory=list, description="procedures that come before, whatever the order")


#: A figure in its parameter's unit, or typed with a unit of that kind, as "15.2 mΩ".
Figure = Annotated[float, Field(strict=True, allow_inf_nan=False)] | Annotated[str, Field(strict=True)]


class LimitSection(Section):
    """`[[limit]]`: bounds on one parameter, absolute or in per cent of its type value or of a golden motor's."""

    parameter: str = Field(min_length=1, description="a parameter's name, as results give it")
    low: Figure | None = Field(
        default=None, description='a number in the parameter\'s unit, or text with another, as in "15.2 mΩ"'
    )
    high: Figure | None = Field(
        default=None, description='a number in the parameter\'s unit, or text with another, as in "15.2 mΩ"'
    )
    percent: float | None = Field(
        default=None, gt=0.0, le=1000.0, strict=True, description="± per cent of the reference"
    )
    of: Literal["type", "golden"] = Field(default="type", description="what per cent are taken of")

    @model_validator(mode="after")
    def _one_way(self) -> "LimitSection":
        absolute = self.low is not None or self.high is not None
        if absolute == (self.percent is not None):
            raise ValueError(
                text("limit on {parameter}: give low and high (or one of them), or percent", parameter=self.parameter)
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


class BrakeSection(Section):
    """`[brakes]`: after how many motors in a row that did not pass a socket, or the whole line, takes no more."""

    socket_fails: int = Field(
        default=10, ge=0, le=1000, strict=True, description="motors in a row that did not pass, that stop a socket; 0 for never",
    )  # fmt: skip
    socket_errors: int = Field(
        default=3, ge=0, le=1000, strict=True, description="motors in a row that could not be measured, that stop a socket; 0 for never",
    )  # fmt: skip
    line_fails: int = Field(
        default=20, ge=0, le=1000, strict=True, description="motors in a row that did not pass, that stop the line; 0 for never",
    )  # fmt: skip
    line_errors: int = Field(
        default=6, ge=0, le=1000, strict=True, description="motors in a row that could not be measured, that stop the line; 0 for never",
    )  # fmt: skip


class RetestSection(Section):
    """`[again]`: which motors that were tested before are taken again without asking anybody."""

    verdicts: frozenset[Literal["pass", "fail", "error", "aborted"]] = Field(
        default=frozenset({"error", "aborted"}), description="verdicts after which a motor is taken again"
    )
    most_tests: int = Field(
        default=3, ge=1, le=100, strict=True, description="tests of a motor, those that were aborted not counted"
    )
    unknown: Literal["measure", "refuse"] = Field(
        default="measure", description="whether to test a motor whose earlier tests cannot be looked up"
    )


class GoldenTestSection(Section):
    """`[golden_test]`: motors that watch the station, and when a socket takes no others until one of them has passed."""

    serial_numbers: list[str] = Field(default_factory=list, description="serial numbers of the golden motors")
    every: float = Field(
        default=8.0, gt=0.0, le=8760.0, strict=True, json_schema_extra={"unit": "h"},
        description="hours after which one is due again",
    )  # fmt: skip
    shifts: list[datetime.time] = Field(
        default_factory=list, description="times of day at which one is due again, as 06:00:00"
    )
    tests: int = Field(
        default=10, ge=5, le=1000, strict=True,
        description="tests of each golden motor at a socket from which its limits there follow",
    )  # fmt: skip
    since: datetime.date | None = Field(
        default=None, description="first day of these tests, after a calibration for instance, as 2026-03-31"
    )

    @field_validator("serial_numbers")
    @classmethod
    def _each_once(cls, serials: list[str]) -> list[str]:
        golden = [spelled(serial) for serial in serials]
        if len(set(golden)) < len(golden) or not all(golden):
            raise ValueError(text("each golden motor's serial number stands there once, and none is empty"))
        return golden


class PlanFile(Section):
    """A plan's whole file."""

    plan: _Plan
    procedure: list[_Procedure] = Field(min_length=1, description="at least one")
    limit: list[LimitSection] = Field(default_factory=list)
    golden: dict[str, Figure] = Field(default_factory=dict, description="figures of a golden motor by parameter")
    brakes: BrakeSection = Field(default_factory=BrakeSection)
    again: RetestSection = Field(default_factory=RetestSection)
    golden_test: GoldenTestSection = Field(default_factory=GoldenTestSection)
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
            chosen = procedure.on_failure or self.plan.on_failure
            if procedure.retries is not None and chosen != "retry":
                raise ValueError(
                    text(
                        "procedure {name}: retries = {retries} has no effect with on_failure = {chosen!r}; give "
                        "on_failure = 'retry', or leave retries out",
                        name=procedure.name,
                        retries=procedure.retries,
                        chosen=chosen,
                    )
                )
            for before in procedure.after:
                if before not in names[:place]:
                    raise ValueError(
                        text(
                            "procedure {name}: after = {before!r} names a procedure that is not listed before it",
                            name=procedure.name,
                            before=before,
                        )
                    )
        for limit in self.limit:
            if limit.of == "golden" and limit.percent is not None and limit.parameter not in self.golden:
                raise ValueError(text("limit on {parameter}: golden.{parameter} is missing", parameter=limit.parameter))
        return self
