"""Every target by its name."""

import logging

from tests.studies.fuzz import files, replies, served
from tests.studies.fuzz.target import Target


def all_targets() -> dict[str, Target]:
    """Return them in the order replies, files, what is sent to the virtual bench; libraries log nothing from then on."""
    logging.disable()
    return {target.name: target for target in (*replies.targets(), *files.targets(), *served.targets())}
