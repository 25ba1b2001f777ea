"""One drawn motor measured on the twin of a station, and what each figure was worth."""

import math
import shutil
import tempfile
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path

from bench.distribution.work import Task
from bench.eol.line.motor_record import KeptWaveforms
from bench.eol.line.preparation.line_file import station_of
from bench.eol.line.workers.virtual_socket import SocketMotors, VirtualSocket, seed_of
from bench.journal.run_folder import RunFolder
from bench.journal.run_view import RunView
from bench.plugins.catalogues import installed
from bench.run.needs import check_needs
from bench.run.plan import Planned, make_plan, measured_at
from bench.run.request import RunOptions, RunRequest
from bench.run.retry_policy import never_stop
from bench.run.run import carry_out
from bench.run.software import check_code, software
from bench.safety.interrupts import Interrupts
from bench.station.library_logs import quieten_libraries
from bench.station.sharing import NotShared
from procedures.known_parameters import known_parameters


@dataclass(frozen=True)
class StudiedFigure:
    """A figure by one procedure: value and 95 % interval, and the truth; NaN where it was withheld."""

    procedure: str
    parameter: str
    value: float
    low: float
    high: float
    truth: float


@dataclass(frozen=True)
class StudiedMotor:
    """The results of one motor, and the procedures that refused it, each with its reason."""

    number: int
    figures: tuple[StudiedFigure, ...]
    refused: tuple[tuple[str, str], ...]


@dataclass(frozen=True)
class StationStudy:
    """The common part of all motors: the type and its spread, the procedures with their settings, the text of the station.

    `code` is the hash of the program that is to measure everywhere, any where it is empty.
    """

    motors: SocketMotors
    procedures: tuple[str, ...]
    assignments: tuple[str, ...]
    station: str = ""
    source: str = ""
    code: str = ""

    def planned(self) -> list[Planned]:
        """Return the procedures as a run takes them. Raises InputError for names and settings that are none."""
        station = station_of(self.station, self.source) if self.station else None
        known = (station.catalogues if station else installed()).procedures
        return make_plan(self.procedures, self.assignments, known)

    def begin(self) -> Callable[[Task], StudiedMotor]:
        """Return what measures a motor of a number, on a bench of this process. Raises InputError where this is another program."""
        check_code(self.code)
        quieten_libraries()
        planned, versions = self.planned(), software(installed())
        return lambda task: self._measure(planned, versions, *task)

    def _measure(self, planned: Sequence[Planned], versions: Mapping[str, str], number: int) -> StudiedMotor:
        # Each motor meets instruments of its own: what a station of this kind is worth, not this one of it.
        seed = seed_of(self.motors.seed, number)
        twin = station_of(self.station, self.source) if self.station else None
        drawn = SocketMotors(self.motors.motor, self.motors.spread, seed, self.motors.operator)
        folder = Path(tempfile.mkdtemp(prefix="motorbench-study-"))
        request = RunRequest([each.name for each in planned], drawn.motor, "virtual", "en", folder, seed=seed)
        try:
            with VirtualSocket(drawn, 0, (), twin).context("V", seed, lambda _: None, lambda _: NotShared()) as context:
                check_needs(planned, context.station)
                definitions = known_parameters({each.name: each.procedure for each in planned})
                truth = context.simulation.true_values(
                    definitions, measured_at(planned, drawn.motor.nameplate, context.station)
                )
                options = RunOptions(
                    after=never_stop,
                    folder=RunFolder(folder),
                    versions=versions,
                    waveforms=KeptWaveforms("none"),
                    durable=False,
                    write_result=False,
                )
                done = carry_out(request, planned, context, Interrupts(), options)
        finally:
            shutil.rmtree(folder, ignore_errors=True)
        return StudiedMotor(number, *_found(done.view, truth))


def _found(view: RunView, truth: Mapping[str, float]) -> tuple[tuple[StudiedFigure, ...], tuple[tuple[str, str], ...]]:
    figures: list[StudiedFigure] = []
    for procedure, result in view.finished.items():
        figures += [
            StudiedFigure(procedure, each.name, each.value, *each.coverage_interval, truth[each.name])
            for each in result.parameters
            if each.name in truth
        ]
        figures += [
            StudiedFigure(procedure, each.name, math.nan, math.nan, math.nan, truth[each.name])
            for each in result.withheld
            if each.name in truth
        ]
    refused = tuple((name, each.cause) for name, each in view.procedures.items() if each.result is None and each.cause)
    return tuple(figures), refused
