"""An earlier run's verification of the probes, taken into another run of the same station."""

import json
import tomllib
from collections.abc import Sequence
from datetime import UTC, date, datetime
from pathlib import Path
from typing import Any

from bench.i18n.errors import InputError
from bench.journal.run_folder import existing_run_folder
from bench.journal.run_view import view_of
from bench.run.plan import Planned
from bench.run.request import RunRequest
from bench.run.resume import begun
from bench.station.station_file import Station
from drivers.interfaces import Role
from drivers.interfaces.text import Text, text, word
from procedures.verification.verified_channels import PROBE_VERIFICATION, VerifiedChannels

#: It holds for so many days: gains drift with temperature and age.
VALID_DAYS = 30


def verified_before(request: RunRequest, plan: Sequence[Planned]) -> bool:
    """Tell whether a run begins with a verification of the probes, or takes an earlier one."""
    return bool(request.probe_verification) or plan[0].name == PROBE_VERIFICATION


def verified_channels(reference: str, runs: Path, station: Station, today: date) -> VerifiedChannels:
    """Return the gains that an earlier run found, by its folder, its name under `runs`, or `latest`.

    Raises InputError where it holds no verification, is of another station, oscilloscope or probes, or older than 30 days.
    """
    folder = existing_run_folder(reference, runs)
    journal, began = begun(folder)
    result = view_of(journal.events).finished.get(PROBE_VERIFICATION)
    if result is None:
        raise _refused(folder.path, text("the run has no finished {procedure}", procedure=word(PROBE_VERIFICATION)))
    taken = datetime.fromisoformat(journal.events[0].wall).astimezone(UTC).date()
    age = (today - taken).days
    if not 0 <= age <= VALID_DAYS:
        raise _refused(
            folder.path,
            text("it was made on {date} and is valid for {days} days", date=taken.isoformat(), days=VALID_DAYS),
        )
    then, now = _oscilloscope(began.station_file), _oscilloscope(station.content)
    if began.station.name != station.name or then != now:
        raise _refused(
            folder.path,
            text(
                "it was made at the station {then}, whose oscilloscope or probes differ from those of {now}",
                then=began.station.name,
                now=station.name,
            ),
        )
    try:
        return VerifiedChannels.of_findings(result.findings)
    except (KeyError, TypeError) as error:
        raise _refused(folder.path, text("its result lacks {what}", what=str(error))) from error


def _refused(path: Path, why: Text) -> InputError:
    return InputError(
        text(
            "--probe-verification {path}: {why}; run probe-verification at this station, in this run or before it",
            path=path,
            why=why,
        )
    )


def _oscilloscope(content: str) -> Any:
    """Return what a station file says of its oscilloscope and the probes, their serial numbers among it."""
    # The virtual bench is described in JSON.
    read = json.loads(content) if content.startswith("{") else tomllib.loads(content)
    return read.get("instruments", {}).get(Role.OSCILLOSCOPE.value)
