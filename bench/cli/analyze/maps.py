"""`motorbench analyze flux-map`, `short-circuit` and `efficiency`: tables that others measured."""

import sys
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any, Literal

from bench.cli.analyze.output import print_analysis, print_sentences
from bench.cli.analyze.typed import Count
from bench.cli.options import Json, Language
from bench.i18n.errors import UsageError
from bench.i18n.language import language_of, translator
from drivers.interfaces.text import Text, Translate, text, word


def flux_map(
    file: Path,
    *,
    column: Sequence[str] = (),
    pole_pairs: Count | None = None,
    voltage: float | None = None,
    current: float | None = None,
    resistance: float = 0.0,
    voltage_gain: float = 0.0,
    current_gain: float = 0.0,
    angle_from: Literal["q", "q-to-d", "d"] | None = None,
    flux_linkage: float | None = None,
    u_flux_linkage: float = 0.0,
    standstill: bool = False,
    output: Path | None = None,
    force: bool = False,
    language: Language = "auto",
    json: Json = False,
) -> int:
    """Inductances, MTPA and torque over speed of a table of flux linkages, with intervals; what contradicts itself in it is said.

    Exit status 0 where every figure is given, 1 where the table contradicts itself, 2 where a file or what was typed cannot be used.

    Parameters
    ----------
    file
        Table with the headings id_A, iq_A, psi_d_Vs, psi_q_Vs and, if known, u_psi_d_Vs, u_psi_q_Vs, torque_Nm; peak values.
        In place of the currents: current_A and gamma_deg. In place of the flux linkages: ld_H, lq_H, the apparent inductances,
        and psi_m_Vs (or --flux-linkage), if known with u_ld_H, u_lq_H, u_psi_m_Vs. Or the folder of a run of flux-map or
        flux-map-standstill, complete or not: the map is made of the readings that it has.
    column
        A heading that differs from these, NAME=HEADING. Names: i_d, i_q, psi_d, psi_q, u_psi_d, u_psi_q, torque, current, angle, l_d, l_q,
        flux_linkage, u_l_d, u_l_q, u_flux_linkage.
    pole_pairs
        Pole pairs, for torque. Default with a run's folder: those of the run.
    voltage
        Limit of the phase voltage, V, peak (bus voltage over √3), for torque over speed.
    current
        Largest current, A, peak. Default: the largest of the table.
    resistance
        Phase resistance, Ω, for torque over speed.
    voltage_gain
        Limit of error of all voltages, %, rectangular.
    current_gain
        Limit of error of all currents, %, rectangular.
    angle_from
        Of currents by amount and angle: q counts the angle from q towards −d, q-to-d from q towards d, d from d towards q.
    flux_linkage
        For a table of inductances without a column of it: the magnets' flux linkage, V·s, peak; 0 without magnets.
    u_flux_linkage
        Its standard uncertainty, V·s.
    standstill
        With the folder of a run that has both maps: the one of flux-map-standstill.
    output
        With a run's folder: the file to write the map to, in the form of flux_map.csv of a finished run.
    force
        Overwrite that file.

    """
    from bench.analysis.load_tables import analyze_flux_map, analyze_run_map
    from bench.cli.new_file import write_new
    from bench.journal.run_tables import table_content
    from procedures.estimation.flux.flux_map import GainLimits

    translate = translator(language_of(language))
    _above_zero({"--voltage": voltage, "--current": current})
    loss = _not_negative("--resistance", resistance)
    gains = GainLimits(_percent("--voltage-gain", voltage_gain), _percent("--current-gain", current_gain))
    if file.is_dir():
        if column or gains != GainLimits() or angle_from is not None or flux_linkage is not None:
            raise UsageError(
                text(
                    "{path}: a run names its columns and its gains itself; leave out --column, the gains, --angle-from and --flux-linkage",
                    path=str(file),
                )
            )
        made, table = analyze_run_map(
            file, pole_pairs=pole_pairs, voltage=voltage, current=current, resistance=loss, standstill=standstill,
            translate=translate,
        )  # fmt: skip
        if output is not None:
            write_new(output, table_content(table), force=force)
    elif output is not None or standstill:
        option = "--standstill" if output is None else "--output"
        raise UsageError(
            text(
                "{option}: {path} is a table already; name a run's folder, or leave it out",
                option=option,
                path=str(file),
            )
        )
    else:
        made = analyze_flux_map(
            file,
            mapped=column,
            pole_pairs=pole_pairs,
            voltage=voltage,
            current=current,
            resistance=loss,
            gains=gains,
            angle_from=angle_from,
            flux_linkage=None if flux_linkage is None else _not_negative("--flux-linkage", flux_linkage),
            u_flux_linkage=_not_negative("--u-flux-linkage", u_flux_linkage),
            translate=translate,
        )
    status = print_analysis(made, translate, json=json, budget=False)
    if not json:
        _print_rows(
            made["details"].get("mtpa", ()), translate,
            (("A", "current", 1.0), (text("MTPA, °"), "angle_degrees", 1.0), ("N·m", "torque", 1.0), ("i_d, A", "i_d", 1.0),
             ("i_q, A", "i_q", 1.0)),
        )  # fmt: skip
        _print_rows(
            made["details"].get("largest_torque", ()), translate,
            ((text("electrical, rad/s"), "electrical_speed", 1.0), (text("largest N·m"), "torque", 1.0), ("i_d, A", "i_d", 1.0),
             ("i_q, A", "i_q", 1.0), (text("limit"), "limit", 1.0)),
        )  # fmt: skip
    return status


