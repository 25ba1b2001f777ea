"""A drawing read back from its SVG: its lines, labels and marks, and what they join."""

import re
from collections.abc import Iterator, Mapping
from dataclasses import dataclass
from itertools import combinations
from xml.etree import ElementTree as Xml

from bench.drawings.lettering import width_of

SVG = "{http://www.w3.org/2000/svg}"
Point = tuple[float, float]
Segment = tuple[Point, Point]


@dataclass(frozen=True)
class Label:
    """Words with their centre and the area that they take."""

    words: str
    middle: Point
    area: tuple[float, float, float, float]


@dataclass(frozen=True)
class Line:
    """A path through points; `ring` for a clamp round a rail."""

    layer: str
    points: tuple[Point, ...]
    straight: tuple[Segment, ...]
    ring: bool = False


class Picture:
    """What is drawn, by kind."""

    def __init__(self, svg: str) -> None:
        self.root = Xml.fromstring(svg)  # noqa: S314  made a line before, by ourselves
        self.layers = {
            group.get("class", "").removeprefix("drawing-"): list(group) for group in self.root.iter(f"{SVG}g")
        }
        self.labels = [_label(e) for e in self.layers["mark"] if e.tag == f"{SVG}text"]
        self.discs = [_disc(e) for e in self.layers["mark"] if e.tag == f"{SVG}circle"]
        self.plates = [_rectangle(e) for e in self.layers["mark"] if e.tag == f"{SVG}rect"]
        self.boxes = [_rectangle(e) for e in self.layers["box"] if e.tag == f"{SVG}rect"]
        self.lines = list(_lines(self.layers, ("rail", "lead", "ghost")))
        self.rings = [line for line in _lines(self.layers, ("mark",)) if line.ring]
        self.view = tuple(float(n) for n in self.root.get("viewBox", "").split())

    def words(self) -> list[str]:
        return [label.words for label in self.labels]

    def faults(self) -> list[str]:
        """Name every label on a lead, crossing without a hop, pair of marks that overlap, and part outside the picture."""
        return [*self._covered(), *self._plain_crossings(), *self._overlaps(), *self._outside()]

    def _free_labels(self) -> list[Label]:
        """Return the labels that stand on paper: neither in a disc nor on a plate or box."""
        return [
            label
            for label in self.labels
            if not self._in_a_disc(label)
            and not any(_within(label.middle, plate) for plate in self.plates)
            and not any(_within(label.middle, box) for box in self.boxes)
        ]

    def _in_a_disc(self, label: Label) -> bool:
        return any(_distance(label.middle, (x, y)) < 3.0 and r >= 10.0 for x, y, r in self.discs)

    def _covered(self) -> Iterator[str]:
        for label in self._free_labels():
            if any(_meets(label.area, segment, 4.0) for line in self.lines for segment in line.straight):
                yield f"label on a lead: {label.words}"
        for one, other in combinations(self.labels, 2):
            if _overlap(one.area, other.area):
                yield f"label on a label: {one.words}, {other.words}"
        for label in self.labels:
            if self._in_a_disc(label):
                continue
            for box in self.boxes:
                if _overlap(label.area, box) and not _inside(label.area, box):
                    yield f"label on the edge of a box: {label.words}"
            for plate in self.plates:
                if _overlap(label.area, plate) and not _inside(label.area, plate):
                    yield f"label on the edge of a mark: {label.words}"

    def _plain_crossings(self) -> Iterator[str]:
        segments = [segment for line in self.lines for segment in line.straight]
        level = [(a, b) for a, b in segments if abs(a[1] - b[1]) < 1.0]
        upright = [(a, b) for a, b in segments if abs(a[0] - b[0]) < 1.0]
        for a, b in level:
            for c, d in upright:
                x, y = c[0], a[1]
                if min(a[0], b[0]) + 6 < x < max(a[0], b[0]) - 6 and min(c[1], d[1]) + 6 < y < max(c[1], d[1]) - 6:
                    yield f"crossing without a hop at {x:g} {y:g}"

    def _overlaps(self) -> Iterator[str]:
        places = sorted(set(self.discs))
        for (x, y, r), (a, b, s) in combinations(places, 2):
            if _distance((x, y), (a, b)) < r + s - 4.0 and (x, y) != (a, b):
                yield f"marks overlap at {x:g} {y:g} and {a:g} {b:g}"
        for plate in self.plates:
            for x, y, r in places:
                nearest = min(max(x, plate[0]), plate[2]), min(max(y, plate[1]), plate[3])
                if _distance(nearest, (x, y)) < r - 3.0 and not _within((x, y), plate):
                    yield f"a mark overlaps a plate at {x:g} {y:g}"
        for one, other in combinations(self.plates, 2):
            if _overlap(one, other):
                yield f"plates overlap at {one} and {other}"
        # Small ones are parts of a whole: a coupling on its shaft.
        large = [box for box in self.boxes if min(box[2] - box[0], box[3] - box[1]) > 40.0]
        for one, other in combinations(large, 2):
            if _overlap(one, other) and not _inside(one, other) and not _inside(other, one):
                yield f"boxes overlap at {one} and {other}"

    def _outside(self) -> Iterator[str]:
        x, y, width, height = self.view
        area = x, y, x + width, y + height
        places = [point for line in self.lines for point in line.points]
        places += [(x - r, y - r) for x, y, r in self.discs] + [(x + r, y + r) for x, y, r in self.discs]
        for box in [*self.boxes, *self.plates, *[label.area for label in self.labels]]:
            places += [box[:2], box[2:]]
        for place in places:
            if not _within(place, area):
                yield f"outside the picture: {place}"

    def nets(self, instruments: Mapping[str, str]) -> set[tuple[str, str, str]]:
        """Return what copper joins: instrument, socket (⏚ for a ground) and node, followed along the lines.

        `instruments` maps the name on a box to what it is called in the answer.
        """
        found = set()
        for group in self._joined():
            sockets = set(self._sockets(group, instruments))
            nodes = self._nodes(group)
            # Sockets that copper joins to no node: leads on the supply's own output, or clipped together.
            nodes |= {f"S{socket}".replace("−", "-") for name, socket in sockets if name == "supply"}
            if len(sockets) == 2 and not nodes:
                nodes = {"joint"}
            found |= {(name, socket, node) for name, socket in sockets for node in nodes}
        # A socket of the supply is on itself.
        found -= {("supply", socket, node) for _, socket, node in found if node.startswith("S")}
        return found

    def _joined(self) -> list[list[Line]]:
        """Return the groups of lines that touch each other: each is one piece of copper. Resistors part them."""
        lines = [line for line in (*self.lines, *self.rings) if line.layer != "ghost"]
        resistors = [box for box in self.boxes if _is_resistor(box)]
        lines = [line for line in lines if not any(_through(line, box) for box in resistors)]
        groups: list[list[Line]] = []
        for line in lines:
            touching = [group for group in groups if any(_touch(line, other) for other in group)]
            groups = [group for group in groups if group not in touching]
            groups.append([line, *(other for group in touching for other in group)])
        return groups

    def _nodes(self, group: list[Line]) -> set[str]:
        ends = [end for line in group for end in (line.points[0], line.points[-1])]
        found = set()
        for label in self.labels:
            plate = next((plate for plate in self.plates if _within(label.middle, plate)), None)
            if plate is not None and min(plate[2] - plate[0], plate[3] - plate[1]) > 40.0:
                middle = ((plate[0] + plate[2]) / 2.0, (plate[1] + plate[3]) / 2.0)
                if any(_apart(middle, segment) < 2.0 for line in group for segment in line.straight):
                    found |= {label.words} if label.words in ("A", "B", "C") else set()
                    # The motor's frame has a box too, with another word.
                    boxed = [other.words for other in self.labels if _within(other.middle, plate)]
                    found |= set() if {"A", "B", "C"} & set(boxed) else {"frame"}
            elif (
                label.words in ("H1", "H2", "H3", "H0", "N") and min(_distance(label.middle, end) for end in ends) < 40
            ):
                found.add(label.words)
        resistors = [((box[0] + box[2]) / 2.0, (box[1] + box[3]) / 2.0) for box in self.boxes if _is_resistor(box)]
        for line in group:
            # The rail that the three resistors end on.
            if len(resistors) == 3 and line.layer == "rail" and line.straight:
                near = [_apart(resistor, segment) < 26.0 for resistor in resistors for segment in line.straight]
                if all(near):
                    found.add("star")
        return found

    def _sockets(self, group: list[Line], instruments: Mapping[str, str]) -> Iterator[tuple[str, str]]:
        ends = {end for line in group for end in (line.points[0], line.points[-1])}
        for box in self.boxes:
            names = [label.words for label in self.labels if _within(label.middle, box) and label.words in instruments]
            if not names or max(box[2] - box[0], box[3] - box[1]) < 60.0:
                continue
            for x, y, r in self.discs:
                if r < 15.0 or not _on_edge((x, y), box) or min(_distance((x, y), end) for end in ends) > 2.0:
                    continue
                words = [label.words for label in self.labels if _distance(label.middle, (x, y)) < 3.0]
                yield instruments[names[0]], words[0] if words else "⏚"


