"""`motorbench analyze`: stored captures, evaluated by the estimators that a run uses."""

from collections.abc import Sequence
from pathlib import Path
from typing import Annotated, Literal

from cyclopts import Parameter

from bench.cli.analyze.record_options import RecordOptions
from bench.cli.analyze.typed import Count, factors_of, seconds_of
from bench.i18n.errors import UsageError
from drivers.interfaces.text import text

_AS_USUAL = RecordOptions()


def back_emf(
    *files: Path,
    connection: Literal["line", "phase", "neutral"] | None = None,
    pole_pairs: Count | None = None,
    speed_rpm: float | None = None,
    speed_uncertainty_rpm: float | None = None,
    speeds: int = 1,
    harmonics: Sequence[int] = (1, 3, 5, 7),
    scale: Sequence[str] = (),
    coupling: Sequence[str] = (),
    temperature: float | None = None,
    temperature_uncertainty: float | None = None,
    magnet_coefficient: float = -0.001,
    full_scale: Sequence[str] = (),
    record: RecordOptions = _AS_USUAL,
) -> int:
    """Fundamental, harmonics, drift and flux linkage of captured back-EMF voltages (§3.4).

    Exit status 0 where every figure is given, 1 where one is withheld, 2 where a file or what was typed cannot be used.

    Parameters
    ----------
    files
        Captures of one record, or of one a speed: R&S RTB, Tektronix TDS or Siglent CSV, columns of time and volts, or HDF5.
    connection
        Where the probes were: between two lines (taken where not given, and channels are not named as phases), phase to an artificial
        star point, or phase to the winding's own.
    pole_pairs
        Pole pairs, for the mechanical constants.
    speed_rpm
        Mechanical speed, rpm, to find the pole pairs by.
    speed_uncertainty_rpm
        Its standard uncertainty, rpm.
    speeds
        At how many speeds the files were recorded: as many files each, those of one record following each other.
    harmonics
        Orders to fit.
    scale
        Factor for a channel, NAME=FACTOR, where a probe's setting was wrong.
    coupling
        dc or ac, of all channels or NAME=dc of one, where the file does not say it; AC coupling cannot be seen in a record.
    temperature
        Temperature of the magnets during the record, °C: flux linkage and constants are then those at 25 °C.
    temperature_uncertainty
        Half-width of what is known of it, K; 2 where not given.
    magnet_coefficient
        Temperature coefficient of the magnets' flux, 1/K.
    full_scale
        Range that a channel was set to, NAME=RANGE, as in CH1=40V: the whole screen, for limits in % of full scale.
    record
        What every capture's command takes.

    """
    from bench.analysis import analyze_back_emf
    from bench.analysis.back_emf_record import read_couplings
    from bench.analysis.temperature import magnet_temperature

    outcome = analyze_back_emf(
        _some(files),
        connection=connection,
        pole_pairs=pole_pairs,
        scale=factors_of(scale),
        speed_rpm=speed_rpm,
        speed_uncertainty_rpm=speed_uncertainty_rpm,
        speeds=speeds,
        coupling=read_couplings(coupling),
        harmonics=harmonics,
        accuracy=record.statements(full_scale),
        selection=record.selection,
        temperature=magnet_temperature(temperature, temperature_uncertainty, magnet_coefficient),
        translate=record.translate,
    )
    return record.print(outcome)