def short_circuit(
    file: Path,
    *,
    pole_pairs: Count,
    column: Sequence[str] = (),
    flux_linkage: float | None = None,
    u_flux_linkage: float | None = None,
    electrical: bool = False,
    rms: bool = False,
    current_gain: float | None = None,
    unbalance: float | None = None,
    speed_gain: float | None = None,
    torque_gain: float | None = None,
    torque_zero: float | None = None,
    saturation: float | None = None,
    language: Language = "auto",
    json: Json = False,
) -> int:
    """Inductances, resistance and braking torque of a motor turned with its terminals shorted.

    Exit status 0 where every figure is given, 1 where the table contradicts itself, 2 where a file or what was typed cannot be used.

    Parameters
    ----------
    file
        Table with the headings speed (in rpm or rad/s), current_A (peak) and, if known, torque_Nm and friction_Nm. Instead of
        current_A: ia_A, ib_A, ic_A, the currents of three phases.
    pole_pairs
        Pole pairs.
    column
        A heading that differs from these, NAME=HEADING. Names: speed, current, current_a, current_b, current_c, torque, friction.
    flux_linkage
        Flux linkage of the open circuit at the same magnet temperature, V·s, peak.
    u_flux_linkage
        Its standard uncertainty, V·s. Default: 1 % of it.
    electrical
        The speeds are electrical.
    rms
        The currents are rms.
    current_gain
        Limit of error of all currents, %, rectangular. Default: 2, a current clamp with its oscilloscope.
    unbalance
        Limit of what the current of the phase that was probed differs from the mean of three, %. Default: 3; 0 with three phases.
    speed_gain
        Limit of error of the speeds, %. Default: 1, a drive's display.
    torque_gain
        Limit of error of the torques, %. Default: 0.5.
    torque_zero
        Limit of the torque's zero, N·m. Default: 0.5 % of the largest torque.
    saturation
        Limit of what L_q is off because inductances depend on the current, %. Default: 40; 0 for a motor that does not saturate.

    """
    from bench.analysis.short_circuit import LimitsOfTable, analyze_short_circuit

    translate = translator(language_of(language))
    _above_zero({"--flux-linkage": flux_linkage})
    stated = LimitsOfTable(
        current=_percent_or_none("--current-gain", current_gain),
        unbalance=_percent_or_none("--unbalance", unbalance),
        speed=_percent_or_none("--speed-gain", speed_gain),
        torque=_percent_or_none("--torque-gain", torque_gain),
        torque_zero=None if torque_zero is None else _not_negative("--torque-zero", torque_zero),
        saturation=_percent_or_none("--saturation", saturation),
    )
    known = None if u_flux_linkage is None else _not_negative("--u-flux-linkage", u_flux_linkage)
    outcome = analyze_short_circuit(
        file, mapped=column, pole_pairs=pole_pairs, flux_linkage=flux_linkage,
        u_flux_linkage=known, electrical=electrical, rms=rms, stated=stated,
        translate=translate,
    )  # fmt: skip
    return print_analysis(outcome, translate, json=json, budget=False)


