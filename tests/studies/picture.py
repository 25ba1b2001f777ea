"""Pictures of a terminal, for the README: `python -m tests.studies.picture demo|ci FILE.svg`.

`demo` is the table that `motorbench demo` prints, `ci` a run of pytest in docs/examples/ci-project and what it leaves for a CI server.
"""

import io
import os
import re
import subprocess
import sys
import tempfile
from collections.abc import Callable, Mapping
from pathlib import Path
from xml.etree import ElementTree

from rich.console import Console
from rich.text import Text

from bench.cli.run import load_motor
from bench.i18n.language import translator
from bench.plugins.catalogues import installed
from bench.run.request import RunRequest
from bench.run.run import run
from reports.tables.summary import summary

ROOT = Path(__file__).parents[2]
PROJECT = ROOT / "docs" / "examples" / "ci-project"


def demo(console: Console) -> None:
    """Run the demo and print its table."""
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
    console.print("$ motorbench demo")
    console.print(summary(finished.view.parameters(), (), finished.view.truth, translator("en"), console.width))


def ci(console: Console) -> None:
    """Run the example's tests, and print their lines and the first of the JUnit file's."""
    options = ["-p", "no:cacheprovider", "-p", "no:xdist", "-p", "no:benchmark", "--color=yes", f"--rootdir={PROJECT}"]
    with tempfile.TemporaryDirectory() as folder:
        junit = Path(folder) / "junit.xml"
        done = subprocess.run(
            [sys.executable, "-m", "pytest", "-v", *options, f"--junit-xml={junit}"],
            cwd=PROJECT,
            env={**os.environ, "PYTHONPATH": str(ROOT), "COLUMNS": str(console.width)},
            capture_output=True,
            text=True,
            check=True,
        )
        suite = next(ElementTree.parse(junit).iter("testsuite"))  # noqa: S314  our own
    console.print("$ cd docs/examples/ci-project && pytest -v --junit-xml=junit.xml")
    for line in done.stdout.splitlines():
        if "::" in line or " passed" in line:
            console.print(Text.from_ansi(line))
    console.print('$ grep -o "<testsuite [^>]*>" junit.xml')
    told = " ".join(f'{name}="{suite.get(name)}"' for name in ("errors", "failures", "skipped", "tests", "time"))
    console.print(f'<testsuite name="pytest" {told} …>', markup=False)


PICTURES: Mapping[str, Callable[[Console], None]] = {"demo": demo, "ci": ci}


def main(which: str, target: Path) -> None:
    """Write a picture as SVG."""
    console = Console(record=True, width=112, file=io.StringIO(), highlight=False)
    PICTURES[which](console)
    target.parent.mkdir(parents=True, exist_ok=True)
    # The picture must not fetch a font from somewhere when it is looked at.
    picture = re.sub(r"@font-face \{.*?\}", "", console.export_svg(title="motorbench"), flags=re.DOTALL)
    target.write_text(picture, encoding="utf-8")


if __name__ == "__main__":
    main(sys.argv[1], Path(sys.argv[2]))