def _numbers(element: Xml.Element, *names: str) -> tuple[float, ...]:
    return tuple(float(element.get(name, "0")) for name in names)


def _label(element: Xml.Element) -> Label:
    x, y, size = _numbers(element, "x", "y", "font-size")
    words, bold = element.text or "", element.get("font-weight") == "700"
    width = width_of(words, size, bold=bold)
    left = x - {"start": 0.0, "middle": width / 2.0, "end": width}[element.get("text-anchor", "start")]
    middle = y - 0.36 * size
    return Label(words, (left + width / 2.0, middle), (left, middle - 0.36 * size, left + width, middle + 0.36 * size))


def _disc(element: Xml.Element) -> tuple[float, float, float]:
    x, y, r = _numbers(element, "cx", "cy", "r")
    return x, y, r


def _rectangle(element: Xml.Element) -> tuple[float, float, float, float]:
    x, y, width, height = _numbers(element, "x", "y", "width", "height")
    return x, y, x + width, y + height


def _lines(layers: dict[str, list[Xml.Element]], names: tuple[str, ...]) -> Iterator[Line]:
    for name in names:
        for element in layers[name]:
            if element.tag != f"{SVG}path" or element.get("transform"):
                continue
            points, straight = list[Point](), list[Segment]()
            for command, told in re.findall(r"([MLC])([^MLC]*)", element.get("d", "")):
                n = [float(number) for number in told.split()]
                point = (n[-2], n[-1])
                if command == "L":
                    straight.append((points[-1], point))
                points.append(point)
            curves = element.get("d", "").count("C")
            yield Line(name, tuple(points), tuple(straight), ring=name == "mark" and curves == 2 and not straight)


