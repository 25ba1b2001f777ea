"""The drawing of the connections: instruments left, the motor right, wires in their colours between them."""

from collections.abc import Mapping, Sequence

from bench.drawings.canvas import INK, Canvas
from bench.drawings.colours import css_colour
from bench.drawings.instrument_symbols import SOCKET_X, draw_instruments, draw_lower
from bench.drawings.layout import Layout
from bench.drawings.motor_symbol import (
    HALL_Y,
    TERMINAL_X,
    TERMINAL_Y,
    draw_hall_connector,
    draw_motor,
    draw_remark,
    node_place,
)
from drivers.interfaces.text import Text, Translate, english, text
from procedures.core.actions import (
    Connect,
    ConnectProbes,
    ConnectVoltmeter,
    ConnectVoltmeterToSupply,
    CurrentProbe,
    Node,
    Socket,
    Terminal,
    VoltageProbe,
)
from procedures.core.nameplate import Nameplate

_WIDTH, _HEIGHT = 820, 520
_STAR = (380.0, 205.0)
_SUPPLY = {Node.SUPPLY_POSITIVE: Socket.SUPPLY_POSITIVE, Node.SUPPLY_NEGATIVE: Socket.SUPPLY_NEGATIVE}
#: Channels as oscilloscopes colour them, dark enough for paper.
_CHANNELS = {1: "#b28704", 2: "#2e7d32", 3: "#1565c0", 4: "#c2185b"}


def draw_connections(layout: Layout, nameplate: Nameplate, translate: Translate = english) -> str:
    """Return an SVG picture of what is to be connected, or is; words in the reader's language.

    Wires have the colours that the nameplate gives them and carry the colour's name, so that a print in black shows them.
    """
    canvas = Canvas(
        _WIDTH, _HEIGHT, text("Connections").render(translate), _description(layout, nameplate).render(translate)
    )
    terminals = layout.terminals or Connect({}).complete()
    used: list[Socket] = [socket for socket in terminals.values() if socket is not Socket.OPEN]
    if layout.leads_shorted:
        used = [Socket.METER_HIGH, Socket.METER_LOW]
        terminals = Connect({}).complete()
    if layout.voltmeter_on_supply or _nodes(layout) & _SUPPLY.keys():
        used = list(dict.fromkeys([*used, *_SUPPLY.values()]))
    sockets = draw_instruments(canvas, used, translate)
    if layout.leads_shorted:
        _shorted_leads(canvas, sockets, translate)
    star = _uses_star(layout)
    if star:
        _artificial_star(canvas, translate)
    for terminal, socket in terminals.items():
        colour = nameplate.wire_colours.get(terminal.value, "")
        if socket is Socket.OPEN:
            _open_end(canvas, terminal, colour, translate, bare=star)
        else:
            _wire(canvas, sockets[socket], terminal, colour, translate)
    draw_motor(canvas, nameplate.connection, name=nameplate.name)
    if any(node in HALL_Y for node in _nodes(layout)):
        draw_hall_connector(canvas, text("Hall sensors").render(translate))
    _probes(canvas, layout.probes, sockets, translate)
    if layout.voltmeter is not None:
        _voltmeter(canvas, [(TERMINAL_X, TERMINAL_Y[lead]) for lead in layout.voltmeter], translate)
    elif layout.voltmeter_on_supply:
        _voltmeter(canvas, [(SOCKET_X, sockets[socket]) for socket in _SUPPLY.values()], translate)
    for row, words in enumerate(_shaft(layout)):
        draw_remark(canvas, row, words.render(translate))
    return canvas.svg()


def _description(layout: Layout, nameplate: Nameplate) -> Text:
    lines: list[Text] = []
    if layout.terminals is not None:
        lines += Connect(layout.terminals).lines(nameplate.wire_colours)[1:]
    if layout.probes:
        lines += ConnectProbes(layout.probes).lines({})[1:]
    if layout.voltmeter is not None:
        lines += ConnectVoltmeter(*layout.voltmeter).lines({})
    if layout.voltmeter_on_supply:
        lines += ConnectVoltmeterToSupply().lines({})
    return Text("{lines}", {"lines": [*lines, *_shaft(layout)]})


