"""Errors inside a plug-in are reported with its kind, its name, its author's package and the place."""

import sys
from collections.abc import Iterator
from contextlib import contextmanager, redirect_stdout

from bench.i18n.errors import InputError, at, fault
from bench.plugins.catalogue import OURS, Origin, place_in
from bench.plugins.catalogues import installed
from drivers.interfaces.strangers_code import strangers_code
from drivers.interfaces.text import Text, text


def procedure_origin(name: str, kind: type) -> Origin | None:
    """Return where a procedure's class comes from, None where it is ours or belongs to no plug-in."""
    known = installed().procedures
    if known.get(name) is kind:
        origin = known.origin(name)
        return None if origin.name == OURS else origin
    file = getattr(sys.modules.get(kind.__module__), "__file__", None)
    return Origin(str(file)) if kind.__module__.startswith("motorbench_plugin_") else None


def plugin_fault(error: BaseException, what: Text, origin: Origin, module: str) -> Text:
    """Return what to say of an error inside `what` of a plug-in, whose `module` is looked for among the lines that led to it."""
    said, place = fault(error), place_in(error, module)
    if place and (shown := f"{place[0]}:{place[1]}") not in str(said):
        said = at(shown, said)
    return text(
        "an error in {what} from {origin}: {fault}; report it to its author",
        what=what,
        origin=origin,
        fault=said,
    )


@contextmanager
def plugin_code(what: Text, origin: Origin, module: str, *passing: type[Exception]) -> Iterator[None]:
    """Run a plug-in's code in the block. Raises InputError that names it for whatever it raises, but for what is `passing`."""
    try:
        # What a plug-in prints must not end up in a file's content.
        with redirect_stdout(sys.stderr), strangers_code():
            yield
    except passing:
        raise
    except Exception as error:
        raise InputError(plugin_fault(error, what, origin, module)) from error
