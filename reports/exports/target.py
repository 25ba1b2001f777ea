"""A controller's file: its fields, each with the quantity behind it, and the sheet of figures that it is written from."""

import math
from collections.abc import Callable, Iterable, Mapping, Sequence
from dataclasses import dataclass, replace
from typing import Any, Protocol

import numpy as np
from numpy.typing import NDArray

from drivers.interfaces.text import Text, text
from reports.exports.checks import ExportRefusedError, UncertaintyBounds, objections
from reports.exports.current_loop import crossover
from reports.exports.figures import ExportFigure
from reports.exports.loop_reach import bandwidth_notices
from reports.exports.map_quantities import MAP_POLE_PAIRS, FromMap, map_objections
from reports.exports.quantities import ExportQuantity, Source, figure
from reports.exports.subject import Subject


@dataclass(frozen=True)
class Field:
    """A field of a controller by its own name; an `optional` one is left out where its quantity cannot be had.

    `remark` stands beside the convention.
    """

    name: str
    quantity: Source
    optional: bool = False
    remark: str = ""


@dataclass(frozen=True)
class ExportLine:
    """One field with its figure."""

    name: str
    figure: ExportFigure
    unit: str
    convention: str
    whole: bool
    from_parameters: tuple[str, ...]

    @property
    def text(self) -> str:
        """The value as files have it: a count as a whole number, else nine significant digits (a float32 has seven)."""
        return str(round(self.figure.value)) if self.whole else f"{self.figure.value:.9g}"

    @property
    def comment(self) -> str:
        """Unit, standard uncertainty and convention, in ASCII."""
        words = [self.unit] if self.unit else []
        if not self.figure.exact:
            spread = self.figure.standard_uncertainty
            words.append(f"u = {spread:.2g}" if spread else "no significant difference")
        return ", ".join([*words, self.convention])

    def as_dict(self) -> dict[str, Any]:
        """Return it in JSON's types; an exact figure has no uncertainty."""
        result: dict[str, Any] = {
            "value": round(self.figure.value) if self.whole else self.figure.value,
            "unit": self.unit,
            "convention": self.convention,
            "from": list(self.from_parameters),
        }
        if not self.figure.exact:
            result["standard_uncertainty"] = self.figure.standard_uncertainty
            result["coverage_interval"] = list(self.figure.coverage_interval)
        return result


@dataclass(frozen=True)
class Sheet:
    """The content of a file: the fields in the target's order, those left out and why, and the subject."""

    subject: Subject
    lines: tuple[ExportLine, ...]
    left_out: tuple[Text, ...] = ()

    def line(self, name: str) -> ExportLine:
        """Return a field. Raises KeyError where the sheet has none of this name."""
        for line in self.lines:
            if line.name == name:
                return line
        raise KeyError(name)


class RecordedWaveform(Protocol):
    """Samples of a channel: time (s) and values (n,) in `unit`, `resolution` one step of the converter."""

    @property
    def time(self) -> NDArray[np.float64]:
        """Time of each sample (s)."""

    @property
    def values(self) -> NDArray[np.float64]:
        """Samples."""

    @property
    def unit(self) -> str:
        """Unit of the samples."""

    @property
    def resolution(self) -> float:
        """One step of the converter, in that unit; 0 where unknown."""

    @property
    def clipped(self) -> bool:
        """True if the record was driven out of range."""


@dataclass(frozen=True)
class Recorded:
    """A record of a run by its name, and its waveforms by channel."""

    name: str
    waveforms: Mapping[str, RecordedWaveform]


