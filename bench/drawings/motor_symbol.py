"""The motor as it is drawn: rails in the wires' colours, terminals, windings, Hall sensors, frame."""

from bench.drawings.canvas import Layer, straight
from bench.drawings.colours import css_colour
from bench.drawings.leads import ARTIFICIAL_NEUTRAL, FRAME, HALL_PINS, STAR_POINT, SUPPLY_OUTPUT
from bench.drawings.lettering import width_of
from bench.drawings.palette import FLANGE, INK, PAPER
from bench.drawings.sheet import MOTOR_FRAME, OPEN, PHASES, DrawingSheet, Horizontal
from bench.drawings.sources import Sources, colour_of_source
from bench.drawings.tap_symbols import GROUND
from bench.drawings.taps import Taps
from drivers.interfaces.text import text
from procedures.core.bench import Role
from procedures.core.nameplate import WindingConnection

#: How long the motor's body is, and where its coils end.
BODY_LENGTH = 150.0
_COIL_FIRST, _COIL_STEP, _COIL_END = 28.0, 16.0, 118.0
_HALF_BOX = 26.0


def place_rails(sheet: DrawingSheet, sources: Sources, taps: Taps) -> None:
    """Put every node's rail among the lines that columns hop over."""
    for node, v in sheet.v.items():
        touching = [column.u for group in taps.groups for column in group.columns if column.node == node]
        first, last = sheet.strip, sheet.end
        if node == ARTIFICIAL_NEUTRAL:
            first, last = min([taps.resistors["A"], *touching]), max([taps.resistors["C"], *touching])
        elif node in SUPPLY_OUTPUT:
            last = max(touching, default=sheet.strip)
        elif node not in PHASES and node not in sources.fed:
            first = min(touching, default=sheet.end) - 30.0
        sheet.horizontals.append(Horizontal(v, first, last, node))


def draw_rails(sheet: DrawingSheet) -> None:
    """Draw the rails, the terminals' in their wires' colours with a dark edge."""
    for line in sheet.horizontals:
        if line.net not in sheet.v:
            continue
        node = str(line.net)
        way = straight((line.first, line.v), (line.last, line.v))
        if node in PHASES:
            sheet.canvas.path(Layer.RAIL, way, INK, 11.0)
            sheet.canvas.path(Layer.RAIL, way, css_colour(sheet.plate.wire_colours.get(node, "")), 7.0)
        elif node in SUPPLY_OUTPUT:
            sheet.canvas.path(Layer.RAIL, way, colour_of_source((Role.SUPPLY, SUPPLY_OUTPUT[node])), 5.0)
        else:
            sheet.canvas.path(Layer.RAIL, way, INK, 3.0)


def draw_motor(sheet: DrawingSheet, sources: Sources) -> None:
    """Draw body, windings, what is brought out of it, and the terminals."""
    u, low = sheet.end, sheet.low
    sheet.canvas.box(Layer.BOX, (u, -46.0), (u + BODY_LENGTH, low + 46.0), round_by=14.0)
    sheet.canvas.box(
        Layer.BOX, (u + BODY_LENGTH, -30.0), (u + BODY_LENGTH + 12.0, low + 30.0), fill=FLANGE, round_by=2.0
    )
    _draw_windings(sheet)
    _draw_brought_out(sheet)
    for node in PHASES:
        _draw_terminal(sheet, node, sources)
    if FRAME in sources.fed:
        _draw_frame_terminal(sheet)


def _draw_windings(sheet: DrawingSheet) -> None:
    u, v = sheet.end, [sheet.v[node] for node in PHASES]
    for place in v:
        bumps = []
        for number in range(4):
            a, b = u + _COIL_FIRST + _COIL_STEP * number, u + _COIL_FIRST + _COIL_STEP * (number + 1)
            bumps.append(("C", ((a, place - 17.0), (b, place - 17.0), (b, place))))
        way = [*straight((u, place), (u + _COIL_FIRST, place)), *bumps, ("L", ((u + _COIL_END, place),))]
        sheet.canvas.path(Layer.BOX, way)
    end = u + _COIL_END
    if sheet.plate.connection is WindingConnection.WYE:
        sheet.canvas.path(Layer.BOX, straight((end, v[0]), (end, v[2])))
        sheet.canvas.disc(Layer.BOX, end, v[1], 6.0, fill=INK)
        return
    # Delta: each winding's end goes to the beginning of the next.
    start = u + 14.0
    for first, following in ((v[0], v[1]), (v[1], v[2])):
        aside = (first + following) / 2.0 + 4.0
        sheet.canvas.path(Layer.BOX, straight((end, first), (end, aside), (start, aside), (start, following)))
    back = straight((end, v[2]), (end + 16.0, v[2]), (end + 16.0, -30.0), (start, -30.0), (start, v[0]))
    sheet.canvas.path(Layer.BOX, back)
    for place in v:
        sheet.canvas.disc(Layer.BOX, start, place, 4.5, fill=INK)


