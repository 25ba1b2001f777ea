"""Tables among the findings of a run, as CSV files beside its result: what other programs read without JSON."""

from collections.abc import Iterator, Mapping, Sequence
from pathlib import PurePath
from typing import Any

from bench.journal.encoding import plain

#: The finding that holds them: by file name, a table of columns of the same length, each by its heading.
TABLES = "tables"


def tables_of(result: Mapping[str, Any]) -> Iterator[tuple[str, bytes]]:
    """Yield name and content of each file that belongs to a result, its numbers as they stand in `result.json`.

    Where several procedures have a table of one name, it is that of the procedure whose name it bears, else of the first; the others'
    files have the procedure's name besides.
    """
    tables: dict[str, dict[str, Mapping[str, Sequence[Any]]]] = {}
    for procedure, found in result.get("procedures", {}).items():
        for name, columns in found.get("findings", {}).get(TABLES, {}).items():
            tables.setdefault(name, {})[procedure] = plain(columns)
    for name, owned in tables.items():
        path = PurePath(name)
        bearers = [procedure for procedure in owned if procedure.replace("-", "_") == path.stem]
        first = (bearers or list(owned))[0]
        for procedure, columns in owned.items():
            file = name if procedure == first else f"{path.stem}-{procedure}{path.suffix}"
            yield file, table_content(columns).encode()


def table_content(columns: Mapping[str, Sequence[Any]]) -> str:
    """Return a table of columns by their headings as CSV."""
    rows = zip(*columns.values(), strict=True)
    lines = [",".join(columns), *(",".join(repr(value) for value in row) for row in rows)]
    return "\n".join(lines) + "\n"
