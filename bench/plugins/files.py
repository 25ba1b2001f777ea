"""Plug-in files: a Python file beside a station or a plan, named in its `[plugins]`."""

import hashlib
import sys
from collections.abc import Iterator, Mapping
from contextlib import redirect_stdout
from importlib.util import module_from_spec, spec_from_loader
from pathlib import Path
from types import ModuleType
from typing import Any

from pydantic import Field

from bench.files.toml_file import Section
from bench.i18n.errors import FileError
from bench.i18n.language import add_translations_beside
from bench.plugins.catalogue import Origin, PluginFile, UnloadedDeclaration, placed_reason
from bench.plugins.catalogues import GROUPS, Catalogues, installed
from bench.plugins.records import RecordOutput
from drivers.catalogue import Driver
from drivers.interfaces.strangers_code import strangers_code
from drivers.interfaces.text import text
from drivers.safety_devices import InterlockDriver, RelayDriver

KEY = "plugins"


class PluginsSection(Section):
    """`[plugins]`: Python files beside this one, and the outputs that every finished record is handed to, by name."""

    files: list[str] = Field(default_factory=list, description="paths of Python files, relative to this file")
    records: list[str] = Field(
        default_factory=list, description="names of outputs, as motorbench station drivers lists them"
    )


def catalogues_of(section: PluginsSection, source: str, base: Catalogues | None = None) -> Catalogues:
    """Return the catalogues with a section's files; `source` is the path of the file that it stands in.

    Raises InputError for a file that is not there, and for a records output that is unknown.
    """
    # Of a link, the file that it leads to: every process that reads the station finds the same files.
    folder = Path(source).resolve().parent
    result = (base or installed()).with_files([load_file(folder / file, source) for file in section.files])
    for name in section.records:
        result.records.need(
            name,
            lambda why, name=name: FileError(  # type: ignore[misc]
                text("{source}: {key}.records: {name!r}: {why}", source=source, key=KEY, name=name, why=why)
            ),
        )
    return result


def catalogues_of_run(software: Mapping[str, str]) -> Catalogues:
    """Return the catalogues with the plug-in files that stand in a run's record, as far as they are still what they were."""
    files = []
    for name, told in software.items():
        path = Path(name)
        if path.is_absolute() and path.is_file() and _sha256(path.read_bytes()) == told:
            files.append(load_file(path, name))
    return installed().with_files(files)


def _sha256(content: bytes) -> str:
    return hashlib.sha256(content).hexdigest()


def load_file(path: Path, source: str) -> PluginFile:
    """Return what a plug-in file declares; one that cannot be imported is told so. Raises FileError where there is none.

    It is loaded once a process for each content, as a module with a name of its own: no file or folder beside it can be
    mistaken for a package of motorbench, and none of its names for another's.
    """
    try:
        content = path.read_bytes()
    except (OSError, ValueError) as error:
        raise FileError(
            text(
                "{source}: {key}.files: {path} cannot be read: {error}",
                source=source,
                key=KEY,
                path=path,
                error=getattr(error, "strerror", None) or str(error),
            )
        ) from None
    origin = Origin(str(path.resolve()), sha256=_sha256(content))
    name = f"motorbench_plugin_{hashlib.sha256(str(origin).encode() + content).hexdigest()[:16]}"
    try:
        with strangers_code():
            module = sys.modules.get(name) or _import(name, path.resolve(), content)
    except Exception as error:  # noqa: BLE001  a stranger's code may raise anything
        return PluginFile(origin, error=placed_reason(error, name))
    entries: dict[str, list[UnloadedDeclaration]] = {group: [] for group in GROUPS}
    for group, declared, value in _declarations(module):
        entries[group].append(UnloadedDeclaration(declared, origin, lambda value=value: value, name))  # type: ignore[misc]
    if not any(entries.values()):
        return PluginFile(
            origin,
            error=text(
                "it declares nothing: no driver, relay, interlock contact, simulated instrument, procedure, export or output"
            ),
        )
    return PluginFile(origin, entries)


def _import(name: str, path: Path, content: bytes) -> ModuleType:
    spec = spec_from_loader(name, loader=None, origin=str(path))
    if spec is None:
        raise ImportError(str(path))
    module = module_from_spec(spec)
    module.__file__ = str(path)
    # Dataclasses and pickles look their module up.
    sys.modules[name] = module
    try:
        # What a plug-in prints must not end up in JSON, nor in what a guardian says.
        with redirect_stdout(sys.stderr):
            exec(compile(content, str(path), "exec"), vars(module))  # noqa: S102  the station's owner named the file
        add_translations_beside(path)
    except BaseException:
        del sys.modules[name]
        raise
    return module


def _declarations(module: ModuleType) -> Iterator[tuple[str, str, Any]]:
    """Give group, name and value of what a module declares; what it only imported from elsewhere is not its own."""
    from procedures.core.procedure import Procedure
    from reports.exports.target import Target
    from sim_instruments.catalogue import SimulatedInstrument

    kinds: dict[str, type[Any]] = {
        "watchdog_relays": RelayDriver,
        "interlocks": InterlockDriver,
        "simulated_instruments": SimulatedInstrument,
        "exports": Target,
        "records": RecordOutput,
    }
    drivers: dict[str, list[Driver]] = {}
    for value in vars(module).values():
        for group, kind in kinds.items():
            if isinstance(value, kind):
                yield group, value.name, value
        if isinstance(value, Driver):
            drivers.setdefault(value.name, []).append(value)
        if isinstance(value, type) and issubclass(value, Procedure) and value.__module__ == module.__name__:
            yield "procedures", getattr(value, "name", value.__name__), value
    for name, found in drivers.items():
        yield "drivers", name, tuple(found)
