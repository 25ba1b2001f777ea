"""`motorbench analyze coast-down` and `cogging`: stored records of a turning shaft, evaluated by the estimators that a run uses."""

from collections.abc import Sequence
from pathlib import Path
from typing import Annotated

from cyclopts import Parameter

from bench.cli.analyze.record_options import RecordOptions, some
from bench.cli.analyze.typed import Count, seconds_of
from bench.i18n.errors import UsageError
from drivers.interfaces.text import text

_AS_USUAL = RecordOptions()
#: rpm at which a cogging torque can still be told from the stand's own vibrations.
_FASTEST = 1000.0


def coast_down(
    *files: Path,
    inertia: float | None = None,
    inertia_uncertainty: float = 0.0,
    torque: float | None = None,
    at_speed: Sequence[float] = (),
    speed: str | None = None,
    speed_in_rpm: Annotated[bool | None, Parameter(negative="--speed-in-rad-s")] = None,
    electrical: bool = False,
    pole_pairs: Count | None = None,
    speed_filter: str | None = None,
    torque_filter: str | None = None,
    record: RecordOptions = _AS_USUAL,
) -> int:
    """Friction from a coast-down, and inertia where a driven ramp is there too (§3.5).

    Exit status 0 where every figure is given, 1 where one is withheld, 2 where a file or what was typed cannot be used.

    Parameters
    ----------
    files
        Captures of time and speed, with torque if it was recorded.
    inertia
        Inertia, kg·m², where it is known.
    inertia_uncertainty
        Its standard uncertainty, kg·m².
    torque
        Torque of the driven ramp, N·m, if no column gives it.
    at_speed
        Speed, rpm, at which the deceleration is given. Default: 25, 50 and 75 % of the top speed.
    speed
        Name of the speed's column.
    speed_in_rpm
        Unit of a speed column that states none: rpm or rad/s. Without this option such a column is refused.
    electrical
        The speeds are electrical, as an ERPM is. A column that is called so needs no option.
    pole_pairs
        Pole pairs, by which an electrical speed is divided.
    speed_filter
        Time constant of the filter in the speed signal, as in 20ms.
    torque_filter
        Time constant of the filter in the torque signal, as in 20ms.

    """
    from bench.analysis import analyze_coast_down

    outcome = analyze_coast_down(
        some(files),
        inertia=inertia,
        inertia_uncertainty=inertia_uncertainty,
        torque=torque,
        at_speed=at_speed,
        speed=speed,
        speed_in_rpm=speed_in_rpm,
        electrical=electrical,
        pole_pairs=pole_pairs,
        speed_filter=seconds_of("--speed-filter", speed_filter),
        torque_filter=seconds_of("--torque-filter", torque_filter),
        **record.arguments(),
    )
    return record.print(outcome)


def cogging(
    *files: Path,
    order: int | None = None,
    pole_pairs: Count | None = None,
    speed_rpm: float | None = None,
    averaging: str = "20ms",
    torque_filter: str | None = None,
    record: RecordOptions = _AS_USUAL,
) -> int:
    """Cogging torque, peak to peak, of an open motor that is turned slowly.

    Exit status 0 where every figure is given, 1 where one is withheld, 2 where a file or what was typed cannot be used.

    Parameters
    ----------
    files
        Torque over the shaft's angle, or over time with a column of angle or speed. A second file is a record at half the speed.
    order
        Periods of the cogging a turn, where known: the least common multiple of slots and poles. Some periods then suffice;
        otherwise whole turns are needed, best two.
    pole_pairs
        Pole pairs: orders below twice their number are no cogging.
    speed_rpm
        Speed of the shaft, rpm, where no column tells angle or speed.
    averaging
        Time over which the torque transducer averages at most, as in 20ms.
    torque_filter
        Time constant of the filter in the torque signal, as in 20ms.

    """
    from bench.analysis import analyze_cogging

    if order is not None and not 2 <= order <= 10_000:
        raise UsageError(text("--order {order}: allowed is a whole number from 2 to 10000", order=order))
    if speed_rpm is not None and not 0.0 < speed_rpm <= _FASTEST:
        raise UsageError(
            text(
                "--speed-rpm {speed:g}: allowed is a number above 0 and up to {most:g}", speed=speed_rpm, most=_FASTEST
            )
        )
    outcome = analyze_cogging(
        some(files),
        order=order,
        pole_pairs=pole_pairs,
        speed_rpm=speed_rpm,
        averaging=seconds_of("--averaging", averaging),
        torque_filter=seconds_of("--torque-filter", torque_filter),
        **record.arguments(),
    )
    return record.print(outcome)
