"""The motor as it is drawn: three terminals, the windings behind them in star or delta, and the Hall sensors' connector."""

import math

from bench.drawings.canvas import FAINT, Canvas
from procedures.core.actions import Node, Terminal
from procedures.core.nameplate import WindingConnection

#: Where the terminals stand.
TERMINAL_X = 520.0
TERMINAL_Y = {Terminal.A: 100.0, Terminal.B: 205.0, Terminal.C: 310.0}
_CENTRE = (665.0, 205.0)
#: Pins of the Hall sensors' connector, from above: where they stand.
HALL_X = 612.0
HALL_Y = {Node.HALL_1: 427.0, Node.HALL_2: 452.0, Node.HALL_3: 477.0, Node.HALL_GROUND: 502.0}
_HALL_WIDTH = 150.0
_BODY = 122.0
_REACH = 74.0
_BUMPS = 4
_ANGLES = {Terminal.A: -90.0, Terminal.B: 150.0, Terminal.C: 30.0}
#: Outer ends of the windings; so placed that no lead crosses another.
_CORNERS = {
    terminal: (
        _CENTRE[0] + _REACH * math.cos(math.radians(angle)),
        _CENTRE[1] + _REACH * math.sin(math.radians(angle)),
    )
    for terminal, angle in _ANGLES.items()
}


def node_place(node: Node) -> tuple[float, float] | None:
    """Return where a probe touches a node of the motor; None for one that is no part of it."""
    if node is Node.STAR_POINT:
        return _CENTRE
    if node in HALL_Y:
        return HALL_X, HALL_Y[node]
    if node.value not in [terminal.value for terminal in Terminal]:
        return None
    return TERMINAL_X, TERMINAL_Y[Terminal(node.value)]


def draw_motor(canvas: Canvas, connection: WindingConnection, *, name: str) -> None:
    """Draw body, windings, terminals and the motor's name."""
    canvas.circle(*_CENTRE, _BODY, fill=FAINT)
    for terminal, corner in _CORNERS.items():
        canvas.line(f"M {TERMINAL_X:g} {TERMINAL_Y[terminal]:g} L {corner[0]:g} {corner[1]:g}")
    if connection is WindingConnection.WYE:
        for corner in _CORNERS.values():
            canvas.line(_coil(corner, _CENTRE), width=3)
        canvas.circle(*_CENTRE, 4, fill="#20262b")
    else:
        places = list(_CORNERS.values())
        for first, second in zip(places, [*places[1:], places[0]], strict=True):
            canvas.line(_coil(first, second), width=3)
    for terminal, y in TERMINAL_Y.items():
        canvas.circle(TERMINAL_X, y, 17)
        canvas.text(TERMINAL_X, y, terminal.value, size=20, bold=True)
    canvas.text(_CENTRE[0], _CENTRE[1] + _BODY + 22, name, bold=True)


def draw_hall_connector(canvas: Canvas, name: str) -> None:
    """Draw the Hall sensors' connector below the motor, with its name."""
    heights = list(HALL_Y.values())
    canvas.box(HALL_X, heights[0] - 15.0, _HALL_WIDTH, heights[-1] - heights[0] + 30.0, fill=FAINT)
    canvas.text(HALL_X + 0.5 * _HALL_WIDTH + 10.0, 0.5 * (heights[0] + heights[-1]), name, size=15, bold=True)
    for node, y in HALL_Y.items():
        canvas.circle(HALL_X, y, 12)
        canvas.text(HALL_X, y, node.value, size=12, bold=True)


def draw_remark(canvas: Canvas, row: int, words: str) -> None:
    """Write what holds for the shaft below the motor's name, line by line from 0."""
    canvas.text(_CENTRE[0], _CENTRE[1] + _BODY + 46 + 22 * row, words)


def _coil(start: tuple[float, float], end: tuple[float, float]) -> str:
    """Return a path of half circles between two points, with a straight piece at either end."""
    dx, dy = end[0] - start[0], end[1] - start[1]
    step = 0.64 / _BUMPS
    radius = math.hypot(dx, dy) * step / 2.0

    def at(share: float) -> str:
        return f"{start[0] + share * dx:.1f} {start[1] + share * dy:.1f}"

    bumps = " ".join(f"A {radius:.1f} {radius:.1f} 0 0 1 {at(0.18 + step * (n + 1))}" for n in range(_BUMPS))
    return f"M {at(0.0)} L {at(0.18)} {bumps} L {at(1.0)}"
