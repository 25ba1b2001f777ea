"""`motorbench run`: procedures on a station or on the virtual bench."""

import sys
from collections.abc import Sequence
from dataclasses import replace
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

from cyclopts import Parameter

from bench.cli.options import Json, Language, Seed
from bench.cli.output import print_end, print_json, print_next_steps, print_summary, say_broken, say_missing
from bench.i18n.errors import UsageError
from bench.i18n.language import language_of, translator
from bench.journal.run_folder import existing_run_folder
from bench.motor.motor_file import MotorFile, load_motor
from bench.plugins.catalogues import Catalogues, installed
from bench.run.console import console_on
from bench.run.request import RunRequest
from bench.run.run import run as run_session
from bench.station.station_file import VIRTUAL, catalogues_at, load_station
from drivers.interfaces.text import text

if TYPE_CHECKING:
    from bench.virtual.fault_file import GivenFault


def run(
    *procedures: str,
    station: str | None = None,
    motor: str | None = None,
    operator: str = "",
    person: str = "",
    serial_number: str = "",
    answers: Path | None = None,
    set_: Annotated[tuple[str, ...], Parameter(name="--set")] = (),
    language: Language = "auto",
    json: Json = False,
    resume: str | None = None,
    repeat: tuple[str, ...] = (),
    trace: bool = False,
    record: Path | None = None,
    seed: Seed | None = None,
    faults: Path | None = None,
    fault: tuple[str, ...] = (),
    disturbances: Path | None = None,
    probe_verification: str = "",
    probe: tuple[str, ...] = (),
    runs: Path = Path("runs"),
    continue_on_error: bool = False,
    rehearse: bool = False,
) -> int:
    """Run procedures one after the other and print what they found.

    Exit status 0 for a run that completed and gave what it measured, 1 where it did not complete or a figure is withheld.

    Parameters
    ----------
    procedures
        Names as `motorbench procedures` lists them, or `all`.
    station
        A station file, or `virtual`.
    motor
        A motor file, or the name of a shipped motor.
    operator
        Who does the manual work: terminal (a person), panel (a person at the web panel), virtual (simulated hands), answers
        (readings from a file), fixture (the station's switch matrix and rotor actuator).
    person
        Name of the person who runs it, for the record.
    serial_number
        The motor's serial number; it replaces the one in the motor file.
    answers
        TOML file of readings and commands for `--operator answers`.
    set_
        A setting, `name=value` or `procedure.name=value`; may be given several times.
    resume
        Continue this run at its first unfinished procedure. Give the run's folder, its name under `--runs`, or `latest`.
    repeat
        With --resume: a procedure to run again although it is finished; may be given several times.
    trace
        Record every exchange with the instruments in the journal.
    record
        Record every call of the drivers and every byte in this file, for `motorbench station replay`.
    seed
        Seed of the virtual bench.
    faults
        A file of faults for the virtual bench.
    fault
        One fault in a few words, like "lcr_meter: silence at step 3.2.2/3"; may be given several times.
    disturbances
        A file that states what disturbs the virtual bench: errors of probes, shaft sensors, contacts and hands.
    probe_verification
        An earlier run of probe-verification at this station, by its name under `--runs` or `latest`. Its probe gains are used.
    probe
        Limit of the gain error of a probe that the station file does not state, as in CH1=2%. Without it, you are asked. May be
        given several times.
    runs
        Folder in which the run's folder is created.
    continue_on_error
        If a procedure fails, continue with the next one.
    rehearse
        Rehearse on a virtual twin of the station and list every set point and action. No instrument of the station is opened.

    """
    folder = existing_run_folder(resume, runs) if resume else None
    if folder is not None:
        from bench.run.resume import begun

        _, began = begun(folder)
        station = station or began.station.source
        motor = motor or began.motor.source
        procedures = procedures or tuple(began.procedures)
        set_ = set_ or tuple(began.settings)
        seed = began.seed if seed is None else seed
        probe_verification = probe_verification or began.probe_verification
        probe = probe or tuple(began.probes)
        serial_number = serial_number or began.motor.serial_number
    unknown = sorted(set(repeat) - set(procedures))
    if repeat and folder is None:
        raise UsageError(text("--repeat goes with --resume RUN"))
    if unknown:
        raise UsageError(
            text(
                "--repeat {unknown}: not a procedure of this run; its procedures are: {names}",
                unknown=unknown[0],
                names=procedures,
            )
        )
    if not procedures:
        raise UsageError(text("name at least one procedure, or all; motorbench procedures lists them"))
    if station is None or motor is None:
        raise UsageError(text("--station FILE|virtual and --motor FILE are needed"))
    chosen = language_of(language)
    catalogues = catalogues_at(station)
    broken = catalogues.broken(load=False)
    if broken and station != VIRTUAL:
        # A station that asks for what is broken is refused with the cause, which is said once.
        load_station(Path(station))
    say_broken(broken, translator(chosen))
    request = RunRequest(
        procedures=procedures,
        motor=_numbered(load_motor(motor, catalogues.procedures), serial_number),
        station=station,
        language=chosen,
        runs=runs,
        operator=operator,
        person=person,
        answers=answers,
        assignments=set_,
        seed=seed or 0,
        trace=trace,
        record=record,
        faults=given_faults_of(faults, fault, catalogues),
        disturbances=disturbances,
        probe_verification=probe_verification,
        probes=probe,
        go_on=continue_on_error,
        resume=folder,
        repeat=repeat,
    )
    if rehearse:
        return _rehearse(request, catalogues, json=json)
    done = run_session(request, catalogues.procedures, console_on(sys.stderr))
    translate = translator(chosen)
    if json:
        print_json(done.result)
    else:
        print_summary(done.view, done.folder, translate)
        if done.view.parameters().parameters:
            print_next_steps(done.folder, translate)
    if done.view.status != "completed":
        manual = any(kind.manual for name, kind in catalogues.procedures.items() if name in procedures)
        print_end(done.view, done.folder, translate, resumable=not manual)
        return 1
    return say_missing(done, translate)


def _rehearse(request: RunRequest, catalogues: Catalogues, *, json: bool) -> int:
    from bench.cli.rehearse_output import print_rehearsal
    from bench.rehearsal.rehearse import rehearse

    done = rehearse(request, catalogues.procedures, console_on(sys.stderr))
    translate = translator(request.language)
    if json:
        print_json(done.as_dict(translate))
    else:
        print_rehearsal(done, translate)
    return 0 if done.good else 1


def _numbered(motor: MotorFile, serial_number: str) -> MotorFile:
    if not serial_number:
        return motor
    if len(serial_number) > 64 or not serial_number.isprintable():
        raise UsageError(
            text(
                "--serial-number {serial_number!r}: allowed are up to 64 printable characters",
                serial_number=serial_number,
            )
        )
    return replace(motor, nameplate=replace(motor.nameplate, serial_number=serial_number))


def given_faults_of(
    file: Path | None, phrases: Sequence[str], catalogues: Catalogues | None = None
) -> "Sequence[GivenFault]":
    """Return the faults that are asked for; a run without any loads nothing of the virtual bench."""
    if file is None and not phrases:
        return ()
    from bench.virtual.fault_file import given_faults

    return given_faults(file, phrases, (catalogues or installed()).procedures)
