"""A report as a plain document: sections of facts, tables, notices, plots. Page and PDF render the same one."""

from collections.abc import Callable, Sequence
from dataclasses import dataclass, field

from drivers.interfaces.text import Text, Translate
from reports.plots.model import Plot

#: What stands in a cell: words to be translated, or a figure, a name, an address as they are.
Cell = Text | str


@dataclass(frozen=True)
class Facts:
    """Names and what they stand for."""

    items: Sequence[tuple[Text, Cell]]


@dataclass(frozen=True)
class Column:
    """A table's column; `wide` ones take the room that is left."""

    title: Cell
    right: bool = False
    wide: bool = False


@dataclass(frozen=True)
class TableRow:
    """A table's row; `faint` stands below the one before it, `total` sums up."""

    cells: Sequence[Cell]
    faint: bool = False
    total: bool = False


@dataclass(frozen=True)
class Table:
    """Columns and rows, and a remark beneath."""

    columns: Sequence[Column]
    rows: Sequence[TableRow]
    title: Text | None = None
    remark: Text | None = None


@dataclass(frozen=True)
class Paragraph:
    """Plain words; `small` for what explains, `code` for what is typed."""

    words: Cell
    small: bool = False
    code: bool = False


@dataclass(frozen=True)
class Notices:
    """Warnings: identifier and sentence; `grave` ones concern the whole report."""

    items: Sequence[tuple[str, Text]]
    grave: bool = False


@dataclass(frozen=True)
class PlotFigure:
    """A plot with its caption."""

    plot: Plot


@dataclass(frozen=True)
class Drawings:
    """Drawings as SVG, whose words are letters, beside each other where there is room: what makes each, and its caption."""

    items: Sequence[tuple[Callable[[Translate], str], Text]]


@dataclass(frozen=True)
class Signatures:
    """Lines to sign on, each with what the signature stands for."""

    lines: Sequence[Text]


Block = Facts | Table | Paragraph | Notices | PlotFigure | Drawings | Signatures


@dataclass(frozen=True)
class ReportSection:
    """A heading and what stands beneath it; `level` 1 or 2."""

    title: Cell
    anchor: str
    blocks: Sequence[Block]
    level: int = 1


@dataclass(frozen=True)
class Document:
    """The whole report; `subtitle` names the motor, `origin` run and day, `running` stands in every page's foot."""

    title: Text
    subtitle: str
    origin: str
    running: str
    sections: Sequence[ReportSection] = field(default_factory=tuple)
