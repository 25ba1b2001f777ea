from io import StringIO

from rich.console import Console

from reports.tables.fitted import FittedColumn, fitted


def test_a_table_without_a_row_is_its_heading() -> None:
    console = Console(width=12, file=StringIO())
    with console.capture() as shown:
        console.print(fitted([FittedColumn("Parameter", breaks=24), FittedColumn("u", 1)], [], console.width))
    assert "Parameter" in shown.get()
