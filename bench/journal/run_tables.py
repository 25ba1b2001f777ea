"""Tables among the findings of a run, as CSV files beside its result: what other programs read without JSON."""

from collections.abc import Iterator, Mapping, Sequence
from typing import Any

#: The finding that holds them: by file name, a table of columns of the same length, each by its heading.
TABLES = "tables"


def tables_of(result: Mapping[str, Any]) -> Iterator[tuple[str, bytes]]:
    """Yield name and content of each file that belongs to a result as it stands in `result.json`."""
    for procedure in result.get("procedures", {}).values():
        for name, columns in procedure.get("findings", {}).get(TABLES, {}).items():
            yield name, table_content(columns).encode()


def table_content(columns: Mapping[str, Sequence[Any]]) -> str:
    """Return a table of columns by their headings as CSV."""
    rows = zip(*columns.values(), strict=True)
    lines = [",".join(columns), *(",".join(repr(value) for value in row) for row in rows)]
    return "\n".join(lines) + "\n"
