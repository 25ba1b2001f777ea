"""A motor that the dynamometer drives: how fast it may be turned, whether it is, and the voltages that it shows."""

import math
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from drivers.interfaces import DynamometerReading, Reading
from drivers.interfaces.text import Text, text
from procedures.core.bench import Bench, ProcedureError
from procedures.core.nameplate import Nameplate
from procedures.estimation.fitting.fit import FloatArray
from procedures.techniques.steady_signals import alternating

#: A tachometer that differs by more than this share from the speed that was commanded reads something else.
_AGREE = 0.1
#: A dynamometer that holds its speed is off it by less than this share, slip and ripple included.
_HELD = 0.05
#: A motor bears so many times its highest speed for a while (IEC 60034-1, overspeed); a shaft that is faster has run away.
_OVERSPEED = 1.2
#: Periods of a record, if the pole pairs are what is known of them, and the shortest and longest record (s).
_PERIODS, _SHORTEST, _LONGEST = 4.0, 0.02, 4.0


@dataclass(frozen=True)
class DrivenRecord:
    """Voltages (V) of the channels while the shaft is driven, shape (channels, n), and one step of the coarsest channel (V)."""

    voltages: FloatArray
    resolution: float


def check_turning(bench: Bench, read: Reading, commanded: float) -> None:
    """Raise ProcedureError where the tachometer does not read the speed (rad/s) at which the dynamometer drives the shaft."""
    if bench.dynamometer.read_by_hand or abs(read.value - abs(commanded)) <= _AGREE * abs(commanded):
        return
    raise ProcedureError(
        text(
            "the tachometer reads {read:.0f} rpm while the dynamometer drives the shaft at {driven:.0f} rpm: "
            "check that it is aimed at the reflective mark, and that there is only one mark",
            read=read.value * 30.0 / math.pi,
            driven=abs(commanded) * 30.0 / math.pi,
        )
    )


def holds(bench: Bench, read: DynamometerReading, commanded: float) -> bool:
    """Tell whether the dynamometer holds its speed (rad/s); what a person reads is not held against it."""
    return bench.dynamometer.read_by_hand or abs(abs(read.speed) - abs(commanded)) <= _HELD * abs(commanded)


def overspeed(nameplate: Nameplate, read: DynamometerReading) -> Text | None:
    """Return what is said of a shaft that ran away beyond the motor's speed; None where it did not, or the plate names none."""
    bound = nameplate.speed_bound_rpm
    shown = abs(read.speed) * 30.0 / math.pi
    if bound is None or shown <= _OVERSPEED * bound:
        return None
    return text(
        "the shaft ran away to {shown:.0f} rpm, beyond the motor's {bound:.0f} rpm, and everything was switched off",
        shown=shown,
        bound=bound,
    )


def check_held(bench: Bench, readings: Sequence[DynamometerReading], commanded: float) -> None:
    """Raise ProcedureError where the dynamometer did not hold its speed (rad/s) against the motor: it is at its torque limit.

    A torque read then is that limit, and says nothing of the motor.
    """
    farthest = max(readings, key=lambda each: abs(abs(each.speed) - abs(commanded)))
    if holds(bench, farthest, commanded):
        return
    raise ProcedureError(
        text(
            "the dynamometer was to hold {commanded:.0f} rpm, and the shaft turned at {read:.0f} rpm under {torque:.3g} N·m: the motor "
            "takes more than the drive's torque limit. Lower the current or the speed in the procedure's settings, raise the drive's "
            "limit, or use a stronger dynamometer",
            commanded=abs(commanded) * 30.0 / math.pi,
            read=abs(farthest.speed) * 30.0 / math.pi,
            torque=farthest.torque,
        )
    )


def driving_speed_rad(bench: Bench, nameplate: Nameplate, share: float) -> float:
    """Return a speed (rad/s): a share of the rated one, kept within the dynamometer's and the motor's limits.

    Raises ProcedureError where the plate names no rated speed.
    """
    if nameplate.rated_speed_rpm is None:
        raise ProcedureError(
            text("the motor file gives no rated_speed_rpm, so no speed can be chosen; add it under [nameplate]")
        )
    bound = nameplate.speed_bound_rpm or nameplate.rated_speed_rpm
    return min(
        share * nameplate.rated_speed_rpm * math.pi / 30.0, bound * math.pi / 30.0, bench.dynamometer.maximum_speed
    )


def expected_peak(nameplate: Nameplate, share: float) -> float | None:
    """Return about what a phase's peak voltage (V) is at a share of the rated speed; None where the plate names no voltage."""
    rated = nameplate.rated_voltage
    return share * rated / math.sqrt(3.0) if rated else None


def record_driven(
    bench: Bench, nameplate: Nameplate, channels: Sequence[int], share: float, pole_pairs: float | None
) -> DrivenRecord:
    """Return the channels' voltages over some electrical periods, the shaft driven at a share of the rated speed."""
    speed = driving_speed_rad(bench, nameplate, share)
    pairs = pole_pairs or nameplate.pole_pairs or 1
    record_time = min(max(_PERIODS * 2.0 * math.pi / (pairs * speed), _SHORTEST), _LONGEST)
    with bench.dynamometer.driving_speed(speed):
        waves = alternating(bench, channels, 1.5 * (expected_peak(nameplate, share) or 1.0), record_time)
    return DrivenRecord(
        np.vstack([waves[channel].values for channel in channels]), max(wave.resolution for wave in waves.values())
    )
