"""How the documentation is built: `uv run --group docs sphinx-build -W --keep-going docs build/site`."""

import sys
from importlib.metadata import version as installed
from pathlib import Path
from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from sphinx.application import Sphinx

sys.path.insert(0, str(Path(__file__).parent))

project = "motorbench"
author = "motorbench"
version = release = installed("motorbench")

extensions = ["myst_parser", "sphinx.ext.autodoc", "sphinx.ext.autosummary", "cyclopts.ext.sphinx"]
exclude_patterns = ["examples/**"]
myst_heading_anchors = 4
myst_enable_extensions = ["colon_fence", "dollarmath"]

autosummary_generate = True
autosummary_ignore_module_all = False
autodoc_typehints = "description"
autodoc_member_order = "bysource"
autodoc_default_options = {"members": True, "undoc-members": False, "show-inheritance": True}
# Names between single backticks are code in the docstrings.
default_role = "code"

html_theme = "furo"
html_title = "motorbench"
html_copy_source = False
html_show_copyright = False


def _escape(*arguments: Any) -> None:
    """Have bars and stars in a docstring stand for themselves, but between backticks."""
    lines = arguments[-1]
    for number, line in enumerate(lines):
        pieces = line.split("`")
        pieces[::2] = [piece.replace("|", "\\|").replace("*", "\\*") for piece in pieces[::2]]
        lines[number] = "`".join(pieces)


def setup(app: "Sphinx") -> None:
    """Register what the build adds to Sphinx."""
    app.connect("autodoc-process-docstring", _escape)
