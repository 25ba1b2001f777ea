"""A study as it is asked for: type, station and procedures, checked before the first motor."""

from collections.abc import Callable, Sequence
from dataclasses import dataclass, field

from bench.distribution.workforce import Workforce
from bench.eol.defects.check import USUAL_SPREAD
from bench.eol.line.workers.virtual_socket import SocketMotors
from bench.eol.plan_file import SpreadSection
from bench.files.toml_file import nearest
from bench.i18n.errors import UsageError
from bench.motor.motor_file import load_motor
from bench.operators.fixture import ROLES as FIXTURE_ROLES
from bench.rehearsal.assumed import completed
from bench.rehearsal.counterparts import counterparts_of
from bench.run.needs import check_needs
from bench.run.software import software
from bench.station.station_file import Station
from bench.study.motors import StationStudy, StudiedMotor
from bench.study.twin import twin_of
from bench.study.worth import StudyQuality, worth_of
from drivers.interfaces.text import Text, text

_MOST_SPREAD = 20.0


@dataclass(frozen=True)
class StudyRequest:
    """The request for a study; `spread` are assignments like `resistance=1.5`, standard deviations in per cent."""

    procedures: Sequence[str]
    motor: str
    station: str
    motors: int
    seed: int
    workforce: Workforce
    assignments: Sequence[str] = ()
    spread: Sequence[str] = ()
    operator: str = ""
    progress: Callable[[int, int], None] = field(default=lambda _done, _all: None)


@dataclass(frozen=True)
class Studied:
    """The result of a study, the assumptions about the motor, and the substitutes for instruments of the station."""

    worth: StudyQuality
    spread: SpreadSection
    assumed: tuple[str, ...]
    differences: tuple[Text, ...]


def study(request: StudyRequest) -> Studied:
    """Measure drawn motors on the twin of a station. Ctrl-C gives what was measured so far.

    Raises UsageError and InputError for what does not go together.
    """
    twin = twin_of(request.station)
    # What cannot stand for an instrument is refused before anything is measured.
    counterparts = counterparts_of(twin) if twin else {}
    motor, assumed = completed(load_motor(request.motor))
    spread = _spread(request.spread)
    motors = SocketMotors(motor, spread, request.seed, _operator(request.operator, twin))
    work = StationStudy(
        motors,
        tuple(request.procedures),
        tuple(request.assignments),
        twin.content if twin else "",
        request.station,
        software()["code"],
    )
    planned = work.planned()
    if twin is not None:
        check_needs(planned, twin)
    done: list[StudiedMotor] = []
    results = request.workforce.results(work, [(number,) for number in range(1, request.motors + 1)])
    try:
        for one in results:
            done.append(one)
            request.progress(len(done), request.motors)
    except KeyboardInterrupt:
        pass
    finally:
        results.close()
    differences = tuple(dict.fromkeys(said for each in counterparts.values() for said in each.differences))
    return Studied(worth_of(done, request.motors), spread, assumed, differences)


def _operator(asked: str, twin: Station | None) -> str:
    """Return who does the hand work: as asked, else the station's fixture where it has one, else virtual hands."""
    if asked not in ("", "fixture", "virtual"):
        raise UsageError(text("--operator {operator}: allowed are fixture, virtual", operator=asked))
    if asked:
        return asked
    return "fixture" if twin is not None and FIXTURE_ROLES & twin.entries.keys() else "virtual"


def _spread(assignments: Sequence[str]) -> SpreadSection:
    allowed = ["resistance", "inductance", "flux", "inertia", "friction"]
    given: dict[str, float] = {}
    for assignment in assignments:
        name, equals, value = assignment.partition("=")
        if name not in allowed or not equals:
            raise UsageError(
                text(
                    "--spread {assignment}: {hint}; like resistance=1.5 (%)",
                    assignment=assignment,
                    hint=nearest(name, allowed),
                )
            )
        try:
            given[name] = float(value)
        except ValueError:
            given[name] = -1.0
        if not 0.0 <= given[name] <= _MOST_SPREAD:
            raise UsageError(
                text("--spread {assignment}: allowed are 0 to {most:g} (%)", assignment=assignment, most=_MOST_SPREAD)
            )
    return USUAL_SPREAD.model_copy(update=given)
