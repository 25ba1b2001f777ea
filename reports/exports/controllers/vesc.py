"""VESC: a motor configuration for VESC Tool, which takes over the fields it finds and leaves the others."""

from collections.abc import Iterator

from reports.exports import current_loop as loop
from reports.exports import quantities as q
from reports.exports.comments import XML, head
from reports.exports.exported_map import ExportedMap
from reports.exports.saturation_factor import SATURATION_FACTOR, SATURATION_MODE, saturation_factor
from reports.exports.target import Field, Sheet, Target

_FACTOR = "foc_sat_comp"


def write(sheet: Sheet) -> str:
    """Return the XML of an MCConfiguration."""
    lines = ['<?xml version="1.0" encoding="UTF-8"?>', "<MCConfiguration>"]
    lines += [f"    {line}" for line in head(sheet, XML, "VESC motor configuration: load it as XML in VESC Tool")]
    for line in sheet.lines:
        lines.append(f"    <{line.name}>{line.text}</{line.name}> {XML.comment(line.comment)}")
        if line.name == _FACTOR and sheet.subject.flux_map is not None:
            lines += [f"    {XML.comment(words)}" for words in _about_factor(sheet.subject.flux_map)]
    return "\n".join([*lines, "</MCConfiguration>", ""])


def _about_factor(found: ExportedMap) -> Iterator[str]:
    # The current limit is not written: a file must not raise what someone has set for the rest of the drive.
    if fit := saturation_factor(found):
        yield (
            f"{_FACTOR} belongs to l_current_max = {fit.largest_current:.6g} A; "
            f"for another limit set {fit.factor / fit.largest_current:.6g} times the limit in A"
        )
        yield (
            f"largest error of the observer's angle at id = 0: {fit.angle_without:.2f} deg without it, {fit.angle_with:.2f} deg with it; "
            "choose an observer with lambda compensation, for the flux linkage falls less than L does"
        )


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
        Field("foc_sat_comp_mode", SATURATION_MODE, optional=True),
        Field(_FACTOR, SATURATION_FACTOR, optional=True),
    ),
    write,
    current_loop=_current_loop,
    as_detected=(
        Field("foc_motor_l", q.VESC_MEAN_INDUCTANCE),
        Field("foc_motor_ld_lq_diff", q.VESC_INDUCTANCE_DIFFERENCE, remark="despite its name"),
    ),
)
