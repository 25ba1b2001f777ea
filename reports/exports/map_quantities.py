"""Figures of exports that come from a flux map, and when a map must not go into a controller."""

import math
from collections.abc import Callable, Iterator
from dataclasses import dataclass
from typing import TYPE_CHECKING

from drivers.interfaces.text import Text, text
from reports.exports.exported_map import LARGEST_UNCERTAINTY, ExportedMap
from reports.exports.figures import ExportFigure
from reports.tables.figures import percent

if TYPE_CHECKING:
    from reports.exports.subject import Subject

#: The scale's uncertainty at the largest current, of L, with which it goes into a controller: that of L.
_SCALE_UNCERTAINTY = 0.10


def _nothing(_found: ExportedMap, _bound: float | None) -> Iterator[Text]:
    return iter(())


@dataclass(frozen=True)
class FromMap:
    """A figure of a flux map: unit, convention and value; `against` says what stands against a map that would do otherwise."""

    unit: str
    convention: str
    value: Callable[[ExportedMap], ExportFigure]
    whole: bool = False
    against: Callable[[ExportedMap, float | None], Iterator[Text]] = _nothing


def map_objections(source: FromMap, subject: "Subject", replaced: float | None) -> Iterator[tuple[str, Text]]:
    """Give what stands against a figure of the run's map; `replaced` is the bound on its relative uncertainty instead of ours."""
    found = subject.flux_map
    if found is None:
        withheld = subject.withheld.get("map_flux_linkage", ())
        if withheld:
            yield "flux map", withheld[0].sentence
        else:
            procedures = list(subject.given_by.get("map_flux_linkage", ("flux-map",)))
            yield "flux map", text("a flux map is needed and the run has none; run {procedures}", procedures=procedures)
        return
    if subject.pole_pairs_doubt is not None:
        yield (
            "pole_pairs",
            text("the number of pole pairs is not certain: {doubt}", doubt=subject.pole_pairs_doubt),
        )
    bound = LARGEST_UNCERTAINTY if replaced is None else replaced
    spread = found.relative_uncertainty
    if not math.isfinite(spread) or spread > bound:
        yield (
            "flux map",
            text(
                "the flux map is known to {relative} % of its full scale only (standard uncertainty), but at most "
                "{bound} % is allowed; measure it more accurately, or allow more",
                relative=percent(spread),
                bound=percent(bound),
            ),
        )
        return
    yield from (("flux map", reason) for reason in source.against(found, replaced))


def _scale(found: ExportedMap) -> ExportFigure:
    line = found.saturation
    if line is None:
        return ExportFigure(math.nan)
    return ExportFigure(line.scale, line.standard_uncertainty, line.coverage_interval)


def _scale_objections(found: ExportedMap, replaced: float | None) -> Iterator[Text]:
    line = found.saturation
    if line is None:
        yield text("the flux map has no points on the negative d axis, where the scale of L_d is fitted")
        return
    bound = _SCALE_UNCERTAINTY if replaced is None else replaced
    spread = abs(line.standard_uncertainty * line.lowest / line.inductance)
    if not spread <= bound:
        yield text(
            "the scale of L_d is known to {relative} % of L_d at the largest current only (standard uncertainty), "
            "but at most {bound} % is allowed",
            relative=percent(spread),
            bound=percent(bound),
        )


def _resistance_objections(found: ExportedMap, _: float | None) -> Iterator[Text]:
    if not found.resistance > 0.0:
        yield text("the map's readings give no resistance above 0")


MAP_POLE_PAIRS = FromMap(
    "", "pole pairs, as the map was made with", lambda found: ExportFigure(found.pole_pairs, exact=True), whole=True
)
MAP_RESISTANCE = FromMap(
    "Ohm",
    "phase to neutral of the Y-equivalent with leads and inverter, mean of the map's readings, as warm as the winding was",
    lambda found: ExportFigure(found.resistance, exact=True),
    against=_resistance_objections,
)
D_INDUCTANCE_SCALE = FromMap(
    "H/A",
    "C of psi_d = lambda + Ld id + C id^2 at iq = 0, id < 0, from the flux map: L of the chord, as moteus_tool fits it",
    _scale,
    against=_scale_objections,
)
