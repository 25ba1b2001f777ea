"""Symbols of measuring instruments: columns with hops, contacts, clamps, boxes, and ghosts of those that are removed."""

from bench.drawings.canvas import Layer, straight
from bench.drawings.leads import ARTIFICIAL_NEUTRAL, JOINT, LeadKind
from bench.drawings.lettering import width_of
from bench.drawings.palette import BODY, CHANNELS, GHOST, GHOST_DASHES, INK, PAPER, REFERENCE_DASHES
from bench.drawings.palette import TAKE_OFF as RED
from bench.drawings.sheet import PHASES, DrawingSheet
from bench.drawings.taps import Group, LeadColumn, Taps, what_to_do
from drivers.interfaces.role import ROLES
from drivers.interfaces.text import text
from procedures.core.bench import Role

CROSS = "M-9 -9L9 9M9 -9L-9 9"
GROUND = "M0 -8V-1M-8 -1H8M-5 3H5M-2 7H2"
_NEUTRAL = text("artificial neutral")


def draw_taps(sheet: DrawingSheet, taps: Taps) -> None:
    """Draw the resistors of the artificial neutral, every instrument and its columns."""
    _draw_neutral(sheet, taps)
    deep = 64.0
    if sheet.upright:
        deep = 50.0 + max([_width(sheet, group) for group in taps.groups], default=0.0)
    for group in taps.groups:
        below = group.below or sheet.upright
        edge, sign = (sheet.lowest + sheet.gap, 1.0) if below else (-sheet.gap, -1.0)
        _draw_box(sheet, group, edge, edge + sign * deep)
        for column in group.columns:
            if group.gone:
                _draw_ghost(sheet, column, edge, sign)
            else:
                _draw_column(sheet, column, edge, sign)
        _draw_parting(sheet, group, edge - sign * 54.0)


def _width(sheet: DrawingSheet, group: Group) -> float:
    name = width_of(sheet.say(ROLES[group.role].label), 18, bold=True)
    return max(name, width_of(_asked(sheet, group), 16, bold=True) if group.gone else 0.0)


def _asked(sheet: DrawingSheet, group: Group) -> str:
    return sheet.say(what_to_do(sheet, group.role, [lead for column in group.columns for lead in column.leads]))


def _draw_box(sheet: DrawingSheet, group: Group, edge: float, far: float) -> None:
    ink = GHOST if group.gone else INK
    sheet.canvas.box(
        Layer.BOX,
        (group.first, edge),
        (group.last, far),
        fill=PAPER if group.gone else BODY,
        edge=ink,
        dashes=GHOST_DASHES if group.gone else "",
    )
    # Beside the sockets, which reach into the box.
    aside = 16.0 if (far > edge) else -16.0
    x, y = sheet.canvas.page((group.first + group.last) / 2.0, (edge + aside + far) / 2.0)
    name = sheet.say(ROLES[group.role].label)
    if not group.gone:
        sheet.canvas.words(x, y, name, bold=True)
        return
    sheet.canvas.words(x, y - 10.0, name, bold=True, ink=GHOST)
    sheet.canvas.words(x, y + 11.0, _asked(sheet, group), size=16, bold=True, ink=RED)


def _draw_column(sheet: DrawingSheet, column: LeadColumn, edge: float, sign: float) -> None:
    lead, v = column.leads[0], sheet.v[column.node]
    reference, clamp = column.kind is LeadKind.REFERENCE, column.kind is LeadKind.CLAMP
    colour, dashes = CHANNELS.get(lead.socket, (INK, "")) if lead.role is Role.OSCILLOSCOPE else (INK, "")
    if reference:
        colour, dashes = INK, REFERENCE_DASHES
    way = sheet.column(column.u, edge, v + (20.0 * sign if clamp else 0.0), column.node)
    sheet.lead(Layer.LEAD, way, colour, dashes=dashes, new=sheet.new(column.leads))
    put_on = [lead for lead in column.leads if lead in sheet.difference.new]
    sheet.number(put_on, column.u, edge - sign * (18.0 + sheet.half_number(put_on)))
    if clamp:
        _draw_clamp(sheet, column.u, v, colour)
    else:
        sheet.canvas.disc(Layer.MARK, column.u, v, 6.5, fill=colour)
    beyond = v - sign * (36.0 if clamp else 24.0)
    for place, radius in ((edge, 16.0), (beyond, 13.0)):
        if reference:
            sheet.canvas.disc(Layer.MARK, column.u, place, radius)
            sheet.canvas.symbol(column.u, place, GROUND)
        elif lead.role is Role.OSCILLOSCOPE:
            sheet.mark(column.u, place, lead.socket, fill=colour, ink=PAPER, radius=radius)
        else:
            sheet.mark(column.u, place, lead.socket, radius=max(radius, 15.0))


