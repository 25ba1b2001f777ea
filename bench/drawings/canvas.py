"""The few shapes that a connection drawing is made of, as SVG."""

from xml.etree import ElementTree as Xml

_SVG = "http://www.w3.org/2000/svg"
_FONT = "'Noto Sans','Segoe UI',Arial,'Liberation Sans','DejaVu Sans','Noto Sans CJK SC',sans-serif"
INK = "#20262b"
PAPER = "#ffffff"
FAINT = "#f2f4f6"


class Canvas:
    """An SVG picture of a given size with a name and a description for who cannot see it."""

    def __init__(self, width: int, height: int, name: str, description: str) -> None:
        self._root = Xml.Element(
            "svg",
            {
                "xmlns": _SVG,
                "viewBox": f"0 0 {width} {height}",
                "role": "img",
                "aria-label": f"{name}. {description}",
                "font-family": _FONT,
            },
        )
        Xml.SubElement(self._root, "title").text = name
        Xml.SubElement(self._root, "desc").text = description
        self.box(0, 0, width, height, outline="none")

    def box(self, x: float, y: float, width: float, height: float, *, fill: str = PAPER, outline: str = INK) -> None:
        """Draw a rectangle with slightly round corners."""
        self._add("rect", x=x, y=y, width=width, height=height, rx=6, fill=fill, stroke=outline, stroke_width=2)

    def circle(self, x: float, y: float, radius: float, *, fill: str = PAPER, outline: str = INK) -> None:
        """Draw a circle about a point."""
        self._add("circle", cx=x, cy=y, r=radius, fill=fill, stroke=outline, stroke_width=2)

    def line(self, path: str, *, width: float = 2, colour: str = INK, dashed: bool = False) -> None:
        """Draw a path of SVG's commands."""
        dashes = {"stroke_dasharray": "7 5"} if dashed else {}
        self._add("path", d=path, fill="none", stroke=colour, stroke_width=width, stroke_linecap="round", **dashes)

    def wire(self, path: str, colour: str) -> None:
        """Draw a wire: its colour in a dark edge, so that white and yellow show on paper."""
        self.line(path, width=9, colour=INK)
        self.line(path, width=6, colour=colour)

    def text(
        self, x: float, y: float, words: str, *, size: int = 16, anchor: str = "middle", bold: bool = False
    ) -> None:
        """Write words about a point; `anchor` is start, middle or end."""
        weight = {"font_weight": "bold"} if bold else {}
        # Not every renderer knows dominant-baseline: half a capital's height does the same.
        element = self._add("text", x=x, y=y + 0.36 * size, font_size=size, text_anchor=anchor, fill=INK, **weight)
        element.text = words

    def svg(self) -> str:
        """Return the picture."""
        return Xml.tostring(self._root, encoding="unicode")

    def _add(self, tag: str, **attributes: float | str) -> Xml.Element:
        told = {name.replace("_", "-"): f"{v:g}" if not isinstance(v, str) else v for name, v in attributes.items()}
        return Xml.SubElement(self._root, tag, told)
