"""Tables of flux linkages that others measured, evaluated by the estimators of the procedures."""

import math
from collections.abc import Mapping, Sequence
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np

from bench.analysis.map_columns import AngleFrom, map_columns
from bench.analysis.run_map import map_of_run
from bench.analysis.table_outcome import give, told, withheld_rows
from bench.analysis.zero_current import ThinnedMap, beyond_table, widened
from bench.i18n.errors import InputError, at
from drivers.interfaces.text import Translate, english, text, text_of
from procedures.core.misfit_text import sentence
from procedures.estimation.fitting.fit import EstimationError
from procedures.estimation.fitting.misfit import Answer, Cause
from procedures.estimation.flux.capability import largest_torque
from procedures.estimation.flux.flux_map import GainLimits, MapFigure, MeasuredFluxMap
from procedures.estimation.flux.inductances import characteristic_current
from procedures.estimation.flux.mtpa import MtpaPoint, maximum_torque_per_ampere
from procedures.estimation.flux.published_map import read_map
from procedures.techniques.maps.ended import LEFT_OUT, broken_words
from procedures.techniques.maps.results import AT_EDGE, at_edge, table_of
from procedures.techniques.maps.shaft_torque import TORQUE_DIFFERS

#: What is said of a table without zero current.
BEYOND_TABLE = "beyond-table"
_SHARES = (0.25, 0.5, 0.75, 1.0)
#: Where the last of them lies at the map's edge, the first of these that does not.
_LOWER = (0.98, 0.96, 0.94, 0.92, 0.9, 0.88, 0.86, 0.84, 0.82, 0.8)


def analyze_flux_map(
    path: Path,
    *,
    mapped: Sequence[str] = (),
    pole_pairs: float | None = None,
    voltage: float | None = None,
    current: float | None = None,
    resistance: float = 0.0,
    gains: GainLimits | None = None,
    angle_from: AngleFrom | None = None,
    flux_linkage: float | None = None,
    u_flux_linkage: float = 0.0,
    translate: Translate = english,
) -> dict[str, Any]:
    """Return what follows from a table of flux linkages, in the shape of `--json`. Raises InputError for one that cannot be used."""
    table = map_columns(path, mapped, angle_from=angle_from, flux_linkage=flux_linkage, u_flux_linkage=u_flux_linkage)
    try:
        found = read_map(
            table.points,
            table.flux,
            uncertainty=table.uncertainty,
            torque=table.torque,
            pole_pairs=pole_pairs,
            gains=gains,
        )
        result = told(path, found.misfit, translate)
        details = result["details"]
        details |= {
            "points": len(table.points),
            "symmetric": found.map.symmetric,
            "full_scale": found.map.full_scale,
            "turn_degrees": math.degrees(found.turn),
            "resistance_remainder": found.resistance_remainder,
            "reciprocity_rms": found.reciprocity,
            "torque_ratio": found.torque_ratio,
        }
        withheld = found.misfit.withholding("flux_map")
        if withheld is not None:
            result["withheld"] = withheld_rows(("flux_linkage", "d_axis_inductance", "q_axis_inductance"), withheld.cause.value,
                                         sentence(withheld).render(translate), "flux-map")  # fmt: skip
            return result
        _of_map(found.map, result, pole_pairs, voltage, current, resistance, translate, table.digits)
        if any(each.cause is Cause.TORQUE_DIFFERS and each.answer is Answer.SAID for each in found.misfit.findings):
            # Which torque is meant is not known; the currents and the angle are.
            for each in details["mtpa"] + details.get("largest_torque", []):
                each["torque"] = None
    except EstimationError as error:
        raise InputError(at(str(path), text_of(error))) from error
    result["assumptions"].append(
        text(
            "currents and flux linkages are taken as peak values unless their headings say rms; no other sign of "
            "this is in the table"
        ).render(translate)
    )
    result["assumptions"] += [each.render(translate) for each in table.assumptions]
    if found.repeated:
        result["assumptions"].append(
            text(
                "{count} rows are at currents of earlier rows; the mean of the rows at one current is used",
                count=found.repeated,
            ).render(translate)
        )
    if table.uncertainty is None:
        result["assumptions"].append(
            text(
                "the table states no uncertainties; the scatter about a smooth surface and the stated gain "
                "errors are used instead"
            ).render(translate)
        )
    if pole_pairs is None:
        result["assumptions"].append(
            text("without --pole-pairs, the torque is calculated for one pole pair").render(translate)
        )
    return result