def step_response(
    *files: Path,
    connection: Literal["wye", "delta"] = "wye",
    reading: Literal["line", "series-parallel", "phase"] = "series-parallel",
    axis: Literal["d", "q"] | None = None,
    voltage: str | None = None,
    current: str | None = None,
    scale: Sequence[str] = (),
    temperature: float | None = None,
    temperature_uncertainty: float | None = None,
    copper_coefficient: float = 0.00393,
    skew: float = 0.0,
    full_scale: Sequence[str] = (),
    record: RecordOptions = _AS_USUAL,
) -> int:
    """Resistance and inductance from a recorded voltage step and its current (§3.3.1).

    Exit status 0 where every figure is given, 1 where one is withheld, 2 where a file or what was typed cannot be used.

    Parameters
    ----------
    files
        The capture, or one file for each channel.
    connection
        How the windings are joined.
    reading
        How the step was applied: between two lines, A against B and C together, or phase to star point.
    axis
        Axis in which the rotor was locked.
    voltage
        Name of the voltage's channel, where its unit does not tell.
    current
        Name of the current's channel.
    scale
        Factor for a channel, NAME=FACTOR.
    temperature
        Temperature of the winding during the record, °C: the loop's resistance is then that at 25 °C.
    temperature_uncertainty
        Half-width of what is known of it, K; 2 where not given.
    copper_coefficient
        Temperature coefficient of the winding's resistance at 20 °C, 1/K.
    skew
        Limit of the time by which one channel may be late beside the other, s; at least half a sampling interval counts.
    full_scale
        Range that a channel was set to, NAME=RANGE, as in CH1=40V: the whole screen, for limits in % of full scale.
    record
        What every capture's command takes.

    """
    from bench.analysis import analyze_step_response
    from bench.analysis.temperature import copper_temperature

    outcome = analyze_step_response(
        list(_some(files)),
        connection=connection,
        reading=reading,
        axis=axis,
        voltage=voltage,
        current=current,
        scale=factors_of(scale),
        accuracy=record.statements(full_scale),
        selection=record.selection,
        temperature=copper_temperature(temperature, temperature_uncertainty, copper_coefficient),
        skew=skew,
        translate=record.translate,
    )
    return record.print(outcome)


def coast_down(
    *files: Path,
    inertia: float | None = None,
    inertia_uncertainty: float = 0.0,
    torque: float | None = None,
    speed: str | None = None,
    speed_in_rpm: Annotated[bool | None, Parameter(negative="--speed-in-rad-s")] = None,
    speed_filter: str | None = None,
    torque_filter: str | None = None,
    record: RecordOptions = _AS_USUAL,
) -> int:
    """Friction from a coast-down, and inertia where a driven ramp is there too (§3.5).

    Exit status 0 where every figure is given, 1 where one is withheld, 2 where a file or what was typed cannot be used.

    Parameters
    ----------
    files
        Captures of time and speed, and torque where it was recorded.
    inertia
        Inertia, kg·m², where it is known.
    inertia_uncertainty
        Its standard uncertainty, kg·m².
    torque
        Torque of the driven ramp, N·m, where no column has it.
    speed
        Name of the speed's column.
    speed_in_rpm
        A speed without unit is in rpm, or in rad/s; without either such a speed is refused.
    speed_filter
        Time constant of the filter that the speed went through, as in 20ms.
    torque_filter
        Time constant of the filter that the torque went through, as in 20ms.
    record
        What every capture's command takes.

    """
    from bench.analysis import analyze_coast_down

    outcome = analyze_coast_down(
        _some(files),
        inertia=inertia,
        inertia_uncertainty=inertia_uncertainty,
        torque=torque,
        speed=speed,
        speed_in_rpm=speed_in_rpm,
        speed_filter=seconds_of("--speed-filter", speed_filter),
        torque_filter=seconds_of("--torque-filter", torque_filter),
        accuracy=record.statements(),
        selection=record.selection,
        translate=record.translate,
    )
    return record.print(outcome)


def rotor_sweep(
    file: Path,
    *,
    connection: Literal["wye", "delta"] = "wye",
    pole_pairs: Count | None = None,
    electrical: bool = False,
    inductance: str | None = None,
    threshold: float = 0.10,
    scale: Sequence[str] = (),
    record: RecordOptions = _AS_USUAL,
) -> int:
    """Ld and Lq from line-to-line inductance over the rotor's angle, or over time (§3.3.2).

    Exit status 0 where every figure is given, 1 where one is withheld, 2 where a file or what was typed cannot be used.

    Parameters
    ----------
    file
        Columns of angle (or time) and inductance.
    connection
        How the windings are joined.
    pole_pairs
        Pole pairs; searched where not given.
    electrical
        The angle is electrical, not mechanical.
    inductance
        Name of the inductance's column, where several may be it.
    threshold
        Difference of smallest and largest below which the note speaks of a surface-magnet machine.
    scale
        Factor for a channel, NAME=FACTOR.
    record
        What every capture's command takes.

    """
    from bench.analysis import analyze_rotor_sweep

    outcome = analyze_rotor_sweep(
        file,
        connection=connection,
        pole_pairs=pole_pairs,
        electrical=electrical,
        column=inductance,
        threshold=threshold,
        scale=factors_of(scale),
        accuracy=record.statements(),
        selection=record.selection,
        translate=record.translate,
    )
    return record.print(outcome)


def _some(files: Sequence[Path]) -> Sequence[Path]:
    if not files:
        raise UsageError(text("name at least one file"))
    return files
