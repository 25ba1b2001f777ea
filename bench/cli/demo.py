"""`motorbench demo`: every procedure on the virtual bench."""

import sys
from pathlib import Path

from bench.cli.options import Language, Seed
from bench.cli.output import print_end, print_json, print_page, print_summary, say_missing
from bench.cli.run import given_faults_of
from bench.i18n.language import language_of, translator
from bench.motor.motor_file import load_motor
from bench.plugins.catalogues import installed
from bench.report.ahead import ReportAhead
from bench.run.console import console_on
from bench.run.request import Finished, RunRequest
from bench.run.run import run as run_session


def demo(
    *,
    motor: str = "lg-400w",
    seed: Seed = 0,
    json: bool = False,
    language: Language = "auto",
    runs: Path = Path("runs"),
    faults: Path | None = None,
    fault: tuple[str, ...] = (),
    disturbances: Path | None = None,
) -> int:
    """Measure a virtual motor by every procedure, print the summary beside the truth, and write the report's page.

    Parameters
    ----------
    motor
        A motor file with a table [virtual], or the name of a shipped motor: lg-400w, ipmsm, outrunner-delta, gimbal, drone.
    seed
        Seed of the noise and of the virtual operator. The same seed gives the same figures to the last digit.
    json
        Print one JSON object and nothing else; no page is written.
    runs
        Folder in which the run's folder is created.
    faults
        A file of faults to inject.
    fault
        One fault in a few words, like "lcr_meter: silence at step 3.2.2/3"; may be given several times.
    disturbances
        A file that states what disturbs the virtual bench: errors of probes, shaft sensors, contacts and hands.

    """
    chosen = language_of(language)
    translate = translator(chosen)
    request = RunRequest(
        procedures=("all",),
        motor=load_motor(motor),
        station="virtual",
        language=chosen,
        runs=runs,
        seed=seed,
        faults=given_faults_of(faults, fault),
        disturbances=disturbances,
    )
    if json:
        done = run_session(request, installed().procedures, console_on(sys.stderr))
        print_json(done.result)
    else:
        done = _shown(request)
    if done.view.status != "completed":
        print_end(done.view, done.folder, translate)
        return 1
    return say_missing(done, translate)


def _shown(request: RunRequest) -> Finished:
    translate = translator(request.language)
    with ReportAhead(request.language) as report:
        done = run_session(request, installed().procedures, console_on(sys.stderr), listeners=(report.hear,))
        print_summary(done.view, done.folder, translate)
        sys.stdout.flush()
        print_page(report.page(), done.folder, translate)
    return done