def _draw_clamp(sheet: DrawingSheet, u: float, v: float, colour: str) -> None:
    sides = [
        ("C", ((u + s * 15.0, v - s * 20.0), (u + s * 15.0, v + s * 20.0), (u, v + s * 20.0))) for s in (1.0, -1.0)
    ]
    sheet.canvas.path(Layer.MARK, [("M", ((u, v - 20.0),)), *sides], colour, 5.0)
    arrow = straight((u + 14.0, v - 14.0), (u + 32.0, v - 14.0), (u + 25.0, v - 20.0))
    head = straight((u + 32.0, v - 14.0), (u + 25.0, v - 8.0))
    sheet.canvas.path(Layer.MARK, [*arrow, *head], colour)


def _draw_ghost(sheet: DrawingSheet, column: LeadColumn, edge: float, sign: float) -> None:
    end = edge - sign * 54.0 if column.node == JOINT else sheet.v[column.node]
    way = sheet.column(column.u, edge, end, column.node)
    sheet.lead(Layer.GHOST, way, GHOST, dashes=GHOST_DASHES)
    sheet.number(column.leads, column.u, edge - sign * (18.0 + sheet.half_number(column.leads)))
    if column.kind is LeadKind.REFERENCE:
        sheet.canvas.disc(Layer.MARK, column.u, edge, 16.0, edge=GHOST)
        sheet.canvas.symbol(column.u, edge, GROUND, ink=GHOST)
    else:
        sheet.mark(column.u, edge, column.leads[0].socket, ink=GHOST)
    if column.node != JOINT:
        _cross(sheet, column.u, end)


def _draw_parting(sheet: DrawingSheet, group: Group, v: float) -> None:
    """Draw where leads that were clipped together come apart."""
    ends = [column.u for column in group.columns if group.gone and column.node == JOINT]
    if ends:
        sheet.lead(Layer.GHOST, straight((ends[0], v), (ends[-1], v)), GHOST, dashes=GHOST_DASHES)
        _cross(sheet, (ends[0] + ends[-1]) / 2.0, v)


def _cross(sheet: DrawingSheet, u: float, v: float) -> None:
    sheet.canvas.symbol(u, v, CROSS, ink=PAPER, width=10.0)
    sheet.canvas.symbol(u, v, CROSS, ink=RED, width=4.5)


def _draw_neutral(sheet: DrawingSheet, taps: Taps) -> None:
    if not taps.resistors:
        return
    leads = [lead for lead in sheet.difference.leads if lead.node == ARTIFICIAL_NEUTRAL]
    new = bool(leads) and all(lead in sheet.difference.new for lead in leads)
    layer, ink, dashes = (Layer.LEAD, INK, "") if leads else (Layer.GHOST, GHOST, GHOST_DASHES)
    star = sheet.v[ARTIFICIAL_NEUTRAL]
    for node in PHASES:
        u = taps.resistors[node]
        sheet.lead(layer, sheet.column(u, star, sheet.v[node], node), ink, width=2.5, dashes=dashes, new=new)
        sheet.canvas.disc(Layer.MARK, u, sheet.v[node], 5.0, fill=ink, edge=ink)
        sheet.canvas.box(Layer.BOX, (u - 8.0, star - 40.0), (u + 8.0, star - 10.0), fill=PAPER, edge=ink, round_by=2.0)
    words = ("3 × 20 kΩ", sheet.say(_NEUTRAL))
    if sheet.upright:
        x, y, anchor = star + 18.0, taps.resistors["B"], "start"
    else:
        x, y, anchor = taps.resistors["A"] - 20.0, star - 4.0, "end"
    for number, line in enumerate(words):
        sheet.canvas.words(x, y - 8.0 + 20.0 * number, line, size=16, anchor=anchor, ink=ink)
