"""ODrive: commands for odrivetool, by the property names of firmware 0.5 and of 0.6."""

from collections.abc import Callable, Sequence

from reports.exports import current_loop as loop
from reports.exports import quantities as q
from reports.exports.comments import HASH, head
from reports.exports.target import Field, Sheet, Target


def _writer(firmware: str) -> Callable[[Sheet], str]:
    def write(sheet: Sheet) -> str:
        lines = list(head(sheet, HASH, f"ODrive, firmware {firmware}: paste it into odrivetool"))
        lines += [f"odrv0.{line.name} = {line.text}  {HASH.comment(line.comment)}" for line in sheet.lines]
        return "\n".join([*lines, "# odrv0.save_configuration() keeps them", ""])

    return write


def _fields(motor: str) -> Sequence[Field]:
    return (
        Field(f"{motor}.pole_pairs", q.POLE_PAIRS),
        Field(f"{motor}.phase_resistance", q.RESISTANCE),
        Field(f"{motor}.phase_inductance", q.MEAN_INDUCTANCE),
        Field(f"{motor}.torque_constant", q.TORQUE_CONSTANT),
    )


def _loop_of(motor: str) -> Callable[[float], Sequence[Field]]:
    return lambda bandwidth: (Field(f"{motor}.current_control_bandwidth", loop.in_radians(bandwidth)),)


def _target(name: str, firmware: str, motor: str) -> Target:
    return Target(name, f"ODrive {firmware}", ".py", _fields(motor), _writer(firmware), current_loop=_loop_of(motor))


TARGET = _target("odrive", "0.5", "axis0.motor.config")
TARGET_06 = _target("odrive-0.6", "0.6", "axis0.config.motor")
