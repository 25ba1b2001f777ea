"""From a run's record to what is exported of it."""

from bench.i18n.errors import FileError, InputError
from bench.journal.finished_run import FinishedRun
from bench.journal.waveforms import read_waveform, waveform_names
from bench.plugins.files import catalogues_of_run
from drivers.interfaces.text import text
from procedures.known_parameters import givers
from reports.exports.exported_map import ExportedMap, exported_map
from reports.exports.subject import Datasheet, Subject, doubtful, pole_pairs_doubt
from reports.exports.target import Recorded


def subject_of(run: FinishedRun) -> Subject:
    """Return the run's best figures, its plate, and what stands against them."""
    found, plate = run.view.parameters(), run.nameplate
    entered = {name: p.value for name, p in found.parameters.items() if p.source != "measured"}
    return Subject(
        motor=plate.name,
        serial_number=plate.serial_number,
        run=run.name,
        measured_on=run.started[:10],
        software=run.start.software.get("motorbench", ""),
        parameters=found.parameters,
        datasheet=Datasheet(
            rated_current=plate.rated_current,
            maximum_current=entered.get("maximum_current", plate.maximum_current),
            rated_speed_rpm=entered.get("rated_speed", plate.rated_speed_rpm),
            maximum_speed_rpm=plate.maximum_speed_rpm,
        ),
        warnings=doubtful(run.view.warnings()),
        pole_pairs_doubt=pole_pairs_doubt(found, run.view.finished),
        given_by=givers(catalogues_of_run(run.start.software).procedures),
        withheld=found.withheld,
        flux_map=_map_of(run),
    )


def records_of(run: FinishedRun) -> list[Recorded]:
    """Return the run's waveforms. Raises InputError where it has none, FileError for a file that is not whole."""
    result = []
    for file in sorted(run.folder.waveforms.glob("*.h5")):
        try:
            result.append(Recorded(file.stem, {name: read_waveform(file, name) for name in waveform_names(file)}))
        except (OSError, RuntimeError, ValueError) as error:
            raise FileError(
                text("{path}: the waveforms cannot be read: {reason}", path=file, reason=str(error))
            ) from None
    if not result:
        raise InputError(text("{path}: the run has no waveforms", path=run.folder.path))
    return result


def _map_of(run: FinishedRun) -> ExportedMap | None:
    """Return the run's first flux map."""
    made = (exported_map(name, result.findings) for name, result in run.view.results.items())
    return next((each for each in made if each is not None), None)