def _draw_brought_out(sheet: DrawingSheet) -> None:
    u, low = sheet.end, sheet.low
    halls = [sheet.v[pin] for pin in HALL_PINS if pin in sheet.v]
    if halls:
        words = sheet.say(text("Hall"))
        wide = width_of(words, 17, bold=True) + 20.0
        first, last, deep = halls[0] - 24.0, halls[-1] + 24.0, 108.0
        if sheet.upright:
            last = max(last, first + wide)
        else:
            deep = max(deep, 42.0 + wide)
        sheet.canvas.box(Layer.BOX, (u, first), (u + deep, last))
        x, y = sheet.canvas.page(u + (76.0 if sheet.upright else (deep + 42.0) / 2.0), (first + last) / 2.0)
        sheet.canvas.words(x, y, words, size=17, bold=True)
        for pin in HALL_PINS:
            if pin in sheet.v:
                sheet.canvas.words(*sheet.canvas.page(u + 24.0, sheet.v[pin]), pin, size=16, bold=True)
    if STAR_POINT in sheet.v:
        out = u + _COIL_END
        sheet.canvas.path(Layer.BOX, straight((u, sheet.v[STAR_POINT]), (out, sheet.v[STAR_POINT]), (out, low)))
        x, y = sheet.canvas.page(u + 22.0, sheet.v[STAR_POINT])
        sheet.canvas.words(*((x + 14.0, y) if sheet.upright else (x, y - 14.0)), STAR_POINT, size=16, bold=True)
    if FRAME in sheet.v:
        out, v = u + BODY_LENGTH / 2.0, sheet.v[FRAME]
        sheet.canvas.path(Layer.RAIL, straight((u, v), (out, v), (out, low + 46.0)))
        sheet.canvas.disc(Layer.MARK, out, low + 46.0, 6.5, fill=INK)


def _draw_terminal(sheet: DrawingSheet, node: str, sources: Sources) -> None:
    v, half = sheet.v[node], sheet.half_terminal(node)
    along, across = (_HALF_BOX, half) if sheet.upright else (half, _HALF_BOX)
    sheet.canvas.box(Layer.MARK, (sheet.strip - along, v - across), (sheet.strip + along, v + across), fill=PAPER)
    colour = sheet.colour_of(node)
    x, y = sheet.canvas.page(sheet.strip, v)
    sheet.canvas.words(x, y - (10.0 if colour else 0.0), node, size=24, bold=True)
    sheet.canvas.words(x, y + 14.0, colour, size=16)
    if node not in sources.fed:
        end = sheet.strip - along - 33.0
        sheet.canvas.path(Layer.LEAD, straight((sheet.strip - along, v), (end, v)))
        sheet.canvas.path(Layer.LEAD, straight((end, v - 11.0), (end, v + 11.0)))
        x, y = sheet.canvas.page(end - (14.0 if sheet.upright else 8.0), v)
        sheet.canvas.words(x, y, sheet.say(OPEN), size=16, anchor="middle" if sheet.upright else "end")


def _draw_frame_terminal(sheet: DrawingSheet) -> None:
    v, half = sheet.v[FRAME], sheet.half_terminal(FRAME)
    along, across = (_HALF_BOX, half) if sheet.upright else (half, _HALF_BOX)
    sheet.canvas.box(Layer.MARK, (sheet.strip - along, v - across), (sheet.strip + along, v + across), fill=PAPER)
    x, y = sheet.canvas.page(sheet.strip, v)
    sheet.canvas.symbol(sheet.strip, v, GROUND, lower=-9.0)
    sheet.canvas.words(x, y + 14.0, sheet.say(MOTOR_FRAME), size=16)
