"""`python -m tests.studies.picture FILE.svg`: the demo's table as a picture, for the README."""

import io
import re
import sys
import tempfile
from pathlib import Path

from rich.console import Console

from bench.cli.run import load_motor
from bench.i18n.language import translator
from bench.plugins.catalogues import installed
from bench.run.request import RunRequest
from bench.run.run import run
from reports.tables.summary import summary


def main(target: Path) -> None:
    """Run the demo and write its table as SVG."""
    translate = translator("en")
    with tempfile.TemporaryDirectory() as folder:
        wishes = RunRequest(
            procedures=("all",),
            motor=load_motor("lg-400w"),
            station="virtual",
            language="en",
            seed=0,
            runs=Path(folder),
        )
        finished = run(wishes, installed().procedures, Console(quiet=True))
    console = Console(record=True, width=112, file=io.StringIO())
    console.print("$ motorbench demo")
    console.print(summary(finished.view.parameters(), (), finished.view.truth, translate, console.width))
    target.parent.mkdir(parents=True, exist_ok=True)
    # The picture must not fetch a font from somewhere when it is looked at.
    picture = re.sub(r"@font-face \{.*?\}", "", console.export_svg(title="motorbench"), flags=re.DOTALL)
    target.write_text(picture, encoding="utf-8")


if __name__ == "__main__":
    main(Path(sys.argv[1]))
