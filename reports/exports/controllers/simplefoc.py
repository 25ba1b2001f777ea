"""SimpleFOC: the motor's constructor."""

from reports.exports import current_loop as loop
from reports.exports import quantities as q
from reports.exports.comments import C, head
from reports.exports.target import Field, Sheet, Target

_LOOP = "PID_current_"


def write(sheet: Sheet) -> str:
    """Return C++ that makes the motor; Lq stands before Ld."""
    lines = list(head(sheet, C, "SimpleFOC 2.4.0 or later, which takes two inductances"))
    lines.append(
        C.comment("2.3.3 up to 2.3.x takes one, Lq; before 2.3.3 KV was not line-to-line: do not use these figures")
    )
    lines.append("BLDCMotor motor = BLDCMotor(")
    motor = [line for line in sheet.lines if not line.name.startswith(_LOOP)]
    last = len(motor) - 1
    for index, line in enumerate(motor):
        lines.append(f"    {line.text}{'' if index == last else ','} {C.comment(f'{line.name}: {line.comment}')}")
    lines.append(");")
    gains = [line for line in sheet.lines if line.name.startswith(_LOOP)]
    if gains:
        lines += [
            "",
            C.comment("call it in setup(), after the torque controller is chosen"),
            "inline void set_current_loop() {",
        ]
        lines += [f"    motor.{line.name} = {line.text}; {C.comment(line.comment)}" for line in gains]
        lines.append("}")
    return "\n".join([*lines, ""])


def _current_loop(bandwidth: float) -> tuple[Field, ...]:
    return (
        Field(f"{_LOOP}q.P", loop.proportional_q(bandwidth)),
        Field(f"{_LOOP}q.I", loop.integral(bandwidth)),
        Field(f"{_LOOP}d.P", loop.proportional_d(bandwidth)),
        Field(f"{_LOOP}d.I", loop.integral(bandwidth)),
    )


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
    current_loop=_current_loop,
)
