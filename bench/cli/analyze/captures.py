"""`motorbench analyze`: stored captures of voltage, current and inductance, evaluated by the estimators that a run uses."""

from collections.abc import Sequence
from pathlib import Path
from typing import Literal

from bench.cli.analyze.record_options import LoopOptions, RecordOptions, some
from bench.cli.analyze.typed import Count, factors_of
from bench.i18n.errors import UsageError
from drivers.interfaces.text import text

_AS_USUAL = RecordOptions()
_LOOP = LoopOptions()


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

    """
    from bench.analysis import analyze_back_emf
    from bench.analysis.back_emf_record import read_couplings
    from bench.analysis.temperature import magnet_temperature

    outcome = analyze_back_emf(
        some(files),
        connection=connection,
        pole_pairs=pole_pairs,
        scale=factors_of(scale),
        speed_rpm=speed_rpm,
        speed_uncertainty_rpm=speed_uncertainty_rpm,
        speeds=speeds,
        coupling=read_couplings(coupling),
        harmonics=harmonics,
        temperature=magnet_temperature(temperature, temperature_uncertainty, magnet_coefficient),
        **record.arguments(full_scale),
    )
    return record.print(outcome)


def step_response(
    *files: Path,
    reading: Literal["line", "series-parallel", "phase"] = "series-parallel",
    axis: Literal["d", "q"] | None = None,
    skew: float = 0.0,
    loop: LoopOptions = _LOOP,
    record: RecordOptions = _AS_USUAL,
) -> int:
    """Resistance and inductance from a recorded voltage step and its current (§3.3.1).

    Exit status 0 where every figure is given, 1 where one is withheld, 2 where a file or what was typed cannot be used.

    Parameters
    ----------
    files
        The capture, or one file for each channel.
    reading
        How the step was applied: between two lines, A against B and C together, or phase to star point.
    axis
        Axis in which the rotor was locked.
    skew
        Largest delay between the two channels, s. At least half a sampling interval is assumed.

    """
    from bench.analysis import analyze_step_response

    outcome = analyze_step_response(list(some(files)), reading=reading, axis=axis, skew=skew, **loop.arguments(record))
    return record.print(outcome)


def four_wire(
    *files: Path,
    reading: Literal["line", "series-parallel", "phase"] = "line",
    loop: LoopOptions = _LOOP,
    record: RecordOptions = _AS_USUAL,
) -> int:
    """Stator resistance from four-wire readings of both polarities (§3.2).

    Exit status 0 where every figure is given, 1 where one is withheld, 2 where a file or what was typed cannot be used.

    Parameters
    ----------
    files
        Columns of current and voltage, row by row as they were read, with currents of both signs. Three lines are three files,
        or three columns of voltage.
    reading
        Where a single line was read: between two lines, from one line to the other two joined, or to the star point.

    """
    from bench.analysis import analyze_four_wire

    outcome = analyze_four_wire(some(files), reading=reading, **loop.arguments(record))
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
        **record.arguments(),
    )
    return record.print(outcome)
