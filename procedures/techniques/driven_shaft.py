"""A motor that the dynamometer drives: how fast it may be turned, and whether it is."""

import math

from drivers.interfaces import Reading
from drivers.interfaces.text import text
from procedures.core.bench import Bench, ProcedureError
from procedures.core.nameplate import Nameplate

#: A tachometer that differs by more than this share from the speed that was commanded reads something else.
_AGREE = 0.1


def check_turning(bench: Bench, read: Reading, commanded: float) -> None:
    """Raise ProcedureError where the tachometer does not read the speed (rad/s) at which the dynamometer drives the shaft."""
    if bench.dynamometer.read_by_hand or abs(read.value - abs(commanded)) <= _AGREE * abs(commanded):
        return
    raise ProcedureError(
        text(
            "the tachometer reads {read:.0f} rpm while the dynamometer drives the shaft at {driven:.0f} rpm: see whether it looks at the "
            "mark, and at one mark only",
            read=read.value * 30.0 / math.pi,
            driven=abs(commanded) * 30.0 / math.pi,
        )
    )


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
