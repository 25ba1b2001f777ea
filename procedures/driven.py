"""How fast a driven motor may be turned."""

import math

from procedures.bench import Bench, ProcedureError
from procedures.nameplate import Nameplate
from procedures.text import text


def driving_speed_rad(bench: Bench, nameplate: Nameplate, share: float) -> float:
    """Return a speed (rad/s): a share of the rated one, kept within the dynamometer's and the motor's limits.

    Raises ProcedureError where the plate names no rated speed.
    """
    if nameplate.rated_speed_rpm is None:
        raise ProcedureError(
            text("the motor file gives no rated_speed_rpm, so no speed can be chosen; add it under [nameplate]")
        )
    bound = nameplate.speed_bound_rpm or nameplate.rated_speed_rpm
    return min(
        share * nameplate.rated_speed_rpm * math.pi / 30.0, bound * math.pi / 30.0, bench.dynamometer.maximum_speed
    )
