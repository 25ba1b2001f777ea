"""SimpleFOC: the motor's constructor."""

from reports.exports import quantities as q
from reports.exports.comments import C, head
from reports.exports.target import Field, Sheet, Target


def write(sheet: Sheet) -> str:
    """Return C++ that makes the motor; Lq stands before Ld."""
    lines = list(head(sheet, C, "SimpleFOC 2.4.0 or later, which takes two inductances"))
    lines.append(
        C.comment("2.3.3 up to 2.3.x takes one, Lq; before 2.3.3 KV was not line-to-line: do not use these figures")
    )
    lines.append("BLDCMotor motor = BLDCMotor(")
    last = len(sheet.lines) - 1
    for index, line in enumerate(sheet.lines):
        lines.append(f"    {line.text}{'' if index == last else ','} {C.comment(f'{line.name}: {line.comment}')}")
    return "\n".join([*lines, ");", ""])


TARGET = Target(
    "simplefoc",
    "SimpleFOC",
    ".h",
    (
        Field("pp", q.POLE_PAIRS),
        Field("R", q.RESISTANCE),
        Field("KV", q.KV),
        Field("Lq", q.Q_INDUCTANCE),
        Field("Ld", q.D_INDUCTANCE),
    ),
    write,
)
