"""A plot as SVG by matplotlib: letters as outlines, so that it looks the same on every machine and in the PDF."""

import io
import math
import re
from collections.abc import Sequence
from typing import TYPE_CHECKING, Any

import numpy as np

from reports.fonts import CHINESE, CHINESE_FAMILY, LATIN_FAMILY, REGULAR
from reports.plots.layout import WIDTH, PlotLayout, Say, named
from reports.plots.model import Axes, Manner, Plot
from reports.tables.figures import scale_of

if TYPE_CHECKING:
    from matplotlib.axes import Axes as MplAxes

#: Steps between ticks, at most.
_TICKS = 6
#: Share of the figure's width that so many ticks need.
_ROOM = 0.32
#: Line styles first, shades of grey second: they survive black and white.
_MANNERS: dict[Manner, dict[str, Any]] = {
    Manner.READING: {
        "linestyle": "none",
        "marker": "o",
        "markersize": 3.2,
        "markerfacecolor": "white",
        "color": "black",
    },
    Manner.RECORD: {"linestyle": "-", "linewidth": 0.9, "color": "0.62"},
    Manner.FIT: {"linestyle": "-", "linewidth": 1.1, "color": "black"},
    Manner.SECOND: {"linestyle": (0, (5, 2)), "linewidth": 1.1, "color": "0.15"},
    Manner.THIRD: {"linestyle": (0, (1, 1.4)), "linewidth": 1.3, "color": "0.15"},
    Manner.BROAD: {"linestyle": "-", "linewidth": 3.0, "color": "0.8", "solid_capstyle": "butt"},
    Manner.RESIDUAL: {"linestyle": "-", "linewidth": 0.7, "color": "0.35"},
}
#: Comes with matplotlib, and has a minus sign.
_FIGURES = "DejaVu Sans"
_STYLE = {
    "svg.fonttype": "path",
    "text.parse_math": False,
    "font.size": 8.0,
    "axes.linewidth": 0.6,
    "axes.labelsize": 8.0,
    "axes.grid": True,
    "grid.color": "0.88",
    "grid.linewidth": 0.5,
    "xtick.labelsize": 7.5,
    "ytick.labelsize": 7.5,
    "xtick.major.width": 0.6,
    "ytick.major.width": 0.6,
    "legend.fontsize": 7.5,
    "axes.unicode_minus": True,
}


def svg(plot: Plot, say: Say) -> str:
    """Return the plot as an SVG element without prolog; two languages stand side by side."""
    import matplotlib as mpl
    from matplotlib import font_manager
    from matplotlib.backends.backend_svg import FigureCanvasSVG
    from matplotlib.figure import Figure

    known = {entry.fname for entry in font_manager.fontManager.ttflist}
    for font in (REGULAR, CHINESE):
        if str(font) not in known:
            font_manager.fontManager.addfont(str(font))
    style: Any = {**_STYLE, "font.family": [LATIN_FAMILY, CHINESE_FAMILY], "svg.hashsalt": plot.name}
    with mpl.rc_context(style):
        layout = PlotLayout(plot, say)
        figure = Figure(figsize=(WIDTH, layout.height))
        FigureCanvasSVG(figure)
        for axes, place, columns in layout.places():
            _draw(figure.add_axes(place), axes, say, columns)
        stream = io.StringIO()
        figure.savefig(stream, format="svg", metadata={"Date": None, "Creator": None, "Format": None, "Type": None})
    return _bare(stream.getvalue())


def _draw(place: "MplAxes", axes: Axes, say: Say, columns: int) -> None:
    x_factor, x_unit = _scale([curve.x for curve in axes.curves], axes.x_unit)
    y_factor, y_unit = _scale([curve.y for curve in axes.curves], axes.y_unit)
    for curve in axes.curves:
        place.plot(curve.x / x_factor, curve.y / y_factor, label=" / ".join(say(curve.name)), **_MANNERS[curve.manner])
    place.set_xlabel(_label(" / ".join(say(axes.x_label)), x_unit))
    place.set_ylabel(_label("\n".join(say(axes.y_label)), y_unit))
    place.locator_params(nbins=_TICKS)
    place.locator_params(axis="x", nbins=min(_TICKS, round(_TICKS * place.get_position().width / _ROOM)))
    place.ticklabel_format(useOffset=False)
    if not axes.x_unit:
        place.locator_params(axis="x", integer=True)
    if axes.x_from_zero:
        place.set_xlim(left=0.0)
    if axes.y_from_zero:
        place.set_ylim(bottom=0.0)
    # Figures are Latin: a fallback for Chinese would make room for its higher letters.
    place.tick_params(labelfontfamily=_FIGURES)
    if named(axes):
        place.legend(
            loc="lower left",
            bbox_to_anchor=(0.0, 1.0),
            ncols=columns,
            frameon=False,
            handlelength=2.6,
            borderaxespad=0.1,
        )


def _label(words: str, unit: str) -> str:
    return f"{words}, {unit}" if unit else words


def _scale(arrays: Sequence[Any], unit: str) -> tuple[float, str]:
    largest = max((float(np.max(np.abs(a))) for a in arrays if np.size(a)), default=0.0)
    if unit == "s":
        return next(((f, u) for f, u in ((1.0, "s"), (1e-3, "ms"), (1e-6, "µs")) if largest >= f), (1e-6, "µs"))
    if not math.isfinite(largest) or not largest:
        return 1.0, unit
    scale = scale_of(largest, unit)
    return scale.factor, scale.unit


def _bare(document: str) -> str:
    """Cut off the XML prolog, the document type and the metadata: the element stands inside a page."""
    start = document.index("<svg")
    return re.sub(r"<metadata>.*?</metadata>", "", document[start:], flags=re.DOTALL).strip()
