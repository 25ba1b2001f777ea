"""gym-electric-motor: a Python module with the dictionary that its motors take."""

from reports.exports import quantities as q
from reports.exports.comments import HASH, head
from reports.exports.target import Field, Sheet, Target


def write(sheet: Sheet) -> str:
    """Return a module that defines `motor_parameter`."""
    lines = list(
        head(sheet, HASH, "gym-electric-motor: PermanentMagnetSynchronousMotor(motor_parameter=motor_parameter)")
    )
    lines.append("motor_parameter = {")
    lines += [f'    "{line.name}": {line.text},  {HASH.comment(line.comment)}' for line in sheet.lines]
    return "\n".join([*lines, "}", ""])


TARGET = Target(
    "gym-electric-motor",
    "gym-electric-motor",
    ".py",
    (
        Field("p", q.POLE_PAIRS),
        Field("r_s", q.RESISTANCE),
        Field("l_d", q.D_INDUCTANCE),
        Field("l_q", q.Q_INDUCTANCE),
        Field("psi_p", q.FLUX_LINKAGE),
        Field("j_rotor", q.INERTIA),
    ),
    write,
)
