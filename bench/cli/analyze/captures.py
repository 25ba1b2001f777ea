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
#: rpm at which a cogging torque can still be told from the stand's own vibrations.
_FASTEST = 1000.0


def back_emf(
    *files: Path,
    connection: Literal["line", "phase", "neutral", "ends"] | None = None,
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
        The captures of one record, or of one record for each speed: R&S RTB, Tektronix TDS or Siglent CSV, CSV columns of time
        and volts, or HDF5.
    connection
        Where the probes were: line (between two terminals), phase (to an artificial star point), neutral (to the winding's
        own star point) or ends (two probes on the two ends of one line, ground not on the motor: their difference counts).
        Default: line for one or two channels; three say it by their names (Uab, Van) or need this option.
    pole_pairs
        Pole pairs, for the mechanical constants.
    speed_rpm
        Mechanical speed, rpm. The pole pairs are found from it.
    speed_uncertainty_rpm
        Its standard uncertainty, rpm.
    speeds
        Number of speeds at which the files were recorded. Each speed has the same number of files; give the files of one record
        next to each other.
    harmonics
        Orders to fit.
    scale
        Factor for a channel, NAME=FACTOR, where a probe's setting was wrong.
    coupling
        Coupling of the channels, if the file does not state it: dc or ac for all, NAME=dc or NAME=ac for one. AC coupling
        cannot be seen in a record.
    temperature
        Temperature of the magnets during the record, °C. Flux linkage and constants are then referred to 25 °C.
    temperature_uncertainty
        Half-width of the range within which this temperature is known, K. Default: 2.
    magnet_coefficient
        Temperature coefficient of the magnets' flux, 1/K.
    full_scale
        Range that a channel was set to (the whole screen), NAME=RANGE, as in CH1=40V. It is needed for limits in % of full
        scale.
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
        Name of the voltage channel, if its unit does not identify it.
    current
        Name of the current's channel.
    scale
        Factor for a channel, NAME=FACTOR.
    temperature
        Temperature of the winding during the record, °C. The loop's resistance is then referred to 25 °C.
    temperature_uncertainty
        Half-width of the range within which this temperature is known, K. Default: 2.
    copper_coefficient
        Temperature coefficient of the winding's resistance at 20 °C, 1/K.
    skew
        Largest delay between the two channels, s. At least half a sampling interval is assumed.
    full_scale
        Range that a channel was set to (the whole screen), NAME=RANGE, as in CH1=40V. It is needed for limits in % of full
        scale.
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
    record
        What every capture's command takes.

    """
    from bench.analysis import analyze_coast_down

    outcome = analyze_coast_down(
        _some(files),
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
        accuracy=record.statements(),
        selection=record.selection,
        translate=record.translate,
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
    record
        What every capture's command takes.

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
        _some(files),
        order=order,
        pole_pairs=pole_pairs,
        speed_rpm=speed_rpm,
        averaging=seconds_of("--averaging", averaging),
        torque_filter=seconds_of("--torque-filter", torque_filter),
        accuracy=record.statements(),
        selection=record.selection,
        translate=record.translate,
    )
    return record.print(outcome)


def four_wire(
    *files: Path,
    connection: Literal["wye", "delta"] = "wye",
    reading: Literal["line", "series-parallel", "phase"] = "line",
    voltage: str | None = None,
    current: str | None = None,
    scale: Sequence[str] = (),
    temperature: float | None = None,
    temperature_uncertainty: float | None = None,
    copper_coefficient: float = 0.00393,
    full_scale: Sequence[str] = (),
    record: RecordOptions = _AS_USUAL,
) -> int:
    """Stator resistance from four-wire readings of both polarities (§3.2).

    Exit status 0 where every figure is given, 1 where one is withheld, 2 where a file or what was typed cannot be used.

    Parameters
    ----------
    files
        Columns of current and voltage, row by row as they were read, with currents of both signs. Three lines are three files,
        or three columns of voltage.
    connection
        How the windings are joined.
    reading
        Where a single line was read: between two lines, from one line to the other two joined, or to the star point.
    voltage
        Name of the voltage channel, if its unit does not identify it.
    current
        Name of the current's channel.
    scale
        Factor for a channel, NAME=FACTOR.
    temperature
        Temperature of the winding, °C. The resistance is then referred to 25 °C.
    temperature_uncertainty
        Half-width of the range within which this temperature is known, K. Default: 2.
    copper_coefficient
        Temperature coefficient of the winding's resistance at 20 °C, 1/K.
    full_scale
        Range that a channel was set to (the whole screen), NAME=RANGE, as in CH1=40V. It is needed for limits in % of full
        scale.
    record
        What every capture's command takes.

    """
    from bench.analysis import analyze_four_wire
    from bench.analysis.temperature import copper_temperature

    outcome = analyze_four_wire(
        _some(files),
        connection=connection,
        reading=reading,
        voltage=voltage,
        current=current,
        scale=factors_of(scale),
        accuracy=record.statements(full_scale),
        selection=record.selection,
        temperature=copper_temperature(temperature, temperature_uncertainty, copper_coefficient),
        translate=record.translate,
    )
    return record.print(outcome)


def rotor_sweep(
    file: Path,
    *,
    connection: Literal["wye", "delta"] = "wye",
    reading: Literal["line", "series-parallel"] = "line",
    pole_pairs: Count | None = None,
    electrical: bool = False,
    inductance: str | None = None,
    frequency: float | None = None,
    threshold: float = 0.10,
    scale: Sequence[str] = (),
    record: RecordOptions = _AS_USUAL,
) -> int:
    """Ld and Lq from inductance over the rotor's angle, or over time (§3.3.2).

    Exit status 0 where every figure is given, 1 where one is withheld, 2 where a file or what was typed cannot be used.

    Parameters
    ----------
    file
        Columns of angle (or time) and inductance.
    connection
        How the windings are joined.
    reading
        Where the meter was: between two lines, or from one line to the other two joined.
    pole_pairs
        Pole pairs; searched where not given.
    electrical
        The angle is electrical, not mechanical.
    inductance
        Name of the inductance's column, where several may be it.
    frequency
        Test frequency of the bridge, Hz: chooses the rows of a table that has several, and converts Lp with Rp.
    threshold
        Difference between smallest and largest inductance below which the note calls the motor a surface-magnet machine.
    scale
        Factor for a channel, NAME=FACTOR.
    record
        What every capture's command takes.

    """
    from bench.analysis import analyze_rotor_sweep

    if not 0.0 < threshold < 10.0:
        raise UsageError(
            text(
                "--threshold {threshold:g}: a value above 0 and below 10 is needed, as in 0.1 for 10 %",
                threshold=threshold,
            )
        )
    if frequency is not None and not 0.0 < frequency < 1e8:
        raise UsageError(
            text("--frequency {frequency:g}: a frequency above 0 Hz is needed, as in 1000", frequency=frequency)
        )
    outcome = analyze_rotor_sweep(
        file,
        connection=connection,
        reading=reading,
        pole_pairs=pole_pairs,
        electrical=electrical,
        column=inductance,
        frequency=frequency,
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
