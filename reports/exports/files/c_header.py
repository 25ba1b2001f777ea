"""A plain C header in SI units, for a controller of one's own."""

from reports.exports import quantities as q
from reports.exports.comments import C, head
from reports.exports.controllers.defines import defines
from reports.exports.target import Field, Sheet, Target


def write(sheet: Sheet) -> str:
    """Return the header, guarded."""
    lines = list(head(sheet, C, "motor parameters, SI units"))
    guard = "MOTOR_PARAMETERS_H"
    body = defines(sheet.lines, suffix="f")
    return "\n".join([*lines, f"#ifndef {guard}", f"#define {guard}", "", *body, "", "#endif", ""])


TARGET = Target(
    "c-header",
    "C header",
    ".h",
    (
        Field("MOTOR_POLE_PAIRS", q.POLE_PAIRS),
        Field("MOTOR_STATOR_RESISTANCE", q.RESISTANCE),
        Field("MOTOR_D_AXIS_INDUCTANCE", q.D_INDUCTANCE),
        Field("MOTOR_Q_AXIS_INDUCTANCE", q.Q_INDUCTANCE),
        Field("MOTOR_FLUX_LINKAGE", q.FLUX_LINKAGE),
        Field("MOTOR_TORQUE_CONSTANT", q.TORQUE_CONSTANT),
        Field("MOTOR_INERTIA", q.INERTIA, optional=True),
        Field("MOTOR_COULOMB_FRICTION", q.COULOMB_FRICTION, optional=True),
        Field("MOTOR_VISCOUS_FRICTION", q.VISCOUS_FRICTION, optional=True),
        Field("MOTOR_RATED_CURRENT", q.RATED_CURRENT, optional=True),
        Field("MOTOR_MAXIMUM_CURRENT", q.MAXIMUM_CURRENT, optional=True),
        Field("MOTOR_RATED_SPEED_RPM", q.RATED_SPEED, optional=True),
    ),
    write,
)
