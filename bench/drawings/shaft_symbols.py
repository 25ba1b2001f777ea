"""Symbols of the shaft's state: free, locked, turned by hand, coupled to the dynamometer, and this step's work on it."""

from dataclasses import dataclass

from bench.drawings.canvas import Layer, straight
from bench.drawings.difference import ShaftWork
from bench.drawings.layout import Layout
from bench.drawings.lettering import shortened, width_of
from bench.drawings.motor_symbol import BODY_LENGTH
from bench.drawings.palette import ACT, BODY, GHOST, GHOST_DASHES, HALO, INK, PAPER, SHAFT, STEEL, TAKE_OFF
from bench.drawings.sheet import DrawingSheet
from bench.drawings.tap_symbols import CROSS
from drivers.interfaces.role import ROLES
from drivers.interfaces.text import Text, text
from procedures.core.bench import Role

_PADLOCK = "M-7 -3V-10a7 7 0 0 1 14 0V-3M-11 -4H11V13H-11Z"
_HAND = (
    "M-16 8C-22 0 -26 -6 -20 -9C-16 -11 -12 -4 -9 -1V-27a5 5 0 0 1 10 0V-10V-32a5 5 0 0 1 10 0V-10V-28a5 5 0 0 1 10 0V-8"
    "V-20a4.5 4.5 0 0 1 9 0V8C30 24 20 30 8 30C-6 30 -10 18 -16 8Z"
)
_GAUGE = "M-24 14A28 28 0 1 1 24 14M24 14l9.5 -5.4M24 14v-11"
_JAWS, _COUPLING = 52.0, 64.0


@dataclass(frozen=True)
class ShaftState:
    """The shaft's state after the step, and the step's work on it."""

    locked: bool
    coupled: bool
    turned: bool
    work: frozenset[ShaftWork]

    @classmethod
    def of(cls, layout: Layout, work: frozenset[ShaftWork]) -> "ShaftState":
        """Return the shaft's state in a layout."""
        turned = layout.shaft_turned or ShaftWork.TURN in work
        return cls(layout.rotor_locked, layout.dynamometer_coupled, turned, work)

    def words(self) -> Text:
        """Say how the shaft is."""
        if self.locked:
            return text("shaft locked")
        if self.turned:
            return text("turn by hand")
        return text("coupled to the dynamometer") if self.coupled else text("shaft free")


def draw_shaft(sheet: DrawingSheet, state: ShaftState) -> None:
    """Draw the shaft, what is on it, the motor's name, and this step's work in a halo with its number."""
    u, v = sheet.end + BODY_LENGTH + 12.0, sheet.v["B"]
    jaws = state.locked or ShaftWork.FREE in state.work
    machine = state.coupled or ShaftWork.UNCOUPLE in state.work
    coupling = u + (_JAWS + 4.0 if jaws else 14.0)
    end = coupling + _COUPLING if state.coupled else u + 66.0
    sheet.canvas.box(Layer.BOX, (u, v - 9.0), (end, v + 9.0), fill=SHAFT, round_by=1.0)
    if jaws:
        _draw_jaws(sheet, u + 14.0, v, gone=not state.locked)
    if state.turned:
        _draw_hand(sheet, u, end, v)
    if machine:
        _draw_dynamometer(sheet, coupling, end if state.coupled else end + 34.0, v, gone=not state.coupled)
    _draw_words(sheet, state, u, v)
    _draw_work(sheet, state, u, end, v)


def _draw_words(sheet: DrawingSheet, state: ShaftState, u: float, v: float) -> None:
    name = shortened(sheet.plate.name)
    message = "" if state.coupled and not state.locked else sheet.say(state.words())
    if sheet.upright:
        sheet.canvas.words(v + 66.0, u + 16.0, name, bold=True, anchor="start")
        sheet.canvas.words(v + 66.0, u + 42.0, message, size=17, anchor="start")
    else:
        sheet.canvas.words(u + 12.0, v - 116.0, name, bold=True, anchor="start")
        sheet.canvas.words(u + 12.0, v + 82.0, message, size=17, anchor="start")


