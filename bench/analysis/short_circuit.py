"""Tables of short circuits over speed that others measured, evaluated by the estimators of the procedures."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np

from bench.analysis.map_table import SPEED, TORQUE, read_table
from bench.analysis.table_headings import KnownColumn
from bench.analysis.table_outcome import digits_of, give, told, withheld_rows
from bench.captures.written_digits import FloatArray
from bench.i18n.errors import InputError, at
from drivers.interfaces.text import Text, Translate, english, text, text_of
from procedures.core.misfit_text import sentence
from procedures.estimation.fitting.fit import EstimationError
from procedures.estimation.flux.flux_map import MapFigure
from procedures.estimation.flux.short_circuit import fit_short_circuit
from procedures.estimation.flux.short_limits import ShortLimits

_PHASES = ("current_a", "current_b", "current_c")
_SHORT = {
    "speed": KnownColumn("rad/s", SPEED),
    "electrical_speed": KnownColumn("rad/s", ("welectrical", "electricalspeed", "speedelectrical", "we")),
    "current": KnownColumn("A", ("current", "i", "isc")),
    "current_a": KnownColumn("A", ("currenta", "currentu", "current1", "ia", "iu", "i1")),
    "current_b": KnownColumn("A", ("currentb", "currentv", "current2", "ib", "iv", "i2")),
    "current_c": KnownColumn("A", ("currentc", "currentw", "current3", "ic", "iw", "i3")),
    "torque": KnownColumn("N·m", TORQUE),
    "friction": KnownColumn("N·m", ("friction", "topen", "openl")),
}
#: Limits of error where none is stated: a current clamp with its oscilloscope, a drive's display, a torque transducer of class 0.5 (its
#: zero: of the largest torque), windings as an unremarkable motor has them; the flux linkage's standard uncertainty.
_CURRENT, _SPEED, _TORQUE, _ZERO_SHARE, _UNBALANCE = 0.02, 0.01, 0.005, 0.005, 0.03
#: What the currents of a motor whose bridges saturate take L_q by, where they are evaluated with inductances that do not.
_SATURATION = 0.4
USUAL_FLUX = 0.01
_SHARED = {
    "current": text("gain of the currents"),
    "flux_linkage": text("flux linkage as stated"),
    "torque": text("gain of the torques"),
    "speed": text("gain of the speeds"),
    "saturation": text("inductances that depend on the current"),
}
#: More rows take minutes and gigabytes: each is weighed in thousands of candidates.
_MOST = 500
#: Phases that differ by more than this are told.
_UNEQUAL = 0.03


@dataclass(frozen=True)
class LimitsOfTable:
    """Limits of error as a person stated them, None where nobody did; relative, `torque_zero` in N·m."""

    current: float | None = None
    unbalance: float | None = None
    speed: float | None = None
    torque: float | None = None
    torque_zero: float | None = None
    saturation: float | None = None


def limits_of(stated: LimitsOfTable | None = None, *, largest_torque: float = 0.0, phases: int = 1) -> ShortLimits:
    """Return the limits to reckon with: what is stated, and what is usual where nothing is, for a largest torque (N·m) and so many phases
    whose mean the currents are.
    """
    said = stated or LimitsOfTable()

    def of(given: float | None, usual: float) -> float:
        return usual if given is None else given

    # Three deviations sum to nothing: the mean of two deviates by half of the third's.
    unequal = of(said.unbalance, _UNBALANCE) * (0.0, 1.0, 0.5, 0.0)[phases]
    zero = of(said.torque_zero, _ZERO_SHARE * largest_torque)
    return ShortLimits(
        of(said.current, _CURRENT),
        unequal,
        of(said.speed, _SPEED),
        of(said.torque, _TORQUE),
        zero,
        of(said.saturation, _SATURATION),
    )


def analyze_short_circuit(
    path: Path,
    *,
    mapped: Sequence[str] = (),
    pole_pairs: float,
    flux_linkage: float | None = None,
    u_flux_linkage: float | None = None,
    electrical: bool = False,
    rms: bool = False,
    stated: LimitsOfTable | None = None,
    translate: Translate = english,
) -> dict[str, Any]:
    """Return what a table of short-circuit currents and torques over speed gives. Raises InputError for one that cannot be used."""
    columns = read_table(
        path,
        _SHORT,
        ("speed", "current"),
        mapped,
        instead={"speed": "electrical_speed", "current": "current_a"},
        rms=("current", *_PHASES) if rms else (),
        most=_MOST,
    )
    speed = columns.get("electrical_speed", np.zeros(0))
    if "speed" in columns:
        speed = columns["speed"] * (1.0 if electrical else pole_pairs)
    current, phases = _mean(columns)
    torque = columns.get("torque")
    largest = 0.0 if torque is None else float(np.nanmax(np.abs(torque), initial=0.0))
    known = USUAL_FLUX * (flux_linkage or 0.0) if u_flux_linkage is None else u_flux_linkage
    limits = limits_of(stated, largest_torque=largest, phases=phases)
    try:
        fit = fit_short_circuit(
            speed, current, torque, pole_pairs=pole_pairs, flux_linkage=flux_linkage, u_flux_linkage=known,
            friction=columns.get("friction"), limits=limits,
        )  # fmt: skip
    except EstimationError as error:
        raise InputError(at(str(path), text_of(error))) from error
    result = told(path, fit.misfit, translate)
    result["details"] |= {name: figure.as_dict() if isinstance(figure, MapFigure) else figure
                        for name, figure in vars(fit).items() if name != "misfit"}  # fmt: skip
    result["details"]["limits"] = vars(limits)
    if phases > 1:
        _tell_phases(result, columns, translate)
    resistance = fit.resistance or fit.resistance_by_current
    for name, unit, figure in (
        ("d_axis_inductance", "H", fit.chord_inductance), ("q_axis_inductance", "H", fit.q_axis_inductance),
        ("stator_resistance", "Ω", resistance), ("short_circuit_current", "A", fit.limit_current),
    ):  # fmt: skip
        # The current is that of the same fit as the inductance.
        reason = fit.misfit.withholding("d_axis_inductance" if figure is fit.limit_current else name)
        if figure is None:
            continue
        if reason is None:
            give(result, name, unit, figure, "short-circuit", translate, digits_of(columns), _SHARED)
        else:
            result["withheld"] |= withheld_rows(
                (name,), reason.cause.value, sentence(reason).render(translate), "short-circuit"
            )
    assumed = _assumed(stated or LimitsOfTable(), limits, torque is not None, phases)
    assumed.append(
        text("currents are rms, as --rms says; the flux linkage is a peak value")
        if rms
        else text(
            "currents are taken as peak values unless their heading says rms; so is the flux linkage. Use "
            "--rms if the currents are rms"
        )
    )
    assumed.append(
        text(
            "L_d is the chord from zero to the short-circuit current, not the slope at zero; L_q is the chord to the table's largest "
            "q-axis current"
        )
    )
    if flux_linkage is None:
        assumed.append(
            text(
                "without --flux-linkage, only the current at high speed can be calculated; state it for L_d, L_q and R"
            )
        )
    elif u_flux_linkage is None:
        assumed.append(
            text(
                "no --u-flux-linkage is stated: the flux linkage is taken as known to {share:.2g} % (standard uncertainty), as by a "
                "voltage probe with its oscilloscope",
                share=100.0 * USUAL_FLUX,
            )
        )
    result["assumptions"] += [each.render(translate) for each in assumed]
    return result


def _mean(columns: Mapping[str, FloatArray]) -> tuple[FloatArray, int]:
    """Return the phases' mean current (A) and of how many phases it is."""
    read = [columns[name] for name in _PHASES if name in columns]
    if not read or ("current" in columns and len(read) < 3):
        return columns["current"], 1
    return np.mean(read, axis=0), len(read)


