"""The rated current of the motor that a drive is set up for: what thousandths of torque and current are of."""

import math

from drivers.interfaces import ReportedError
from drivers.interfaces.text import Text, text
from drivers.transport.can.objects import NodeObjects

#: In mA and in mN·m.
RATED_CURRENT, RATED_TORQUE = 0x6075, 0x6076
CURRENT_STEP = 1e-3


def read_rated_current(objects: NodeObjects, stated: float | None, scale: float | None) -> float:
    """Return the rated current (A, peak) by 6075h or as `stated`, times `scale` (peak amperes an ampere of the drive's).

    The thousandths of the torque 6071h are taken for those of the current: rated torque is what rated current makes.
    Raises ReportedError where it is neither readable nor stated, or both contradict each other.
    """
    if scale is None:
        raise _refused(
            objects,
            text("no object says whether the drive counts peak or rms amperes"),
            text("State current_scale in the station file: 1 for peak, 1.4142 for rms, as the drive's manual has it"),
        )
    counts = objects.read_optional(RATED_CURRENT, 0, 4)
    if counts == 0 or objects.read_optional(RATED_TORQUE, 0, 4) == 0:
        raise _refused(
            objects,
            text("rated current (0x6075) is 0") if counts == 0 else text("rated torque (0x6076) is 0"),
            text("Set up the drive for its motor first"),
        )
    if counts is None and stated is None:
        raise _refused(
            objects,
            text("the drive does not say the motor's rated current (0x6075)"),
            text("State rated_current in the station file"),
        )
    own = None if counts is None else counts * CURRENT_STEP
    if own is not None and stated is not None and not math.isclose(own, stated, rel_tol=1e-2):
        raise _refused(
            objects,
            text("rated current (0x6075) is {own:g} A, the station file says {stated:g} A", own=own, stated=stated),
            text("Correct rated_current in the station file, or the drive's set-up"),
        )
    return (own or stated or 0.0) * scale


def _refused(objects: NodeObjects, what: Text, remedy: Text) -> ReportedError:
    return ReportedError(objects.name, what, remedy=remedy)