def _shaft(layout: Layout) -> list[Text]:
    said = []
    if layout.rotor_locked:
        said.append(text("shaft locked"))
    if layout.dynamometer_coupled:
        said.append(text("coupled to the dynamometer"))
    return said


def _wire(canvas: Canvas, height: float, terminal: Terminal, colour: str, translate: Translate) -> None:
    y = TERMINAL_Y[terminal]
    start, end = SOCKET_X + 13.0, TERMINAL_X - 17.0
    canvas.wire(
        f"M {start:g} {height:g} C {start + 120:g} {height:g} {end - 170:g} {y:g} {end:g} {y:g}", css_colour(colour)
    )
    if colour:
        # On the outer side of the bend.
        aside = 18.0 if height < y - 1.0 else -18.0
        canvas.text(end - 100.0, y + aside, translate(colour), size=15)


def _open_end(canvas: Canvas, terminal: Terminal, colour: str, translate: Translate, *, bare: bool) -> None:
    y, end = TERMINAL_Y[terminal], TERMINAL_X - 17.0
    if bare:
        # The resistor of the artificial star leaves here; a loose end would cover it.
        return
    canvas.wire(f"M {end - 52:g} {y:g} L {end:g} {y:g}", css_colour(colour))
    canvas.line(f"M {end - 60:g} {y - 12:g} L {end - 60:g} {y + 12:g}", width=4)
    canvas.text(end - 70.0, y, text("open").render(translate), anchor="end", size=15)
    if colour:
        canvas.text(end - 28.0, y - 18.0, translate(colour), size=15)


def _shorted_leads(canvas: Canvas, sockets: dict[Socket, float], translate: Translate) -> None:
    start, x, y = SOCKET_X + 13.0, 340.0, 205.0
    for height in sockets.values():
        canvas.wire(f"M {start:g} {height:g} C {start + 90:g} {height:g} {x - 60:g} {y:g} {x:g} {y:g}", "#1a1a1a")
    canvas.circle(x, y, 9, fill=INK)
    canvas.text(x - 40.0, y + 95.0, text("leads clipped together").render(translate), size=15)


def _uses_star(layout: Layout) -> bool:
    return Node.ARTIFICIAL_STAR in _nodes(layout)


def _nodes(layout: Layout) -> set[Node]:
    """Return the nodes that voltage probes touch."""
    voltages = [probe for probe in layout.probes if isinstance(probe, VoltageProbe)]
    return {node for probe in voltages for node in (probe.positive, probe.negative)}


def _artificial_star(canvas: Canvas, translate: Translate) -> None:
    for terminal in Terminal:
        y = TERMINAL_Y[terminal]
        canvas.line(
            f"M {TERMINAL_X:g} {y:g} L {_STAR[0] + 80:g} {y:g} L {_STAR[0]:g} {y:g} L {_STAR[0]:g} {_STAR[1]:g}"
        )
        canvas.box(_STAR[0] + 24.0, y - 10.0, 52.0, 20.0)
    canvas.circle(*_STAR, 6, fill=INK)
    canvas.text(_STAR[0] - 14.0, _STAR[1], text("artificial star").render(translate), anchor="end", size=15)


def _place(node: Node, sockets: Mapping[Socket, float]) -> tuple[float, float]:
    if node in _SUPPLY:
        return SOCKET_X, sockets[_SUPPLY[node]]
    return node_place(node) or _STAR