def _tell_phases(result: dict[str, Any], columns: Mapping[str, FloatArray], translate: Translate) -> None:
    """Tell by how much the phases differ: at low speed their resistances do, at high speed their inductances."""
    read = np.array([columns[name] for name in _PHASES if name in columns])
    shares = read / np.mean(read, axis=0) - 1.0
    result["details"]["phase_deviation"] = {
        name: [float(each) for each in row]
        for name, row in zip([name for name in _PHASES if name in columns], shares, strict=True)
    }
    farthest = float(shares.flat[int(np.nanargmax(np.abs(shares)))])
    if abs(farthest) > _UNEQUAL:
        message = text(
            "a phase's current differs from the mean by up to {share:+.1%}: at low speed unequal resistances or contacts cause this, at "
            "high speed unequal inductances, at all speeds alike a probe's factor",
            share=farthest,
        )
        result["warnings"].append({"id": "unequal-phases", "text": message.render(translate)})


def _assumed(stated: LimitsOfTable, limits: ShortLimits, torque: bool, phases: int) -> list[Text]:
    """Return what limits of error were taken where none was stated, and which reading of a data sheet that is."""
    said = []
    if stated.current is None:
        said.append(
            text(
                "no --current-gain is stated: currents are taken as within ±{limit:.2g} % of the reading, as a current clamp with its "
                "oscilloscope",
                limit=100.0 * limits.current,
            )
        )
    if stated.unbalance is None and phases < 3:
        said.append(
            text(
                "no --unbalance is stated: the current is taken as within ±{limit:.2g} % of the mean of three phases. Give three columns, "
                "or 0 if the column is such a mean",
                limit=100.0 * limits.unequal,
            )
        )
    if stated.speed is None:
        said.append(
            text(
                "no --speed-gain is stated: speeds are taken as within ±{limit:.2g} %, as on a drive's display; an encoder or an optical "
                "tachometer has 0.1 % or less",
                limit=100.0 * limits.speed,
            )
        )
    if torque and stated.torque is None:
        said.append(
            text(
                "no --torque-gain is stated: torques are taken as within ±{limit:.2g} % of the reading, as by a transducer of that class",
                limit=100.0 * limits.torque,
            )
        )
    if torque and stated.torque_zero is None:
        said.append(
            text(
                "no --torque-zero is stated: the torque's zero is taken as within ±{limit:.2g} N·m, {share:.2g} % of the largest torque",
                limit=limits.torque_zero,
                share=100.0 * _ZERO_SHARE,
            )
        )
    if stated.saturation is None:
        said.append(
            text(
                "no --saturation is stated: L_q is taken as within ±{limit:.2g} % of what inductances that do not depend on the current "
                "give, as found with saturating bridges. State 0 for a motor that does not saturate up to its short-circuit current",
                limit=100.0 * limits.saturation,
            )
        )
    return said
