"""VESC: a motor configuration for VESC Tool, which takes over the fields it finds and leaves the others."""

from reports.exports import current_loop as loop
from reports.exports import quantities as q
from reports.exports.comments import XML, head
from reports.exports.target import Field, Sheet, Target


def write(sheet: Sheet) -> str:
    """Return the XML of an MCConfiguration."""
    lines = ['<?xml version="1.0" encoding="UTF-8"?>', "<MCConfiguration>"]
    lines += [f"    {line}" for line in head(sheet, XML, "VESC motor configuration: load it as XML in VESC Tool")]
    for line in sheet.lines:
        lines.append(f"    <{line.name}>{line.text}</{line.name}> {XML.comment(line.comment)}")
    return "\n".join([*lines, "</MCConfiguration>", ""])


def _current_loop(bandwidth: float) -> tuple[Field, ...]:
    # The gains follow from what L is, not from what the detection would store of it.
    return (
        Field("foc_current_kp", loop.proportional_mean(bandwidth)),
        Field("foc_current_ki", loop.integral(bandwidth)),
    )


TARGET = Target(
    "vesc",
    "VESC mcconf XML",
    ".xml",
    (
        Field("foc_motor_r", q.RESISTANCE),
        Field("foc_motor_l", q.MEAN_INDUCTANCE, remark="VESC's own detection would store 0.9 of it"),
        Field("foc_motor_ld_lq_diff", q.INDUCTANCE_DIFFERENCE, remark="despite its name"),
        Field("foc_motor_flux_linkage", q.FLUX_LINKAGE),
        Field("si_motor_poles", q.POLES),
        Field("foc_temp_comp_base_temp", q.RESISTANCE_TEMPERATURE),
    ),
    write,
    current_loop=_current_loop,
    as_detected=(
        Field("foc_motor_l", q.VESC_MEAN_INDUCTANCE),
        Field("foc_motor_ld_lq_diff", q.VESC_INDUCTANCE_DIFFERENCE, remark="despite its name"),
    ),
)
