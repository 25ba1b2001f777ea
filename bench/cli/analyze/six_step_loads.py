"""`motorbench analyze six-step-loads`: load points of a six-step drive, evaluated by the estimator that a run uses."""

import math
from collections.abc import Sequence
from dataclasses import astuple, dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Literal

from cyclopts import Parameter

from bench.cli.analyze.record_options import RecordOptions
from bench.cli.analyze.typed import Count, factors_of
from bench.i18n.errors import UsageError
from drivers.interfaces.text import text

if TYPE_CHECKING:
    from bench.analysis import TypedEmf, TypedWinding


@Parameter(name="*")
@dataclass(frozen=True)
class WindingOptions:
    """What is known of the drive's winding and switches.

    Parameters
    ----------
    connection
        How the windings are joined; needed with captures.
    winding_resistance
        R_11, ohm: one winding, 1.5 times what is read between two lines of a delta, half of it for a wye. Needed with captures.
    winding_resistance_uncertainty
        Half-width of its uncertainty, ohm. Default: 2 % of it.
    winding_resistance_temperature
        Temperature of the winding at which it holds, °C.
    winding_inductance
        L11 − L12, H. Needed with captures.
    winding_inductance_uncertainty
        Half-width of its uncertainty, H. Default: 5 % of it.
    switch_resistance
        On-resistance of one switch, ohm. Default: fitted, with captures.
    copper_coefficient
        Temperature coefficient of the winding's resistance at 20 °C, 1/K.

    """

    connection: Literal["wye", "delta"] | None = None
    winding_resistance: float | None = None
    winding_resistance_uncertainty: float | None = None
    winding_resistance_temperature: float = 25.0
    winding_inductance: float | None = None
    winding_inductance_uncertainty: float | None = None
    switch_resistance: float | None = None
    copper_coefficient: float = 0.00393

    def typed(self) -> "TypedWinding":
        """Return it for the analysis. Raises UsageError for what no winding has."""
        from bench.analysis import TypedWinding

        _above_zero("--winding-resistance", self.winding_resistance, 1e4)
        _above_zero("--winding-inductance", self.winding_inductance, 100.0)
        _not_negative("--winding-resistance-uncertainty", self.winding_resistance_uncertainty, 1e4)
        _not_negative("--winding-inductance-uncertainty", self.winding_inductance_uncertainty, 100.0)
        _not_negative("--switch-resistance", self.switch_resistance, 1e3)
        _not_negative("--copper-coefficient", self.copper_coefficient, 0.01)
        _celsius("--winding-resistance-temperature", self.winding_resistance_temperature)
        return TypedWinding(*astuple(self))


@Parameter(name="*")
@dataclass(frozen=True)
class EmfOptions:
    """What is known of the EMF and the voltmeter's place, for a table without captures.

    Parameters
    ----------
    line_emf_constant
        k_e at 25 °C: mean EMF between the conducting terminals over mechanical speed, V·s/rad.
    flux_linkage
        Flux linkage at 25 °C, V·s, as `analyze back-emf` gives it, in place of that; with --pole-pairs.
    emf_uncertainty
        Half-width of the uncertainty of either, in its unit. Default: 1 % of it.
    commutation_angle
        Angle by which the bridge commutates early or late at most, electrical degrees: 5 for Hall sensors that are not advanced.
    lead_resistance
        Resistance of both leads between voltmeter and drive, ohm, where the voltage was not read at the drive's own terminals; known
        within 20 %. 0 where it was.
    magnet_coefficient
        Temperature coefficient of the magnets' flux, 1/K.

    """

    line_emf_constant: float | None = None
    flux_linkage: float | None = None
    emf_uncertainty: float | None = None
    commutation_angle: float = 15.0
    lead_resistance: float | None = None
    magnet_coefficient: float = -0.001

    def typed(self) -> "TypedEmf":
        """Return it for the analysis. Raises UsageError for what contradicts itself or no motor has."""
        from bench.analysis import TypedEmf

        if self.line_emf_constant is not None and self.flux_linkage is not None:
            raise UsageError(text("--line-emf-constant and --flux-linkage: give one of them"))
        if self.emf_uncertainty is not None and self.line_emf_constant is None and self.flux_linkage is None:
            raise UsageError(text("--emf-uncertainty: give --line-emf-constant or --flux-linkage too"))
        _above_zero("--line-emf-constant", self.line_emf_constant, 1e3)
        _above_zero("--flux-linkage", self.flux_linkage, 100.0)
        _not_negative("--emf-uncertainty", self.emf_uncertainty, 1e3)
        _not_negative("--commutation-angle", self.commutation_angle, 60.0)
        _not_negative("--lead-resistance", self.lead_resistance, 1e3)
        _not_negative("--magnet-coefficient", -self.magnet_coefficient, 0.01)
        return TypedEmf(
            self.line_emf_constant,
            self.flux_linkage,
            self.emf_uncertainty,
            math.radians(self.commutation_angle),
            self.magnet_coefficient,
            self.lead_resistance,
        )


