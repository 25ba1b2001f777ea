"""The station whose twin a bench is to be."""

from bench.eol.line.preparation.line_file import load_line
from bench.station.station_file import VIRTUAL, Station


def twin_of(reference: str) -> Station | None:
    """Return a file's station, of a line its first socket's; None for virtual ones. Raises InputError for a bad file."""
    return None if reference == VIRTUAL else load_line(reference, None).sockets[0].station
