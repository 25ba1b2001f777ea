"""TI MotorControl SDK: the motor's definitions of user_mtr1.h."""

from reports.exports import quantities as q
from reports.exports.comments import C, head
from reports.exports.controllers.defines import defines
from reports.exports.target import Field, Sheet, Target


def write(sheet: Sheet) -> str:
    """Return the definitions; kits that number their motors have USER_MOTOR1_ instead of USER_MOTOR_."""
    lines = list(head(sheet, C, "TI MotorControl SDK, user_mtr1.h; kits that number their motors write USER_MOTOR1_"))
    return "\n".join([*lines, *defines(sheet.lines, suffix="f"), ""])


TARGET = Target(
    "ti",
    "TI MotorControl SDK",
    ".h",
    (
        Field("USER_MOTOR_NUM_POLE_PAIRS", q.POLE_PAIRS),
        Field("USER_MOTOR_Rs_Ohm", q.RESISTANCE),
        Field("USER_MOTOR_Ls_d_H", q.D_INDUCTANCE),
        Field("USER_MOTOR_Ls_q_H", q.Q_INDUCTANCE),
        Field("USER_MOTOR_RATED_FLUX_VpHz", q.FLUX_PER_HERTZ),
    ),
    write,
)
