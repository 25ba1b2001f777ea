"""The sheet that the parts of a drawing share: the canvas, the rails' places, the connections and their changes."""

from collections.abc import Callable, Collection, Iterable
from dataclasses import dataclass, field

from bench.drawings.canvas import Canvas, Form, Layer, Place, Way
from bench.drawings.difference import LayoutDifference, Work
from bench.drawings.leads import FRAME, JOINT, NODES, A, B, C, Lead
from bench.drawings.lettering import shortened, width_of
from bench.drawings.palette import HALO, INK, PAPER
from drivers.interfaces.text import Text, text, word
from procedures.core.nameplate import Nameplate

#: Distances: between phases, between minor rails, from the rails to the instruments, between columns, below the last phase.
RAIL, MINOR, GAP, SLOT, APART = 80.0, 46.0, 74.0, 54.0, 34.0
_HOP_HIGH, _HOP_WIDE = 13.0, 17.0
PHASES = (A, B, C)
OPEN = text("open")
MOTOR_FRAME = text("motor frame")


@dataclass(frozen=True)
class Horizontal:
    """A line along u that columns of other nets hop over."""

    v: float
    first: float
    last: float
    net: object


@dataclass
class DrawingSheet:
    """A drawing as it grows. `v` is where each node's rail lies, `strip` where the terminals stand, `end` the motor's left edge."""

    difference: LayoutDifference
    plate: Nameplate
    say: Callable[[Text], str]
    form: Form
    canvas: Canvas = field(init=False)
    v: dict[str, float] = field(init=False)
    horizontals: list[Horizontal] = field(default_factory=list)
    strip: float = 0.0
    end: float = 0.0

    def __post_init__(self) -> None:
        self.canvas = Canvas(self.form)
        touched = {lead.node for lead in (*self.difference.leads, *self.difference.gone)}
        rail = self._between_phases()
        minor = [node for node in NODES if node in touched and node not in (*PHASES, JOINT)]
        self.v = {node: number * rail for number, node in enumerate(PHASES)}
        v = 2 * rail + APART
        for node in minor:
            v += self._room_of_frame() if node == FRAME else MINOR
            self.v[node] = v

    @property
    def upright(self) -> bool:
        """True if the motor's axis stands upright."""
        return self.form is Form.UPRIGHT

    @property
    def gap(self) -> float:
        """The distance from the rails to what measures; upright, numbers stand beside each other in it."""
        return GAP + (10.0 if self.upright else 0.0)

    @property
    def low(self) -> float:
        """The v of the last phase's rail."""
        return self.v[C]

    @property
    def lowest(self) -> float:
        """The v of the last rail."""
        return max(self.v.values())

    def colour_of(self, node: str) -> str:
        """Return what the motor's file calls the wire of a terminal, in the reader's language; cut where it has no room."""
        name = self.plate.wire_colours.get(node, "")
        return shortened(self.say(word(name)) if name else "")

    def new(self, leads: Collection[Lead]) -> bool:
        """Tell whether any of these leads is put on in this step."""
        return any(lead in self.difference.new for lead in leads)

    def lead(
        self, layer: Layer, way: Way, colour: str, *, width: float = 3.5, dashes: str = "", new: bool = False
    ) -> None:
        """Draw a lead on its edge of paper, in a halo where it is new."""
        if new:
            self.canvas.path(Layer.HALO, way, HALO, 21.0)
        self.canvas.path(layer, way, HALO if new else PAPER, width + 5.0)
        self.canvas.path(layer, way, colour, width + (1.5 if new else 0.0), dashes)

    def column(self, u: float, first: float, last: float, net: object) -> Way:
        """Return the way across from v to v that hops over every horizontal of another net."""
        sign = 1.0 if last > first else -1.0
        low, high = min(first, last), max(first, last)
        crossed = {
            line.v
            for line in self.horizontals
            if line.net != net and line.first < u < line.last and low < line.v < high
        }
        way: list[tuple[str, tuple[Place, ...]]] = [("M", ((u, first),))]
        for v in sorted(crossed, reverse=sign < 0.0):
            before, after = v - _HOP_HIGH * sign, v + _HOP_HIGH * sign
            way.append(("L", ((u, before),)))
            way.append(("C", ((u + _HOP_WIDE, before), (u + _HOP_WIDE, after), (u, after))))
        return [*way, ("L", ((u, last),))]

    def mark(self, u: float, v: float, word: str, *, fill: str = PAPER, ink: str = INK, radius: float = 16.0) -> None:
        """Draw a disc with a word of one or two letters."""
        self.canvas.disc(Layer.MARK, u, v, radius, fill=fill)
        self.canvas.words(*self.canvas.page(u, v), word, size=18 if len(word) == 1 else 16, bold=True, ink=ink)

    def number(self, work: Iterable[Work], u: float, v: float) -> None:
        """Draw the numbers of the lines that tell this work, where it is any."""
        words = self._numbers(work)
        if not words:
            return
        along, across = 13.0, 13.0
        if self.upright:
            across = self._half(words)
        else:
            along = self._half(words)
        self.canvas.box(
            Layer.MARK, (u - along, v - across), (u + along, v + across), fill=INK, edge=PAPER, round_by=13.0
        )
        self.canvas.words(*self.canvas.page(u, v), words, size=17, bold=True, ink=PAPER)

    def half_number(self, work: Iterable[Work]) -> float:
        """Return how far the mark with these numbers reaches across the axis from its middle."""
        return self._half(self._numbers(work)) if self.upright else 13.0

    def _numbers(self, work: Iterable[Work]) -> str:
        numbers = sorted({self.difference.numbers[one] for one in work if one in self.difference.numbers})
        if len(numbers) > 2 and numbers == list(range(numbers[0], numbers[-1] + 1)):
            return f"{numbers[0]}–{numbers[-1]}"
        return " ".join(str(number) for number in numbers)

    def _half(self, words: str) -> float:
        return max(13.0, width_of(words, 17, bold=True) / 2.0 + 6.0)

    def _between_phases(self) -> float:
        """Return the distance of two phases; upright, their boxes stand side by side and want room for their colours."""
        if not self.upright:
            return RAIL
        return max(RAIL, *(2.0 * self.half_terminal(node) + 14.0 for node in PHASES))

    def _room_of_frame(self) -> float:
        """Return the distance to the frame's rail: it has a box as the terminals have."""
        return max(76.0, self.half_terminal(FRAME) + self.half_terminal(C) + 10.0) if self.upright else 76.0

    def half_terminal(self, node: str) -> float:
        """Return half the width of a terminal's or the frame's box."""
        words = self.say(MOTOR_FRAME) if node == FRAME else self.colour_of(node)
        return max(29.0, width_of(words, 16) / 2.0 + 6.0)
