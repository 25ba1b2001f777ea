"""moteus: configuration lines for `moteus_tool --restore-config`."""

from reports.exports import current_loop as loop
from reports.exports import quantities as q
from reports.exports.comments import ASCII_HASH, head
from reports.exports.map_quantities import D_INDUCTANCE_SCALE
from reports.exports.target import Field, Sheet, Target


def write(sheet: Sheet) -> str:
    """Return one `name value` a line; the tool cuts comments off at the hash."""
    lines = list(head(sheet, ASCII_HASH, "moteus: moteus_tool --restore-config FILE, firmware ABI 0x010a or later"))
    lines += [f"{line.name} {line.text}  {ASCII_HASH.comment(line.comment)}" for line in sheet.lines]
    return "\n".join([*lines, ""])


TARGET = Target(
    "moteus",
    "moteus",
    ".cfg",
    (
        Field("motor.poles", q.POLES),
        Field("motor.resistance_ohm", q.RESISTANCE),
        Field("motor.inductance_d_H", q.D_INDUCTANCE),
        Field("motor.inductance_q_H", q.Q_INDUCTANCE),
        Field("motor.Kv", q.KV),
        Field(
            "motor.inductance_d_scale",
            D_INDUCTANCE_SCALE,
            optional=True,
            remark="effective Ld = inductance_d_H + inductance_d_scale min(id, 0)",
        ),
    ),
    write,
    current_loop=lambda bandwidth: (
        Field(
            "servo.pid_dq_hz",
            loop.in_hertz(bandwidth),
            remark="firmware ABI 0x010e or later; before it servo.pid_dq.kp and .ki themselves",
        ),
    ),
)