def _probes(
    canvas: Canvas,
    probes: Sequence[VoltageProbe | CurrentProbe],
    sockets: Mapping[Socket, float],
    translate: Translate,
) -> None:
    if not probes:
        return
    marks = [str(probe.channel) for probe in probes]
    places = draw_lower(canvas, 290.0, text("Oscilloscope").render(translate), marks)
    for number, (probe, (x, y)) in enumerate(zip(probes, places, strict=True)):
        colour = _CHANNELS.get(probe.channel, INK)
        if isinstance(probe, CurrentProbe):
            _current_probe(canvas, probe, x, y - 13.0, colour)
            continue
        for node, dashed in ((probe.positive, False), (probe.negative, True)):
            end_x, end_y = _place(node, sockets)
            if node in HALL_Y:
                _to_pin(
                    canvas, (x + (5.0 if dashed else -5.0), y - 13.0), (end_x, end_y), number, colour, dashed=dashed
                )
                continue
            if node in _SUPPLY:
                _to_supply(
                    canvas, (x + (5.0 if dashed else -5.0), y - 13.0), (end_x, end_y), number, colour, dashed=dashed
                )
                continue
            # Each channel arrives from an angle of its own, its reference a little beside its tip.
            aside = 6.0 * number + (3.0 if dashed else 0.0)
            reach = 20.0 if node in (Node.A, Node.B, Node.C) else 7.0
            canvas.line(
                f"M {x + (5 if dashed else -5):g} {y - 13:g} C {x:g} {y - 80:g} {end_x - 60 + aside:g} {end_y + 90:g} "
                f"{end_x - 8 + aside:g} {end_y + reach:g}",
                width=3,
                colour=colour,
                dashed=dashed,
            )
    if any(isinstance(probe, VoltageProbe) for probe in probes):
        canvas.text(290.0, 512.0, text("solid: tip, dashed: reference").render(translate), anchor="start", size=13)


def _to_pin(
    canvas: Canvas,
    start: tuple[float, float],
    pin: tuple[float, float],
    number: int,
    colour: str,
    *,
    dashed: bool,
) -> None:
    """Draw a lead over the oscilloscope's edge and from the left to a connector's pin, each channel's at a height of its own."""
    x, y, aside = *start, 8.0 * number
    canvas.line(
        f"M {x:g} {y:g} C {x:g} {y - 45 + aside:g} {x + 20:g} {y - 45 + aside:g} {x + 45:g} {y - 45 + aside:g} "
        f"S {pin[0] - 70 + aside:g} {pin[1]:g} {pin[0] - 12:g} {pin[1]:g}",
        width=3,
        colour=colour,
        dashed=dashed,
    )


def _to_supply(
    canvas: Canvas,
    start: tuple[float, float],
    socket: tuple[float, float],
    number: int,
    colour: str,
    *,
    dashed: bool,
) -> None:
    """Draw a lead up and from the right to a socket of the supply, each channel's beside the others."""
    (x, y), (end_x, end_y), aside = start, socket, 9.0 * number
    canvas.line(
        f"M {x:g} {y:g} C {x:g} {y - 110:g} {end_x + 150 + aside:g} {end_y + aside:g} {end_x + 13:g} {end_y:g}",
        width=3,
        colour=colour,
        dashed=dashed,
    )


def _current_probe(canvas: Canvas, probe: CurrentProbe, x: float, y: float, colour: str) -> None:
    ring_x, ring_y = TERMINAL_X - 52.0, TERMINAL_Y[probe.terminal]
    canvas.line(
        f"M {x:g} {y:g} C {x:g} {y - 90:g} {ring_x:g} {ring_y + 110:g} {ring_x:g} {ring_y + 15:g}",
        width=3,
        colour=colour,
    )
    canvas.line(
        f"M {ring_x:g} {ring_y - 15:g} A 9 15 0 1 1 {ring_x:g} {ring_y + 15:g} A 9 15 0 1 1 {ring_x:g} {ring_y - 15:g}",
        width=4,
        colour=colour,
    )
    canvas.line(f"M {ring_x - 8:g} {ring_y + 24:g} l 22 0 l -7 -5 m 7 5 l -7 5", width=2, colour=colour)


def _voltmeter(canvas: Canvas, leads: Sequence[tuple[float, float]], translate: Translate) -> None:
    """Draw the voltmeter, and its leads to two places: of the motor's terminals, or of the supply's sockets."""
    places = draw_lower(canvas, 60.0, text("Voltmeter").render(translate), ["HI", "LO"])
    for (lead_x, lead_y), (x, y), dashed in zip(leads, places, (False, True), strict=True):
        end_y, bend = lead_y + 18.0, -130.0 if lead_x == TERMINAL_X else 40.0
        canvas.line(
            f"M {x:g} {y - 13:g} C {x:g} {y - 90:g} {lead_x + bend:g} {end_y + 70:g} {lead_x - 6:g} {end_y:g}",
            width=3,
            dashed=dashed,
        )