@dataclass(frozen=True)
class Target:
    """A controller or simulator that parameters can be written for; `write` gives the file's text, `suffix` its usual ending.

    One without fields takes every parameter as it was measured. `current_loop` gives the fields of the current loop's gains for a
    bandwidth (Hz). `as_detected` are the fields that differ where the file is to hold what the controller's own detection would have
    stored, for a firmware that counts on it. One that is `of_map` takes the run's flux map, whatever its fields are.
    `write_records` makes a binary file of a run's waveforms, from the text, when the run began (ISO 8601) and the records.
    """

    name: str
    title: str
    suffix: str
    fields: Sequence[Field]
    write: Callable[[Sheet], str]
    current_loop: Callable[[float], Sequence[Field]] | None = None
    as_detected: Sequence[Field] = ()
    of_map: bool = False
    write_records: Callable[[str, str, Iterable[Recorded]], bytes] | None = None

    def all_fields(self, bandwidth: float | None, loop_rate: float | None, *, as_detected: bool) -> list[Field]:
        """Return the fields, with the current loop's gains where a `bandwidth` (Hz) is given, for a loop of so many samples a second."""
        others = {field.name: field for field in self.as_detected} if as_detected else {}
        loop: Sequence[Field] = ()
        if bandwidth and self.current_loop and not loop_rate:
            loop = self.current_loop(bandwidth)
        elif bandwidth and self.current_loop and loop_rate:
            remark = f"with a delay of 1.5 samples at {loop_rate:.6g} Hz the loop's bandwidth is {bandwidth:.4g} Hz"
            own = self.current_loop(crossover(bandwidth, loop_rate))
            loop = [replace(each, remark=f"{each.remark}; {remark}" if each.remark else remark) for each in own]
        return [*(others.get(field.name, field) for field in self.fields), *loop]


def sheet_for(
    target: Target,
    subject: Subject,
    limits: UncertaintyBounds | None = None,
    *,
    bandwidth: float | None = None,
    loop_rate: float | None = None,
    as_detected: bool = False,
) -> Sheet:
    """Return the target's figures, and the gains of a current loop of a `bandwidth` (Hz) where one is given.

    The gains are those without delay, or where `loop_rate` (Hz, samples of the loop) is given those that its delay makes this bandwidth of.

    `as_detected` has the inductances as the controller's own detection stores them. Raises ExportRefusedError naming every parameter
    that is missing or will not do.
    """
    reasons: dict[tuple[str, str], Text] = {}
    left_out: dict[tuple[str, str], Text] = {}
    lines = []
    for field in target.all_fields(bandwidth, loop_rate, as_detected=as_detected):
        if _nothing_measured(field, subject):
            continue
        against = list(objections(field.quantity, subject, limits or UncertaintyBounds()))
        if against:
            kept = left_out if field.optional else reasons
            kept.update({(name, str(reason)): reason for name, reason in against})
            continue
        lines.append(_line(field, subject))
    if target.of_map:
        against = list(map_objections(MAP_POLE_PAIRS, subject, (limits or UncertaintyBounds()).replaced))
        reasons |= {(name, str(reason)): reason for name, reason in against}
    elif not target.fields:
        # Whatever the run has is asked for: what it withheld is told, and where that is all there is nothing to write.
        absent = {(name, ""): why[0].sentence for name, why in subject.withheld.items()}
        if not subject.parameters and target.write_records is None:
            reasons = absent or {("", ""): text("no parameter was measured")}
        left_out |= absent
    if reasons:
        raise ExportRefusedError(target.name, tuple(reasons.values()))
    if bandwidth and target.current_loop:
        told = tuple(bandwidth_notices(subject.parameters, bandwidth))
        subject = replace(subject, warnings=(*subject.warnings, *told))
    return Sheet(subject, tuple(lines), tuple(left_out.values()))


def _nothing_measured(field: Field, subject: Subject) -> bool:
    """Tell whether a field wants a map that nobody asked the run for; what it could say of it is no news then."""
    return field.optional and isinstance(field.quantity, FromMap) and subject.flux_map is None


def _figure(quantity: Source, subject: Subject) -> ExportFigure:
    if not isinstance(quantity, FromMap):
        return figure(quantity, subject.parameters, subject.datasheet)
    return ExportFigure(math.nan) if subject.flux_map is None else quantity.value(subject.flux_map)


def _line(field: Field, subject: Subject) -> ExportLine:
    quantity = field.quantity
    return ExportLine(
        name=field.name,
        figure=_figure(quantity, subject),
        unit=quantity.unit,
        convention="; ".join(filter(None, (quantity.convention, field.remark))),
        whole=isinstance(quantity, ExportQuantity | FromMap) and quantity.whole,
        from_parameters=tuple(each.name for each in quantity.needs) if isinstance(quantity, ExportQuantity) else (),
    )
