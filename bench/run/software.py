"""Software that computes the figures of a run: this program, and the libraries beneath it."""

import hashlib
import os
import platform
from functools import cache
from importlib.metadata import version
from importlib.util import find_spec
from pathlib import Path

from bench.i18n.errors import InputError
from bench.plugins.catalogues import Catalogues, installed
from drivers.interfaces.text import text

#: Packages of this program that take part in a figure.
_OWN = ("bench", "drivers", "procedures", "sim_instruments")
_LIBRARIES = ("motorbench", "numpy", "scipy", "GTC")


def software(catalogues: Catalogues | None = None) -> dict[str, str]:
    """Return the versions of the program, of Python and of the libraries that compute; `code` is a hash of the program's source.

    The version alone does not tell two states of a working copy apart. Of plug-ins among the catalogues it is the version of
    their distribution, or the SHA-256 of their file.
    """
    own = {name: version(name) for name in _LIBRARIES} | {"python": platform.python_version(), "code": _code()}
    plugins = (catalogues or installed()).about()
    return own | {told["name"]: told.get("version") or told.get("sha256", "") for told in plugins}


def check_code(code: str) -> None:
    """Raise InputError where this process runs another program than the one with this hash; empty is any."""
    if code and code != _code():
        raise InputError(
            text(
                "{host} runs a different version of motorbench than the computer that sends the work: install "
                "the same version on all",
                host=platform.node(),
            )
        )


@cache
def _code() -> str:
    """Return the hash at the process's first run: what was loaded by then computes, whatever becomes of the files."""
    digest = hashlib.sha256()
    for package in _OWN:
        spec = find_spec(package)
        for folder in spec.submodule_search_locations or () if spec else ():
            for name in _sources(folder):
                content = Path(folder, name).read_bytes()
                digest.update(f"{package}/{name} {len(content)}\n".encode())
                digest.update(content)
    return digest.hexdigest()


def _sources(folder: str, below: str = "") -> list[str]:
    """Return the modules of a folder and of those in it, in order, by their paths from it; what has been compiled is not looked through."""
    found = []
    with os.scandir(folder) as entries:
        for entry in sorted(entries, key=lambda entry: entry.name):
            if entry.name.endswith(".py"):
                found.append(f"{below}{entry.name}")
            elif entry.is_dir(follow_symlinks=False) and entry.name != "__pycache__":
                found += _sources(entry.path, f"{below}{entry.name}/")
    return found
