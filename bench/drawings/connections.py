"""The drawing of the connections: what feeds at one end, the motor at the other, what measures on columns between them."""

from collections.abc import Collection, Iterable, Sequence
from dataclasses import dataclass
from functools import reduce

from bench.drawings.canvas import Form
from bench.drawings.difference import Work, difference_of
from bench.drawings.layout import Layout
from bench.drawings.motor_symbol import draw_motor, draw_rails, place_rails
from bench.drawings.shaft_symbols import ShaftState, draw_shaft
from bench.drawings.sheet import DrawingSheet
from bench.drawings.sources import draw_sources, place_sources
from bench.drawings.tap_symbols import draw_taps
from bench.drawings.taps import place_taps
from bench.drawings.told import told
from drivers.interfaces.text import Translate, english, text
from procedures.core.actions import STEP_NEGATIVE, CurrentProbe, Node, Terminal, VoltageProbe, meter_across
from procedures.core.nameplate import Nameplate

_MARGIN = 12.0


@dataclass(frozen=True)
class Scene:
    """The content of one drawing: the connections, those before if they are to be changed, and the instruction's lines.

    `lines` holds what each line of the instruction tells, in their order; `by_hand` where the shaft is turned by hand now.
    """

    layout: Layout
    before: Layout | None = None
    lines: Sequence[Collection[Work]] = ()
    by_hand: bool = False


@dataclass(frozen=True)
class Extents:
    """The extents of several drawings, so that they keep the motor in its place: the terminals' u, the motor's u, the area."""

    strip: float
    end: float
    area: tuple[float, float, float, float]

    def union(self, other: "Extents") -> "Extents":
        """Return the extents that hold both."""
        (a, b, c, d), (e, f, g, h) = self.area, other.area
        return Extents(
            max(self.strip, other.strip), max(self.end, other.end), (min(a, e), min(b, f), max(c, g), max(d, h))
        )


@dataclass(frozen=True)
class Drawing:
    """A picture as SVG, and its extents: the next drawing of the procedure takes them, so that the motor stays where it is."""

    svg: str
    extents: Extents


def draw_connections(
    layout: Layout,
    nameplate: Nameplate,
    translate: Translate = english,
    *,
    before: Layout | None = None,
    lines: Sequence[Collection[Work]] = (),
    by_hand: bool = False,
    form: Form = Form.WIDE,
    extents: Extents | None = None,
) -> str:
    """Return an SVG picture of what is to be connected, or is; words in the reader's language.

    With `before` what changes stands out: new leads in a halo, what comes off as a ghost, each with the number of the line
    that tells it (see `difference_of`). Wires have the colours that the nameplate gives them and carry the colour's name, so that
    a print in black shows them. `extents` keep the motor where other drawings of the procedure have it (see `extents_of`).
    """
    return draw(Scene(layout, before, lines, by_hand), nameplate, translate, form=form, extents=extents).svg


def draw(
    scene: Scene,
    nameplate: Nameplate,
    translate: Translate = english,
    *,
    form: Form = Form.WIDE,
    extents: Extents | None = None,
) -> Drawing:
    """Return the drawing of a scene, as `draw_connections` makes it."""
    sheet = _drawn(scene, nameplate, translate, form, extents)
    own = Extents(sheet.strip, sheet.end, _area(sheet))
    whole = own if extents is None else own.union(extents)
    messages = [line.render(translate) for line in told(scene.layout, nameplate)]
    return Drawing(sheet.canvas.svg(whole.area, text("Connections").render(translate), messages), whole)


def extents_of(
    scenes: Iterable[Scene], nameplate: Nameplate, translate: Translate = english, form: Form = Form.WIDE
) -> Extents | None:
    """Return the extents that hold all of these scenes with the motor in one place; None for no scene."""
    kept, extents = list(scenes), None
    # Terminals further on push the motor on, which pushes the shaft on.
    for _ in range(3 if kept else 0):
        sheets = [_drawn(scene, nameplate, translate, form, extents) for scene in kept]
        extents = reduce(Extents.union, [Extents(sheet.strip, sheet.end, _area(sheet)) for sheet in sheets])
    return extents


def standing_extents(nameplate: Nameplate, translate: Translate, form: Form) -> Extents | None:
    """Return the extents that most procedures need: a meter off, the supply and two probes on. None upright, where length is dear."""
    if form is Form.UPRIGHT:
        return None
    probes = (VoltageProbe(1, Node.A, Node.B), CurrentProbe(4, Terminal.A))
    usual = Layout(STEP_NEGATIVE.complete(), probes)
    meter = Layout(meter_across(Terminal.A, Terminal.B).complete())
    return extents_of([Scene(usual, meter)], nameplate, translate, form)


def _drawn(
    scene: Scene, nameplate: Nameplate, translate: Translate, form: Form, extents: Extents | None
) -> DrawingSheet:
    difference = difference_of(scene.before, scene.layout, scene.lines, by_hand=scene.by_hand)
    sheet = DrawingSheet(difference, nameplate, lambda words: words.render(translate), form)
    sources = place_sources(sheet)
    if extents is not None:
        sheet.strip, sheet.end = max(sheet.strip, extents.strip), extents.end
    taps = place_taps(sheet)
    place_rails(sheet, sources, taps)
    draw_sources(sheet, sources)
    draw_rails(sheet)
    draw_taps(sheet, taps)
    draw_motor(sheet, sources)
    draw_shaft(sheet, ShaftState.of(scene.layout, difference.shaft))
    return sheet


def _area(sheet: DrawingSheet) -> tuple[float, float, float, float]:
    canvas = sheet.canvas
    return canvas.left - _MARGIN, canvas.top - _MARGIN, canvas.right + _MARGIN, canvas.bottom + _MARGIN
