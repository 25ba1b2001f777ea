"""Checks of an export: its file contains each figure, is the same each time, and is refused if a required figure is missing."""

import math
import re
from collections.abc import Mapping
from dataclasses import replace
from typing import Any

import numpy as np

from bench.i18n.errors import InputError
from bench.plugins.catalogues import Catalogues, installed
from bench.testing.conformance.report import Checks, ConformanceReport
from procedures.core.result import Parameter
from reports.exports.checks import ExportRefusedError
from reports.exports.exported_map import ExportedMap
from reports.exports.map_quantities import FromMap
from reports.exports.quantities import ExportQuantity, Fixed, FromPlate
from reports.exports.subject import Datasheet, Subject
from reports.exports.target import Target, sheet_for

_PLATE = Datasheet(rated_current=29.0, maximum_current=80.0, rated_speed_rpm=3000.0, maximum_speed_rpm=4000.0)
#: A motor's name that a format may stumble over.
_AWKWARD = 'LG "400W" <µ> \\ motor; # 1, 电机'


def check_export(export: Target | str, *, catalogues: Catalogues | None = None) -> ConformanceReport:
    """Check an export, given itself or by its name. Raises InputError for one that does not exist."""
    if isinstance(export, str):
        export = (catalogues or installed()).exports.need(export, lambda why: InputError(why))
    checks = Checks()
    subject = example_subject(export)
    sheet = sheet_for(export, subject)
    written = export.write(sheet)
    advice = "Return the file"
    checks.that("writes text", isinstance(written, str) and bool(written.strip()), "nothing was written", advice)
    checks.that("the same each time", export.write(sheet) == written, "it differs", "Use no time and no order of a set")
    advice = "Give it with its point"
    checks.that("suffix", bool(re.fullmatch(r"\.[A-Za-z0-9.]+", export.suffix)), f"{export.suffix!r}", advice)
    names = [field.name for field in export.fields]
    checks.that("fields' names", len(set(names)) == len(names), f"{names}", "Name each once")
    for line in sheet.lines:
        _check_figure(export, sheet, line, written, checks)
    _check_refused(export, subject, checks)
    awkward = replace(subject, motor=_AWKWARD, serial_number=_AWKWARD)
    remedy = "Mask what the format needs"
    checks.that("an awkward name", bool(export.write(sheet_for(export, awkward))), "nothing was written", remedy)
    return checks.report(f"{export.name} (export)")


def example_subject(export: Target) -> Subject:
    """Return a motor with an accurate value for everything that an export requires."""
    values: dict[str, Parameter] = {}
    for number, each in enumerate(_needed(export)):
        value = 4.0 if each.name == "pole_pairs" else 0.0123 * (1.0 + 0.37 * number)
        deviation = 0.0 if each.name == "pole_pairs" else 1e-3 * value
        values[each.name] = Parameter(
            each.name, value, each.unit, deviation, math.inf, (value - 2.0 * deviation, value + 2.0 * deviation), "example",
            "", "example",
        )  # fmt: skip
    return Subject("LG-400W", "4711", "run", "2026-01-01", "motorbench", values, _PLATE, flux_map=_linear_map())


def _linear_map() -> ExportedMap:
    """Return the map of a motor that does not saturate: L_d 0.2 mH, L_q 0.4 mH, λ 10 mWb."""
    axis = np.linspace(-10.0, 10.0, 5)
    d, q = np.meshgrid(axis, axis, indexing="ij")
    psi_d, psi_q = 0.01 + 2e-4 * d, 4e-4 * q
    each = (d, q, psi_d, psi_q, np.full_like(d, 1e-5), np.full_like(d, 1e-5))
    points = np.column_stack([values.ravel() for values in each])
    return ExportedMap("flux-map", 4.0, points, axis, axis, psi_d, psi_q, np.hypot(d, q) <= 10.0, 0.05)


def _needed(export: Target) -> list[Any]:
    from procedures.core.parameters import PARAMETERS

    found = {each.name: each for field in export.fields for each in getattr(field.quantity, "needs", ())}
    return list(found.values()) or [PARAMETERS["stator_resistance"], PARAMETERS["pole_pairs"]]


def _check_figure(export: Target, sheet: Any, line: Any, written: str, checks: Checks) -> None:
    """Each figure stands in the file: with another value the file is another one."""
    other = replace(line, figure=replace(line.figure, value=2.0 * line.figure.value + 1.0))
    lines = tuple(other if each is line else each for each in sheet.lines)
    right, remedy = export.write(replace(sheet, lines=lines)) != written, "Write the figure of this line"
    checks.that(f"{line.name}: stands in the file", right, "the file is the same with another value", remedy)


def _check_refused(export: Target, subject: Subject, checks: Checks) -> None:
    remedy = "Make the field optional, or let sheet_for refuse it"
    for field in export.fields:
        if isinstance(field.quantity, Fixed):
            continue
        if isinstance(field.quantity, FromPlate):
            less = replace(subject, datasheet=Datasheet())
        elif isinstance(field.quantity, FromMap):
            if field.optional:
                # Without a map nobody asked for one, and there is nothing to say.
                continue
            less = replace(subject, flux_map=None)
        else:
            less = replace(subject, parameters=_without(subject.parameters, field.quantity))
        if not field.optional:
            with checks.refuses(f"{field.name}: refused where it is missing", ExportRefusedError, remedy=remedy):
                export.write(sheet_for(export, less))
        else:
            with_reasons: Any = ()
            try:
                sheet = sheet_for(export, less)
                with_reasons = sheet.left_out
                export.write(sheet)
            except ExportRefusedError:
                # Another field needs the same.
                continue
            checks.that(f"{field.name}: left out where it is missing", bool(with_reasons), "no reason is given", remedy)


def _without(parameters: Mapping[str, Parameter], quantity: ExportQuantity) -> dict[str, Parameter]:
    gone = {each.name for each in quantity.needs}
    return {name: each for name, each in parameters.items() if name not in gone}
