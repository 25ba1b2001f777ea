"""Shapes of a drawing as SVG, in layers, with the coordinates along and across the motor's axis.

A place is (u, v): u along the motor's axis towards its shaft, v across it. The wide form has u to the right, the upright one
downwards; words stay level in both.
"""

from collections.abc import Iterable, Sequence
from enum import Enum
from xml.etree import ElementTree as Xml

from bench.drawings.lettering import width_of
from bench.drawings.palette import BODY, FONT, INK, PAPER

Place = tuple[float, float]
#: An SVG path's commands, each with its places.
Way = Sequence[tuple[str, tuple[Place, ...]]]


class Form(Enum):
    """The direction of the motor's axis on the page."""

    WIDE = "wide"
    UPRIGHT = "upright"


class Layer(Enum):
    """The layers of a drawing, from below: no lead lies over a label."""

    HALO = "halo"
    RAIL = "rail"
    GHOST = "ghost"
    LEAD = "lead"
    BOX = "box"
    MARK = "mark"


def straight(first: Place, *others: Place) -> Way:
    """Return the way through places."""
    return [("M", (first,)), *(("L", (place,)) for place in others)]


class Canvas:
    """Layers of shapes, and how far they reach: `left`, `top`, `right` and `bottom` on the page."""

    def __init__(self, form: Form) -> None:
        self.upright = form is Form.UPRIGHT
        self._layers = {layer: Xml.Element("g", {"class": f"drawing-{layer.value}"}) for layer in Layer}
        self.left = self.top = float("inf")
        self.right = self.bottom = float("-inf")

    def page(self, u: float, v: float) -> Place:
        """Return where a place lies on the page."""
        return (v, u) if self.upright else (u, v)

    def reach(self, left: float, top: float, right: float, bottom: float) -> None:
        """Keep room for an area of the page."""
        self.left, self.top = min(self.left, left), min(self.top, top)
        self.right, self.bottom = max(self.right, right), max(self.bottom, bottom)

    def path(
        self, layer: Layer, way: Way, colour: str = INK, width: float = 3.0, dashes: str = "", fill: str = "none"
    ) -> None:
        """Draw a line along a way."""
        told = []
        for command, places in way:
            points = [self.page(*place) for place in places]
            for x, y in points:
                self.reach(x - width, y - width, x + width, y + width)
            told.append(command + " ".join(f"{round(x, 1):g} {round(y, 1):g}" for x, y in points))
        more = {"stroke_dasharray": dashes} if dashes else {}
        self._add(layer, "path", d=" ".join(told), fill=fill, stroke=colour, stroke_width=width, **more)

    def box(
        self,
        layer: Layer,
        first: Place,
        last: Place,
        *,
        fill: str = BODY,
        edge: str = INK,
        dashes: str = "",
        round_by: float = 8.0,
    ) -> None:
        """Draw a rectangle between two of its corners."""
        (x0, y0), (x1, y1) = self.page(*first), self.page(*last)
        left, right, top, bottom = min(x0, x1), max(x0, x1), min(y0, y1), max(y0, y1)
        self.reach(left, top, right, bottom)
        more = {"stroke_dasharray": dashes} if dashes else {}
        size = {"x": left, "y": top, "width": right - left, "height": bottom - top}
        self._add(layer, "rect", **size, rx=round_by, fill=fill, stroke=edge, stroke_width=2.5, **more)

    def disc(self, layer: Layer, u: float, v: float, radius: float, *, fill: str = PAPER, edge: str = INK) -> None:
        """Draw a circle about a place."""
        x, y = self.page(u, v)
        self.reach(x - radius, y - radius, x + radius, y + radius)
        self._add(layer, "circle", cx=x, cy=y, r=radius, fill=fill, stroke=edge, stroke_width=2.5)

    def symbol(
        self, u: float, v: float, path: str, *, ink: str = INK, fill: str = "none", width: float = 2.5, lower: float = 0
    ) -> None:
        """Draw a small symbol about a place, upright in both forms; `lower` by so much."""
        x, y = self.page(u, v)
        self.reach(x - 14, y + lower - 14, x + 14, y + lower + 14)
        place = f"translate({x:g} {y + lower:g})"
        self._add(Layer.MARK, "path", transform=place, d=path, fill=fill, stroke=ink, stroke_width=width)

    def words(
        self,
        x: float,
        y: float,
        words: str,
        *,
        size: float = 18,
        bold: bool = False,
        anchor: str = "middle",
        ink: str = INK,
    ) -> None:
        """Write a line of words about a point of the page; `anchor` is start, middle or end."""
        if not words:
            return
        width = width_of(words, size, bold=bold)
        left = x - {"start": 0.0, "middle": width / 2.0, "end": width}[anchor]
        self.reach(left, y - size / 2.0, left + width, y + size / 2.0)
        # Not every renderer knows dominant-baseline: half a capital's height does the same.
        weight = {"font_weight": "700"} if bold else {}
        element = self._add(
            Layer.MARK, "text", x=x, y=y + 0.36 * size, font_size=size, text_anchor=anchor, fill=ink, **weight
        )
        element.text = words

    def svg(self, area: tuple[float, float, float, float], name: str, description: Iterable[str]) -> str:
        """Return the picture of an area (left, top, right, bottom), with its name and what it says for who cannot see it."""
        left, top, right, bottom = area
        said = "; ".join(description)
        root = Xml.Element(
            "svg",
            {
                "xmlns": "http://www.w3.org/2000/svg",
                "viewBox": f"{left:g} {top:g} {right - left:g} {bottom - top:g}",
                "role": "img",
                "aria-label": f"{name}: {said}",
                "font-family": FONT,
                "stroke-linejoin": "round",
            },
        )
        Xml.SubElement(root, "title").text = name
        Xml.SubElement(root, "desc").text = said
        box = {"x": f"{left:g}", "y": f"{top:g}", "width": f"{right - left:g}", "height": f"{bottom - top:g}"}
        Xml.SubElement(root, "rect", {**box, "fill": PAPER})
        root.extend(self._layers.values())
        return Xml.tostring(root, encoding="unicode")

    def _add(self, layer: Layer, tag: str, **attributes: float | str) -> Xml.Element:
        result = {k.replace("_", "-"): v if isinstance(v, str) else f"{round(v, 1):g}" for k, v in attributes.items()}
        return Xml.SubElement(self._layers[layer], tag, result)
