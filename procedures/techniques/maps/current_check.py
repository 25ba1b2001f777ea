"""Whether anything measured before tells that the currents of strokes at standstill are right."""

from typing import Any

from drivers.interfaces.text import text
from procedures.core.procedure import Procedure
from procedures.estimation.flux.gain_ratio import GainRatio, KnownResistance
from procedures.estimation.winding.resistance import at_temperature
from procedures.techniques.temperature.correction import winding_temperature
from procedures.techniques.temperature.settings import COLD


def known_resistance(procedure: Procedure[Any]) -> KnownResistance | None:
    """Return the resistance per phase of the equivalent wye, as warm as the winding is now; None where it was not measured before.

    The procedure has the settings of a winding's temperature. Raises ProcedureError as `winding_temperature` does.
    """
    known, settings = procedure.known.get("stator_resistance"), procedure.settings
    if known is None:
        return None
    now = winding_temperature(procedure, settings.winding_temperature, settings.temperature_uncertainty)
    cold = procedure.bench.uncertainties.of_parameter(known)
    warm = at_temperature(cold, COLD, now, settings.coefficient, settings.coefficient_reference)
    return KnownResistance(float(warm.x), float(warm.u))


def tell_current(procedure: Procedure[Any], beside: GainRatio | None, limit: float) -> None:
    """Say what tells that the drive's currents, `limit` of whose gain is stated (relative), are right, or that nothing does.

    `beside` is the strokes' resistance over the known one, None where none is known.
    """
    if beside is None:
        procedure.notice(
            "current-not-checked",
            text(
                "the drive's current is taken to be right within {limit:.2%}, as stated for it: nothing in this run checks it, and a "
                "larger error is in every point of the map. Measure the resistance before, in the same run (stator-resistance or "
                "stator-resistance-dc)",
                limit=limit,
            ),
        )
        return
    procedure.findings["resistance_ratio"] = {
        "ratio": beside.ratio,
        "standard_uncertainty": beside.standard_uncertainty,
    }
    if beside.contradicted:
        procedure.notice(
            "resistances-differ",
            text(
                "the strokes show {ratio:.4f} times the resistance that was measured before, known to ±{expanded:.2g}: check the gain of "
                "the drive's currents, the factors of the voltage probes, the winding's temperature, and that the probes are on the "
                "motor's terminals. All intervals hold a current or a voltage that is wrong by the difference",
                ratio=beside.ratio,
                expanded=2.0 * beside.standard_uncertainty,
            ),
        )
