"""Instruments as they are drawn: a box with the sockets that are in use."""

from collections.abc import Sequence

from bench.drawings.canvas import FAINT, Canvas
from bench.drawings.motor_symbol import TERMINAL_Y
from drivers.interfaces.text import Text, Translate, text
from procedures.core.actions import Socket, Terminal

#: Right edge of the instruments on the left side.
SOCKET_X = 200.0
_LEFT = 30.0
_PAIR = (140.0, 270.0)
_TRIPLE = tuple(TERMINAL_Y[terminal] for terminal in Terminal)

_INSTRUMENTS: tuple[tuple[Text, tuple[tuple[Socket, str], ...]], ...] = (
    (text("DC supply"), ((Socket.SUPPLY_POSITIVE, "+"), (Socket.SUPPLY_NEGATIVE, "−"))),
    (text("LCR meter"), ((Socket.METER_HIGH, "H"), (Socket.METER_LOW, "L"))),
    (text("Inverter"), ((Socket.INVERTER_U, "U"), (Socket.INVERTER_V, "V"), (Socket.INVERTER_W, "W"))),
    (text("Six-step drive"), ((Socket.DRIVE_1, "1"), (Socket.DRIVE_2, "2"), (Socket.DRIVE_3, "3"))),
    (text("Insulation tester"), ((Socket.INSULATION_HIGH, "H"),)),
)


def draw_instruments(canvas: Canvas, used: Sequence[Socket], translate: Translate) -> dict[Socket, float]:
    """Draw the instruments whose sockets are used, and return the height of each socket on SOCKET_X."""
    chosen = [(name, sockets) for name, sockets in _INSTRUMENTS if any(socket in used for socket, _ in sockets)]
    places: dict[Socket, float] = {}
    for number, (name, sockets) in enumerate(chosen):
        heights = _heights(len(sockets), number, len(chosen))
        top, bottom = heights[0] - 58.0, heights[-1] + 34.0
        canvas.box(_LEFT, top, SOCKET_X - _LEFT, bottom - top, fill=FAINT)
        canvas.text((_LEFT + SOCKET_X) / 2.0, top + 22.0, name.render(translate), bold=True)
        for (socket, mark), height in zip(sockets, heights, strict=True):
            canvas.circle(SOCKET_X, height, 13)
            canvas.text(SOCKET_X, height, mark, size=17, bold=True)
            places[socket] = height
    return places


def _heights(sockets: int, number: int, instruments: int) -> tuple[float, ...]:
    if instruments == 1:
        return {1: _TRIPLE[1:2], 2: _PAIR}.get(sockets, _TRIPLE)
    # Two or more share the side: each gets its part of it.
    room = 320.0 / instruments
    top = 70.0 + room * number
    return tuple(top + index * (room - 92.0) / max(sockets - 1, 1) for index in range(sockets))


def draw_lower(canvas: Canvas, left: float, name: str, sockets: Sequence[str]) -> list[tuple[float, float]]:
    """Draw an instrument below the wires, and return the places of its sockets on its upper edge."""
    width, top = 60.0 + 46.0 * len(sockets), 440.0
    canvas.box(left, top, width, 62.0, fill=FAINT)
    canvas.text(left + width / 2.0, top + 44.0, name, bold=True)
    places = [(left + 53.0 + 46.0 * index, top) for index in range(len(sockets))]
    for (x, y), mark in zip(places, sockets, strict=True):
        canvas.circle(x, y, 13)
        canvas.text(x, y, mark, size=16, bold=True)
    return places
