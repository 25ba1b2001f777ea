"""`motorbench user add`: people who may open the panel from a network."""

import getpass
import sys
from pathlib import Path

from bench.i18n.errors import UsageError
from bench.i18n.language import language_of, translator
from drivers.interfaces.text import text


def add(name: str, *, role: str = "operator", file: Path = Path("people.toml")) -> int:
    """Add a person, or give a new password; it is asked for twice, or read from standard input where that is a pipe.

    Parameters
    ----------
    name
        The person's name.
    role
        viewer watches, operator leads runs, engineer also changes motors and signs off.
    file
        The file of people, for motorbench serve --people.

    """
    from bench.panel.server.access import add_person

    if sys.stdin.isatty():
        password = getpass.getpass("Password: ")
        if getpass.getpass("Again: ") != password:
            raise UsageError(text("the two passwords differ; nothing was changed"))
    else:
        password = sys.stdin.readline().rstrip("\r\n")
    add_person(file, name, role, password)
    message = text("{name} may log in as {role}: {file}", name=name, role=role, file=file)
    print(message.render(translator(language_of("auto"))))
    return 0
