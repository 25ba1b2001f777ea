"""The photos that a run keeps beside its journal, to be shown."""

from bench.run.request import RunRequest
from bench.station.station_file import Station


def kept_photos(request: RunRequest, station: Station) -> dict[str, bytes]:
    """Return the motor's and the station's photo, made small, by what they show. Raises FileError for a damaged one."""
    photos = {"motor": request.motor.photo, "station": station.photo}
    return {what: photo.small() for what, photo in photos.items() if photo is not None}