def analyze_run_map(
    path: Path,
    *,
    pole_pairs: float | None = None,
    voltage: float | None = None,
    current: float | None = None,
    resistance: float = 0.0,
    standstill: bool = False,
    translate: Translate = english,
) -> tuple[dict[str, Any], Mapping[str, Sequence[float]]]:
    """Return what follows from the readings of a run's flux map, however it ended, as `analyze_flux_map` does, and the map's table; of
    the map at standstill where the run has no other, or where `standstill` asks for it.

    Raises InputError where the run's folder has no readings, or too few for a map.
    """
    try:
        found = map_of_run(path, pole_pairs, standstill=standstill)
        made = told(path, found.misfit, translate)
        sentences = {
            "sessions-contradict": None if found.broken is None else broken_words(found.broken, LEFT_OUT),
            TORQUE_DIFFERS: None if found.torque is None else found.torque.contradiction,
        }
        for identifier, message in sentences.items():
            if message is not None:
                made["warnings"].append({"id": identifier, "text": message.render(translate)})
        made["details"] |= {
            **found.details,
            "points": len(found.map.points),
            "full_scale": found.map.full_scale,
            "pole_pairs": found.pole_pairs,
        }
        _of_map(found.map, made, found.pole_pairs, voltage, current, resistance, translate)
    except EstimationError as error:
        raise InputError(at(str(path), text_of(error))) from error
    if found.pole_pairs is None:
        made["assumptions"].append(
            text("without --pole-pairs, the torque is calculated for one pole pair").render(translate)
        )
    return made, table_of(found.map)


def _of_map(
    measured: MeasuredFluxMap,
    made: dict[str, Any],
    pole_pairs: float | None,
    voltage: float | None,
    current: float | None,
    resistance: float,
    translate: Translate,
    digits: float = 0.0,
) -> None:
    poles = 1.0 if pole_pairs is None else pole_pairs
    thinned = ThinnedMap(measured)
    zero = thinned.inductances(0.0, 0.0)
    surface, at_zero = measured.surface, np.zeros((1, 2))
    between = float(surface.spread(at_zero, np.array([[1.0, 0.0]]), np.zeros((1, 2, 2)))[0])
    beyond = beyond_table(measured)
    between = float(np.hypot(between, beyond[0]))
    flux = measured.figure(float(surface(at_zero)[0, 0]), surface.weights(at_zero)[0, 0], between=between)
    if np.any(beyond):
        zero = replace(zero, dd=widened(zero.dd, beyond[1]), qq=widened(zero.qq, beyond[2]))
        message = text(
            "the table does not reach zero current: flux linkage and inductances there are extrapolated from its "
            "edge, and their intervals are widened by the change of the inductance over the same distance within "
            "it. Add rows at zero current"
        ).render(translate)
        made["warnings"].append({"id": BEYOND_TABLE, "text": message})
    for name, unit, figure in (
        ("flux_linkage", "V·s", flux), ("d_axis_inductance", "H", zero.dd), ("q_axis_inductance", "H", zero.qq),
    ):  # fmt: skip
        give(made, name, unit, figure, "flux-map", translate, digits)
    # A square table's corners hold more current than any arc within it.
    most = float(np.min(np.max(np.abs(measured.points), axis=0)))
    most = most if current is None else min(current, measured.largest_current)
    details = made["details"]
    found, outside = _mtpa(measured, most, poles)
    details["mtpa"] = [
        {"current": each.current, "angle_degrees": each.angle.as_dict(), "torque": each.torque.as_dict(), "i_d": each.i_d,
         "i_q": each.i_q, "at_edge": each.at_edge}
        for each in found
    ]  # fmt: skip
    if outside:
        message = at_edge(max(outside)).render(translate)
        made["warnings"].append({"id": AT_EDGE, "text": message})
    details["inductances"] = [
        {"i_d": row["i_d"], "i_q": row["i_q"]}
        | {name: figure.as_dict() for name, figure in vars(thinned.inductances(row["i_d"], row["i_q"])).items()
           if isinstance(figure, MapFigure)}
        for row in details["mtpa"]
    ]  # fmt: skip
    if flux.value > 0.02 * measured.full_scale:
        weakening = characteristic_current(measured)
        details["field_weakening_current"] = None if weakening is None else weakening.as_dict()
    if voltage is not None:
        # From a speed at which nothing limits up to where the magnet alone takes several times the voltage.
        typical = voltage / measured.full_scale
        points = largest_torque(measured, typical * np.geomspace(0.3, 6.0, 16), voltage=voltage, current=most,
                                resistance=resistance, pole_pairs=poles)  # fmt: skip
        details["largest_torque"] = [
            {"electrical_speed": each.electrical_speed, "torque": each.torque.as_dict(), "i_d": each.i_d, "i_q": each.i_q,
             "voltage": each.voltage, "limit": each.limit.value}
            for each in points
        ]  # fmt: skip


def _mtpa(measured: MeasuredFluxMap, most: float, poles: float) -> tuple[list[MtpaPoint], list[float]]:
    """Return the largest torques per ampere up to a current (A), and the currents at which they lie outside of the map.

    What the edge has is no maximum, and its interval would be none of it: the largest current that has one takes the last one's place.
    """
    points = maximum_torque_per_ampere(measured, most * np.array(_SHARES), poles)
    beyond = [each.current for each in points if each.at_edge]
    inside = [each for each in points if not each.at_edge]
    if points[-1].at_edge and inside:
        lower = most * np.array(_LOWER)
        nearer = maximum_torque_per_ampere(measured, lower[lower > inside[-1].current], poles)
        inside += [each for each in nearer if not each.at_edge][:1]
    return inside, beyond
