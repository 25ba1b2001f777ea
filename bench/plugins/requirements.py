"""Installed plug-ins that were not made for this version of motorbench."""

from importlib.metadata import distribution, version

from packaging.requirements import InvalidRequirement, Requirement
from packaging.utils import canonicalize_name

from bench.plugins.catalogue import OURS
from bench.plugins.catalogues import Catalogues
from drivers.interfaces.text import Text, text


def unmet_requirements(catalogues: Catalogues) -> list[Text]:
    """Return a sentence for each distribution with plug-ins whose requirement on motorbench this version does not meet.

    An installer checks it, but not where it was told to install without dependencies, nor where motorbench was changed afterwards.
    """
    have = version(OURS)
    origins = {entry.origin for entries in catalogues.entries.values() for entry in entries}
    result = []
    # A plug-in file has a checksum and requires nothing.
    for origin in sorted((one for one in origins if one.name != OURS and not one.sha256), key=str):
        for line in distribution(origin.name).requires or ():
            try:
                wanted = Requirement(line)
            except InvalidRequirement:
                result.append(text("{origin}: its requirement {line!r} cannot be read", origin=origin, line=line))
                continue
            ours = canonicalize_name(wanted.name) == OURS and (wanted.marker is None or wanted.marker.evaluate())
            if ours and not wanted.specifier.contains(have, prereleases=True):
                result.append(
                    text(
                        "{origin} requires motorbench {wanted}, and this is {have}: what it declares may fail or mislead; "
                        "install a version of it for this motorbench, or uninstall it",
                        origin=origin,
                        wanted=wanted.specifier,
                        have=have,
                    )
                )
    return result