def _is_resistor(box: tuple[float, float, float, float]) -> bool:
    return sorted((round(box[2] - box[0]), round(box[3] - box[1]))) == [16, 30]


def _through(line: Line, box: tuple[float, float, float, float]) -> bool:
    middle = ((box[0] + box[2]) / 2.0, (box[1] + box[3]) / 2.0)
    return any(_apart(middle, segment) < 1.5 for segment in line.straight)


def _on_edge(point: Point, box: tuple[float, float, float, float]) -> bool:
    x, y = point
    return (box[0] - 1 <= x <= box[2] + 1 and min(abs(y - box[1]), abs(y - box[3])) < 1.0) or (
        box[1] - 1 <= y <= box[3] + 1 and min(abs(x - box[0]), abs(x - box[2])) < 1.0
    )


def _touch(one: Line, other: Line) -> bool:
    """Tell whether one line ends on the other; a clamp's ring joins its lead to the rail that it goes round."""
    if one.ring and other.ring:
        return False
    if one.ring or other.ring:
        ring, line = (one, other) if one.ring else (other, one)
        first, last = ring.points[0], ring.points[1]
        middle = ((first[0] + last[0]) / 2.0, (first[1] + last[1]) / 2.0)
        ends = (line.points[0], line.points[-1])
        held = line.layer == "rail" and any(_apart(middle, segment) < 1.5 for segment in line.straight)
        return held or any(_distance(end, tip) < 1.5 for end in ends for tip in (first, last))
    return any(
        _apart(end, segment) < 1.5
        for line, crossed in ((one, other), (other, one))
        for end in (line.points[0], line.points[-1])
        for segment in crossed.straight
    )


def _apart(point: Point, segment: Segment) -> float:
    (x, y), ((a, b), (c, d)) = point, segment
    length = (c - a) ** 2 + (d - b) ** 2
    share = 0.0 if length == 0.0 else min(1.0, max(0.0, ((x - a) * (c - a) + (y - b) * (d - b)) / length))
    return _distance(point, (a + share * (c - a), b + share * (d - b)))


def _distance(one: Point, other: Point) -> float:
    return ((one[0] - other[0]) ** 2 + (one[1] - other[1]) ** 2) ** 0.5


def _within(point: Point, box: tuple[float, float, float, float]) -> bool:
    return box[0] <= point[0] <= box[2] and box[1] <= point[1] <= box[3]


def _inside(one: tuple[float, float, float, float], other: tuple[float, float, float, float]) -> bool:
    return _within(one[:2], other) and _within(one[2:], other)


def _overlap(one: tuple[float, float, float, float], other: tuple[float, float, float, float]) -> bool:
    return min(one[2], other[2]) - max(one[0], other[0]) > 1.0 and min(one[3], other[3]) - max(one[1], other[1]) > 1.0


def _meets(area: tuple[float, float, float, float], segment: Segment, margin: float) -> bool:
    (a, b), (c, d) = segment
    return max(min(a, c) - margin, area[0]) < min(max(a, c) + margin, area[2]) and max(
        min(b, d) - margin, area[1]
    ) < min(max(b, d) + margin, area[3])
