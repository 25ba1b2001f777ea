"""The page of the procedures is what the steps say."""

from pathlib import Path

from bench.plugins.catalogues import installed
from reports.tables.procedure_table import markdown


def test_page_holds_the_tables_made_from_the_steps():
    page = (Path(__file__).parents[2] / "docs" / "reference" / "procedures.md").read_text()
    assert page.endswith(markdown(installed().procedures)), (
        "docs/reference/procedures.md is stale; its first lines say which command makes it"
    )