def efficiency(
    file: Path,
    *,
    column: Sequence[str] = (),
    torque_gain: float = 0.0,
    torque_zero: float = 0.0,
    speed_gain: float = 0.0,
    power_gain: float = 0.0,
    language: Language = "auto",
    json: Json = False,
) -> int:
    """Efficiency and loss of a table of load points, with intervals by what the instruments share.

    Parameters
    ----------
    file
        Table with the headings torque_Nm, speed (in rpm or rad/s) and power_W (into the terminals).
    column
        A heading that differs from these, NAME=HEADING. Names: torque, speed, power.
    torque_gain
        Limit of error of the torque, %, rectangular, the same in all rows.
    torque_zero
        Limit of its zero, N·m.
    speed_gain
        Limit of error of the speed, %.
    power_gain
        Limit of error of the power, %.

    """
    from bench.analysis.efficiency_table import analyze_efficiency
    from drivers.interfaces import Accuracy

    translate = translator(language_of(language))
    accuracies = {
        "torque": Accuracy(
            gain=_percent("--torque-gain", torque_gain),
            offset=_not_negative("--torque-zero", torque_zero),
            source="as stated",
        ),
        "speed": Accuracy(gain=_percent("--speed-gain", speed_gain), source="as stated"),
        "power": Accuracy(gain=_percent("--power-gain", power_gain), source="as stated"),
    }
    outcome = analyze_efficiency(file, mapped=column, accuracies=accuracies, translate=translate)
    if json:
        return print_analysis(outcome, translate, json=True, budget=False)
    rows = [row for row in outcome["details"]["load_points"] if "refused" not in row]
    _print_rows(
        rows, translate,
        (("N·m", "torque", 1.0), ("rad/s", "speed", 1.0), (text("efficiency, %"), "efficiency", 100.0), (text("loss, W"), "loss", 1.0)),
    )  # fmt: skip
    print_sentences(outcome, translate)
    return 0


def _print_rows(
    rows: Sequence[Mapping[str, Any]], translate: Translate, columns: Sequence[tuple[Text | str, str, float]]
) -> None:
    if not rows:
        return
    from rich import box
    from rich.table import Table

    from bench.run.console import console_on

    table = Table(box=box.SIMPLE_HEAD, pad_edge=False)
    for head, _, _ in columns:
        table.add_column(word(head).render(translate), justify="right", no_wrap=True)
    for row in rows:
        table.add_row(*(_cell(row[name], factor) for _, name, factor in columns))
    console_on(sys.stdout).print(table)


def _cell(value: Any, factor: float) -> str:
    if value is None:
        return "–"
    if isinstance(value, str):
        return value
    if isinstance(value, Mapping):
        low, high = (factor * end for end in value["coverage_interval"])
        # Where no error was stated there is no interval, not one of no width.
        return f"{factor * value['value']:.4g}" + (f" ± {0.5 * (high - low):.2g}" if high > low else "")
    return f"{factor * value:.4g}"


def _percent(option: str, value: float) -> float:
    if not 0.0 <= value <= 50.0:
        raise UsageError(text("{option} {value:g}: a limit from 0 to 50 % is allowed", option=option, value=value))
    return value / 100.0


def _percent_or_none(option: str, value: float | None) -> float | None:
    return None if value is None else _percent(option, value)


def _not_negative(option: str, value: float) -> float:
    if not 0.0 <= value < 1e9:
        raise UsageError(text("{option} {value:g}: a value from 0 to below 1e9 is allowed", option=option, value=value))
    return value


def _above_zero(options: Mapping[str, float | None]) -> None:
    for option, value in options.items():
        if value is not None and not 0.0 < value < 1e9:
            raise UsageError(
                text("{option} {value:g}: a value above 0 and below 1e9 is needed", option=option, value=value)
            )
