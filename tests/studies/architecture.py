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
#: Left and width of each package's box, in per cent of the picture; all but the first stand below that one.
PLACES = {
    "bench": (2, 96),
    "reports": (2, 17),
    "procedures": (29, 17),
    "drivers": (56, 17),
    "sim_instruments": (81, 17),
}
#: Heights in rows of text: a box's title, what is free between boxes, and a row in inches.
HEAD, BETWEEN, ROW = 1.8, 3.5, 0.235
#: The picture, in inches.
WIDTH = 11
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


def rows_of(package: str, layers: list[str]) -> list[tuple[str, bool]]:
    """Return the folders of a package, and whether each begins a layer; those of `bench` by layer, the highest first."""
    folders = sorted(path.name for path in (ROOT / package).iterdir() if (path / "__init__.py").exists())
    if package != "bench":
        return [(name, False) for name in folders]
    layered = [layer.split(" | ") for layer in layers]
    return [(name, name == layer[0]) for layer in layered for name in layer]


def draw(target: Path) -> None:
    """Write the picture."""
    settings = tomllib.loads((ROOT / "pyproject.toml").read_text(encoding="utf-8"))
    contracts = settings["tool"]["importlinter"]["contracts"]
    layers = next(one["layers"] for one in contracts if one.get("containers") == ["bench"])
    counted = imports_between(grimp.build_graph(*PACKAGES))
    rows = {package: rows_of(package, layers) for package in PLACES}
    heights = {package: HEAD + len(of_it) + 0.4 for package, of_it in rows.items()}
    below = max(height for package, height in heights.items() if package != "bench")
    whole = heights["bench"] + BETWEEN + below + 4.5
    figure = Figure(figsize=(WIDTH, whole * ROW))
    axes = figure.add_axes((0, 0, 1, 1), xlim=(0, 100), ylim=(-whole + 0.5, 0.5))
    axes.set_axis_off()
    boxes: dict[str, Box] = {}
    for package, (left, width) in PLACES.items():
        top = 0.0 if package == "bench" else -heights["bench"] - BETWEEN
        height = heights[package]
        boxes[package] = (left, top - height, width, height)
        shape = "round,pad=0,rounding_size=0.5"
        axes.add_patch(FancyBboxPatch((left, top - height), width, height, shape, fc="#f4f7fa", ec="#35506b", lw=1.4))
        axes.text(left + width / 2, top - HEAD / 2, package, ha="center", va="center", weight="bold", size=13)
        for number, (folder, begins) in enumerate(rows[package]):
            y = top - HEAD - number - 0.5
            axes.text(left + 1.2, y, folder, va="center", size=9.5, color="#1c2b39")
            if package == "bench":
                axes.text(left + 15, y, _says(folder), va="center", size=9.5, color="#51606e")
            if begins:
                axes.plot((left, left + width), (y + 0.5, y + 0.5), color="#c5d0da", lw=0.7)
    for (importer, imported), count in sorted(counted.items()):
        _connect(axes, boxes[importer], boxes[imported], count)
    note = (
        "Arrow: imports, with their number. A line within bench parts two layers: the upper sees the lower, "
        "folders of one layer do not see each other."
    )
    axes.text(2, -whole + 1.2, note, size=9.5, color="#1c2b39")
    target.parent.mkdir(parents=True, exist_ok=True)
    with mpl.rc_context({"svg.hashsalt": "motorbench", "svg.fonttype": "path"}):
        FigureCanvasSVG(figure).print_svg(target, metadata={"Date": None})


def _says(folder: str) -> str:
    """Return what a folder of `bench` is, in the first words of its first line."""
    source = ROOT / "bench" / folder / "__init__.py"
    said = ast.get_docstring(ast.parse(source.read_text(encoding="utf-8"))) or ""
    return said.partition("\n")[0].partition(";")[0].removesuffix(".")


def _connect(axes: Axes, one: Box, other: Box, count: int) -> None:
    """Draw an arrow from a box to another with the number of imports; round what stands between them."""
    (left, bottom, width, height), (to_left, to_bottom, to_width, to_height) = one, other
    bend = 0.0
    if bottom > to_bottom + to_height:
        start, end = (to_left + to_width / 2, bottom), (to_left + to_width / 2, to_bottom + to_height)
    elif to_left - left - width < width:
        y = min(bottom + height, to_bottom + to_height) - HEAD / 2
        start, end = (left + width, y), (to_left, y)
    else:
        start, end = (left + width / 2, bottom), (to_left + to_width / 2, to_bottom)
        bend = 0.25
    axes.add_patch(
        FancyArrowPatch(
            start, end, arrowstyle="-|>", mutation_scale=14, connectionstyle=f"arc3,rad={bend}", color=ARROW
        )
    )
    # The bend is a share of the length as it is seen: what a per cent of the width is in rows.
    sag = bend * (end[0] - start[0]) / 2 * WIDTH / 100 / ROW
    middle = (start[0] + end[0]) / 2, (start[1] + end[1]) / 2 - sag
    axes.text(*middle, str(count), ha="center", va="center", size=9, color=ARROW, backgroundcolor="white")


if __name__ == "__main__":
    draw(Path(sys.argv[1]))
