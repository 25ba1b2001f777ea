"""ST Motor Control SDK: the motor's definitions of pmsm_motor_parameters.h."""

from reports.exports import quantities as q
from reports.exports.comments import C, head
from reports.exports.controllers.defines import defines
from reports.exports.target import Field, Sheet, Target


def write(sheet: Sheet) -> str:
    """Return the definitions."""
    lines = list(head(sheet, C, "ST MCSDK, pmsm_motor_parameters.h"))
    return "\n".join([*lines, *defines(sheet.lines), ""])


TARGET = Target(
    "st",
    "ST MCSDK",
    ".h",
    (
        Field("POLE_PAIR_NUM", q.POLE_PAIRS),
        Field("RS", q.RESISTANCE),
        Field("LS", q.Q_INDUCTANCE, remark="the header wants Lq of an I-PMSM"),
        Field("MOTOR_VOLTAGE_CONSTANT", q.EMF_RMS_LINE),
    ),
    write,
)