_WINDING, _EMF, _RECORD = WindingOptions(), EmfOptions(), RecordOptions()


def six_step_loads(
    file: Path,
    *captures: Path,
    column: Annotated[Sequence[str], Parameter(negative=())] = (),
    pole_pairs: Count | None = None,
    electrical: bool = False,
    temperature: float | None = None,
    temperature_after: float | None = None,
    temperature_uncertainty: float = 2.0,
    current: str | None = None,
    scale: Sequence[str] = (),
    full_scale: Sequence[str] = (),
    winding: WindingOptions = _WINDING,
    emf: EmfOptions = _EMF,
    record: RecordOptions = _RECORD,
) -> int:
    """Armature equivalent resistance of a six-step drive, from a table of load points.

    Exit status 0 where every figure is given, 1 where one is withheld, 2 where a file or what was typed cannot be used.

    Parameters
    ----------
    file
        Table with a row for each load: voltage (V) and current (A) of the supply at the drive, speed (rpm or rad/s), torque (Nm, mNm,
        oz-in), temperature of the winding (°C); a frequency (Hz, electrical) of the line's current or the Hall signals, if there is one.
    captures
        A capture of one line's current for each row, in the table's order. They give the EMF constant, the switches, and the parts of the
        resistance.
    column
        A heading that differs, NAME=HEADING. Names: voltage, current, speed, electrical_speed, frequency, torque, temperature.
    pole_pairs
        Pole pairs.
    electrical
        The speed is electrical, not that of the shaft; it is divided by --pole-pairs.
    temperature
        Temperature of the winding before the first load, °C.
    temperature_after
        Temperature of the winding as soon as the motor stands again, °C. Rows without a temperature are between the two.
    temperature_uncertainty
        Half-width of the range within which the temperatures are known, K.
    current
        Name of the captures' channel.
    scale
        Factor for that channel, NAME=FACTOR, as in CH2=10A/V.
    full_scale
        Range that it was set to (the whole screen), NAME=RANGE.

    """
    from bench.analysis import analyze_six_step_loads

    for option, celsius in (("--temperature", temperature), ("--temperature-after", temperature_after)):
        if celsius is not None:
            _celsius(option, celsius)
    _not_negative("--temperature-uncertainty", temperature_uncertainty, 50.0)
    outcome = analyze_six_step_loads(
        file,
        captures,
        mapped=column,
        pole_pairs=pole_pairs,
        electrical=electrical,
        winding=winding.typed(),
        emf=emf.typed(),
        temperature=temperature,
        temperature_after=temperature_after,
        temperature_uncertainty=temperature_uncertainty,
        current=current,
        scale=factors_of(scale),
        **record.arguments(full_scale),
    )
    return record.print(outcome)


def _above_zero(option: str, value: float | None, most: float) -> None:
    if value is not None and not 0.0 < value <= most:
        raise UsageError(
            text(
                "{option} {value:g}: allowed is a number above 0 and up to {most:g}",
                option=option,
                value=value,
                most=most,
            )
        )


def _not_negative(option: str, value: float | None, most: float) -> None:
    if value is not None and not 0.0 <= value <= most:
        raise UsageError(
            text(
                "{option} {value:g}: allowed is a number from 0 to {most:g}",
                option=option,
                value=value,
                most=most,
            )
        )


def _celsius(option: str, value: float) -> None:
    if not -60.0 <= value <= 250.0:
        raise UsageError(
            text("{option} {value:g}: allowed is a temperature from −60 to 250 °C", option=option, value=value)
        )
