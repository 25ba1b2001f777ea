"""`python -m tests.studies.architecture FILE.svg`: the packages, their folders and their imports as a picture."""

import ast
import sys
import tomllib
from collections import Counter
from pathlib import Path

import grimp
import matplotlib as mpl
from matplotlib.axes import Axes
from matplotlib.backends.backend_svg import FigureCanvasSVG
from matplotlib.figure import Figure
from matplotlib.patches import FancyArrowPatch, FancyBboxPatch

ROOT = Path(__file__).parents[2]
PACKAGES = ("bench", "reports", "procedures", "drivers", "sim_instruments")
#: Left, top (of 100 by 100) and width of each package's box.
PLACES = {
    "bench": (2, 98, 96),
    "reports": (2, 42, 17),
    "procedures": (29, 42, 17),
    "drivers": (56, 42, 17),
    "sim_instruments": (81, 42, 17),
}
ROW, HEAD = 2.72, 4.6
ARROW = "#8a3b12"
#: Left, bottom, width and height.
Box = tuple[float, float, float, float]


def imports_between(graph: grimp.ImportGraph) -> Counter[tuple[str, str]]:
    """Return the number of imports from each package's modules to each other package's."""
    counted: Counter[tuple[str, str]] = Counter()
    for importer in graph.modules:
        for imported in graph.find_modules_directly_imported_by(importer):
            ends = importer.split(".")[0], imported.split(".")[0]
            if ends[0] != ends[1]:
                counted[ends] += 1
    return counted


def rows_of(package: str, layers: list[str]) -> list[str]:
    """Return the folders of a package, one text a row; those of `bench` by layer, the highest first."""
    folders = sorted(path.name for path in (ROOT / package).iterdir() if (path / "__init__.py").exists())
    if package != "bench":
        return folders
    layered = [layer.replace("bench.", "") for layer in layers]
    inside = {name for layer in layered for name in layer.split(" | ")}
    return [*layered, "beside: " + ", ".join(name for name in folders if name not in inside)]


def draw(target: Path) -> None:
    """Write the picture."""
    settings = tomllib.loads((ROOT / "pyproject.toml").read_text(encoding="utf-8"))
    contracts = settings["tool"]["importlinter"]["contracts"]
    layers = next(
        one["layers"] for one in contracts if one["type"] == "layers" and one["layers"][0].startswith("bench")
    )
    counted = imports_between(grimp.build_graph(*PACKAGES))
    figure = Figure(figsize=(11, 9))
    axes = figure.add_axes((0, 0, 1, 1), xlim=(0, 100), ylim=(0, 100))
    axes.set_axis_off()
    boxes: dict[str, Box] = {}
    for package, (left, top, width) in PLACES.items():
        rows = rows_of(package, layers)
        height = HEAD + ROW * len(rows) + 1.0
        boxes[package] = (left, top - height, width, height)
        shape = "round,pad=0,rounding_size=0.8"
        axes.add_patch(FancyBboxPatch((left, top - height), width, height, shape, fc="#f4f7fa", ec="#35506b", lw=1.4))
        axes.text(left + width / 2, top - HEAD / 2, package, ha="center", va="center", weight="bold", size=13)
        for number, row in enumerate(rows):
            y = top - HEAD - ROW * (number + 0.5)
            axes.text(left + 1.2, y, row, va="center", size=9.5, color="#1c2b39")
            if package == "bench":
                axes.text(left + 24, y, _says(row), va="center", size=9.5, color="#51606e")
            if package == "bench" and number:
                axes.plot((left, left + width), (y + ROW / 2, y + ROW / 2), color="#c5d0da", lw=0.7)
    for (importer, imported), count in sorted(counted.items()):
        _connect(axes, boxes[importer], boxes[imported], count)
    note = "Arrow: imports, with their number. In bench each row sees only the rows below it."
    axes.text(2, 2, note, size=9.5, color="#1c2b39")
    target.parent.mkdir(parents=True, exist_ok=True)
    with mpl.rc_context({"svg.hashsalt": "motorbench", "svg.fonttype": "path"}):
        FigureCanvasSVG(figure).print_svg(target, metadata={"Date": None})


def _says(layer: str) -> str:
    """Return the first line of what a layer of `bench` is; nothing for several folders beside each other."""
    source = ROOT / "bench" / layer / "__init__.py"
    if not source.exists():
        return ""
    return (ast.get_docstring(ast.parse(source.read_text(encoding="utf-8"))) or "").partition("\n")[0]


def _connect(axes: Axes, one: Box, other: Box, count: int) -> None:
    """Draw an arrow from a box to another with the number of imports; round what stands between them."""
    (left, bottom, width, height), (to_left, to_bottom, to_width, to_height) = one, other
    bend = 0.0
    if bottom > to_bottom + to_height:
        start, end = (to_left + to_width / 2, bottom), (to_left + to_width / 2, to_bottom + to_height)
    elif to_left - left - width < width:
        y = min(bottom + height, to_bottom + to_height) - HEAD
        start, end = (left + width, y), (to_left, y)
    else:
        start, end = (left + width / 2, bottom), (to_left + to_width / 2, to_bottom)
        bend = 0.25
    axes.add_patch(
        FancyArrowPatch(
            start, end, arrowstyle="-|>", mutation_scale=14, connectionstyle=f"arc3,rad={bend}", color=ARROW
        )
    )
    middle = (start[0] + end[0]) / 2, (start[1] + end[1]) / 2 - bend * (end[0] - start[0]) / 2
    axes.text(*middle, str(count), ha="center", va="center", size=9, color=ARROW, backgroundcolor="white")


if __name__ == "__main__":
    draw(Path(sys.argv[1]))
