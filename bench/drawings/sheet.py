"""What the parts of a drawing are drawn on: the canvas, the rails' places, what is connected and what changes."""

from collections.abc import Callable, Collection, Iterable
from dataclasses import dataclass, field

from bench.drawings.canvas import Canvas, Form, Layer, Place, Way
from bench.drawings.change import Change, Work
from bench.drawings.leads import ARTIFICIAL_NEUTRAL, JOINT, NODES, STAR_POINT, SUPPLY_OUTPUT, A, B, C, Lead
from bench.drawings.lettering import shortened, width_of
from bench.drawings.palette import HALO, INK, PAPER
from drivers.interfaces.text import Text
from procedures.core.nameplate import Nameplate

#: Distances: between phases, between minor rails, from the rails to the instruments, between columns, below the last phase.
RAIL, MINOR, GAP, SLOT, APART = 80.0, 46.0, 74.0, 54.0, 34.0
_HOP_HIGH, _HOP_WIDE = 13.0, 17.0
PHASES = (A, B, C)


@dataclass(frozen=True)
class Horizontal:
    """A line along u that columns of other nets hop over."""

    v: float
    first: float
    last: float
    net: object


@dataclass
class Sheet:
    """A drawing as it grows. `v` is where each node's rail lies, `strip` where the terminals stand, `end` the motor's left edge."""

    change: Change
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
        touched = {lead.node for lead in (*self.change.leads, *self.change.gone)}
        if touched & SUPPLY_OUTPUT.keys():
            touched |= SUPPLY_OUTPUT.keys()
        rail = self._between_phases()
        minor = [node for node in NODES if node in touched and node not in (*PHASES, JOINT)]
        self.v = {node: number * rail for number, node in enumerate(PHASES)}
        self.v |= {node: 2 * rail + APART + MINOR * number for number, node in enumerate(minor, 1)}

    @property
    def upright(self) -> bool:
        """Whether the motor's axis stands upright."""
        return self.form is Form.UPRIGHT

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
        return shortened(self.say(Text(name.replace("{", "{{").replace("}", "}}"))) if name else "")

    def new(self, leads: Collection[Lead]) -> bool:
        """Tell whether any of these leads is put on in this step."""
        return any(lead in self.change.new for lead in leads)

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
        numbers = sorted({self.change.numbers[one] for one in work if one in self.change.numbers})
        if not numbers:
            return
        joined = numbers == list(range(numbers[0], numbers[-1] + 1)) and len(numbers) > 2
        words = f"{numbers[0]}–{numbers[-1]}" if joined else " ".join(str(number) for number in numbers)
        x, y = self.canvas.page(u, v)
        half = max(13.0, width_of(words, 17, bold=True) / 2.0 + 6.0)
        (du, dv) = (13.0, half) if self.upright else (half, 13.0)
        self.canvas.box(Layer.MARK, (u - du, v - dv), (u + du, v + dv), fill=INK, edge=PAPER, round_by=13.0)
        self.canvas.words(x, y, words, size=17, bold=True, ink=PAPER)

    def _between_phases(self) -> float:
        """Return the distance of two phases; upright, their boxes stand side by side and want room for their colours."""
        if not self.upright:
            return RAIL
        return max(RAIL, *(2.0 * self.half_terminal(node) + 14.0 for node in PHASES))

    def half_terminal(self, node: str) -> float:
        """Return half the width of a terminal's box."""
        return max(29.0, width_of(self.colour_of(node), 16) / 2.0 + 6.0)


def is_minor(node: str) -> bool:
    """Tell whether a node is none of the three terminals."""
    return node not in PHASES


#: Nodes whose rails are no wire of the motor's: a column begins and ends them.
LOOSE = (ARTIFICIAL_NEUTRAL, STAR_POINT)