def _draw_jaws(sheet: DrawingSheet, u: float, v: float, *, gone: bool) -> None:
    for side in (-46.0, 10.0):
        corners = (u, v + side), (u + 34.0, v + side + 36.0)
        if gone:
            sheet.canvas.box(Layer.BOX, *corners, fill="none", edge=GHOST, dashes=GHOST_DASHES, round_by=2.0)
            continue
        sheet.canvas.box(Layer.BOX, *corners, fill=STEEL, round_by=2.0)
        for k in (4.0, 13.0, 22.0):
            sheet.canvas.path(Layer.BOX, straight((u + k, v + side + 32.0), (u + k + 8.0, v + side + 4.0)), PAPER, 2.0)
    if gone:
        sheet.canvas.symbol(u + 17.0, v, CROSS, ink=PAPER, width=10.0)
        sheet.canvas.symbol(u + 17.0, v, CROSS, ink=TAKE_OFF, width=4.5)
    else:
        sheet.canvas.symbol(u + 17.0, v, _PADLOCK, fill=PAPER)


def _draw_hand(sheet: DrawingSheet, u: float, end: float, v: float) -> None:
    hand = end + (22.0 if sheet.upright else 26.0)
    sheet.canvas.symbol(hand, v, _HAND, fill=PAPER, lower=6.0)
    x, y = sheet.canvas.page(hand, v)
    sheet.canvas.reach(x - 28.0, y - 34.0, x + 34.0, y + 40.0)
    arc = [("M", ((u + 22.0, v - 36.0),)), ("C", ((u + 54.0, v - 32.0), (u + 54.0, v + 32.0), (u + 22.0, v + 36.0)))]
    head = straight((u + 36.0, v + 22.0), (u + 21.0, v + 36.0), (u + 38.0, v + 43.0))
    sheet.canvas.path(Layer.MARK, [*arc, *head], ACT, 5.0)


def _draw_dynamometer(sheet: DrawingSheet, coupling: float, u: float, v: float, *, gone: bool) -> None:
    ink, dashes = (GHOST, GHOST_DASHES) if gone else (INK, "")
    if not gone:
        for half in (0.0, 23.0):
            corners = (coupling + half, v - 26.0), (coupling + half + 19.0, v + 26.0)
            sheet.canvas.box(Layer.BOX, *corners, fill=STEEL, round_by=3.0)
    name = sheet.say(ROLES[Role.DYNAMOMETER].label)
    wide = max(132.0, width_of(name, 17, bold=True) + 20.0)
    across, along = (wide / 2.0, 116.0) if sheet.upright else (66.0, wide)
    fill = PAPER if gone else BODY
    sheet.canvas.box(
        Layer.BOX, (u, v - across), (u + along, v + across), fill=fill, edge=ink, dashes=dashes, round_by=14
    )
    x, y = sheet.canvas.page(u + along / 2.0, v)
    sheet.canvas.words(x, y - 38.0, name, size=17, bold=True, ink=ink)
    if gone:
        sheet.canvas.words(x, y, sheet.say(text("take off")), size=16, bold=True, ink=TAKE_OFF)
        return
    sheet.canvas.words(x, y + 18.0, "M", size=22, bold=True)
    sheet.canvas.symbol(u + along / 2.0, v, _GAUGE, lower=18.0)


def _draw_work(sheet: DrawingSheet, state: ShaftState, u: float, end: float, v: float) -> None:
    """Draw a halo round what is new, and the numbers of what is done."""
    if not state.work:
        return
    new = state.work & {ShaftWork.LOCK, ShaftWork.COUPLE, ShaftWork.TURN}
    if new:
        last = end if ShaftWork.COUPLE in new else u + _JAWS + 6.0
        sheet.canvas.box(Layer.HALO, (u + 2.0, v - 54.0), (last, v + 54.0), fill=HALO, edge=HALO)
    ordered = sorted(state.work, key=lambda work: sheet.difference.numbers[work])
    for place, work in enumerate(ordered):
        sheet.number([work], u + 31.0 + 30.0 * place, v - 68.0)
