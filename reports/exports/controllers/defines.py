"""Preprocessor definitions with their convention beside them."""

from collections.abc import Iterable

from reports.exports.comments import C
from reports.exports.target import ExportLine


def defines(lines: Iterable[ExportLine], *, suffix: str = "") -> list[str]:
    """Return one `#define NAME (value)` a figure; `suffix` makes what is no count a float."""
    shown = [(line, f"({line.text if line.whole else _decimal(line.text) + suffix})") for line in lines]
    name_width = max((len(line.name) for line, _ in shown), default=0)
    value_width = max((len(value) for _, value in shown), default=0)
    return [
        f"#define {line.name:<{name_width}} {value:<{value_width}} {C.comment(line.comment)}" for line, value in shown
    ]


def _decimal(value: str) -> str:
    """Return a literal that C takes for a floating one."""
    return value if any(mark in value for mark in ".en") else f"{value}.0"
