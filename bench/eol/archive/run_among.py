"""The folder of a motor's run, wherever the folder of all runs is now."""

from pathlib import Path

from bench.eol.record import MotorRecord


def run_among(runs: Path, record: MotorRecord) -> Path:
    """Return where a record's run is among `runs`: these may have been moved, restored, or named from another folder."""
    return runs.joinpath(record.batch, *Path(record.run).parts[-2:])
