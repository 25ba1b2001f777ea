from collections.abc import Iterable
from itertools import product
from xml.etree import ElementTree as Xml

import pytest
from hypothesis import given
from hypothesis import strategies as st

from bench.drawings.colours import UNKNOWN, css_colour
from bench.drawings.connections import draw_connections
from bench.drawings.layout import Layout
from bench.i18n.language import translator
from procedures.core.actions import (
    ALIGN_D,
    INVERTER,
    Action,
    Connect,
    ConnectProbes,
    ConnectVoltmeter,
    ConnectVoltmeterToSupply,
    CoupleDynamometer,
    CurrentProbe,
    DisconnectVoltmeter,
    LockRotor,
    Node,
    ReleaseRotor,
    SeparateMeterLeads,
    ShortMeterLeads,
    Socket,
    StartTurning,
    StopTurning,
    Terminal,
    UncoupleDynamometer,
    VoltageProbe,
)
from procedures.core.nameplate import Nameplate, WindingConnection
from procedures.core.setup import BenchSetup, metered, probed, wired
from procedures.core.setup_change import ChangeSetup

WYE = Nameplate("M1", WindingConnection.WYE, 2.0, wire_colours={"A": "white", "B": "green", "C": "black"})
DELTA = Nameplate("M1", WindingConnection.DELTA, 2.0)
STAR_PROBES = ConnectProbes(
    tuple(VoltageProbe(n, node, Node.ARTIFICIAL_STAR) for n, node in enumerate(list(Node)[:3], 1))
)
SVG = "{http://www.w3.org/2000/svg}"


def layout_after(actions: Iterable[Action]) -> Layout:
    layout = Layout()
    for action in actions:
        layout = layout.after(action)
    return layout


def parsed(svg: str) -> Xml.Element:
    return Xml.fromstring(svg)  # noqa: S314  made a line before, by ourselves


def words(svg: str) -> list[str]:
    return [element.text or "" for element in parsed(svg).iter(f"{SVG}text")]


def strokes(svg: str) -> list[str]:
    return [element.get("stroke", "") for element in parsed(svg).iter(f"{SVG}path")]


def test_layout_follows_the_actions() -> None:
    layout = layout_after(
        [
            ALIGN_D,
            STAR_PROBES,
            ConnectVoltmeter(Terminal.A, Terminal.B),
            LockRotor(),
            CoupleDynamometer(),
            ShortMeterLeads(),
        ]
    )
    assert layout == Layout(ALIGN_D.complete(), STAR_PROBES.probes, (Terminal.A, Terminal.B), False, True, True, True)
    assert layout.after(SeparateMeterLeads()).after(ReleaseRotor()).after(UncoupleDynamometer()) == Layout(
        ALIGN_D.complete(), STAR_PROBES.probes, (Terminal.A, Terminal.B)
    )
    assert layout.after(DisconnectVoltmeter()).voltmeter is None


def test_layout_follows_a_change_of_the_whole_setup() -> None:
    there = BenchSetup(rotor_locked=True, coupled=False).having(
        wired(ALIGN_D.terminals) | probed(STAR_PROBES.probes) | metered(Terminal.A, Terminal.B)
    )
    layout = Layout().after(ChangeSetup((), BenchSetup(), there))
    assert layout == Layout(ALIGN_D.complete(), STAR_PROBES.probes, (Terminal.A, Terminal.B), rotor_locked=True)
    on_supply = there.having(metered(Node.SUPPLY_POSITIVE, Node.SUPPLY_NEGATIVE))
    layout = layout.after(ChangeSetup((), there, on_supply))
    assert (layout.voltmeter, layout.voltmeter_on_supply, layout.probes) == (None, True, ())


@given(st.tuples(*[st.sampled_from(Socket)] * 3), st.booleans(), st.sampled_from([WYE, DELTA]))
def test_every_wire_is_drawn_and_told(sockets: tuple[Socket, ...], probes: bool, nameplate: Nameplate) -> None:
    layout = Layout().after(Connect(dict(zip(Terminal, sockets, strict=True))))
    if probes:
        layout = layout.after(ConnectProbes((VoltageProbe(1, Node.A, Node.B), CurrentProbe(4, Terminal.A))))
    svg = draw_connections(layout, nameplate)
    described = parsed(svg).findtext(f"{SVG}desc") or ""
    for line in Connect(dict(zip(Terminal, sockets, strict=True))).lines(nameplate.wire_colours)[1:]:
        assert str(line) in described
    assert words(svg).count("open") == sockets.count(Socket.OPEN)
    # A wire is its dark edge and its colour: two paths for each terminal.
    wires = [colour for terminal in "ABC" for colour in [css_colour(nameplate.wire_colours.get(terminal, ""))]]
    assert all(strokes(svg).count(colour) >= wires.count(colour) for colour in wires)


def test_wires_carry_their_colour_and_its_name() -> None:
    svg = draw_connections(Layout().after(INVERTER), WYE)
    assert {"white", "green", "black", "U", "V", "W", "Inverter"} <= set(words(svg))
    assert {css_colour("white"), css_colour("green")} <= set(strokes(svg))


def test_the_readers_language() -> None:
    svg = draw_connections(Layout().after(ALIGN_D).after(LockRotor()), WYE, translator("zh"))
    assert {"直流电源", "白", "绿", "黑", "轴已锁定"} <= set(words(svg))


def test_star_and_delta_differ_and_the_artificial_star_is_drawn() -> None:
    wye, delta = (draw_connections(Layout().after(INVERTER), plate) for plate in (WYE, DELTA))
    assert [e.get("d") for e in parsed(wye).iter(f"{SVG}path")] != [
        e.get("d") for e in parsed(delta).iter(f"{SVG}path")
    ]
    assert "artificial star" in words(draw_connections(Layout().after(Connect({})).after(STAR_PROBES), WYE))


@pytest.mark.parametrize("hostile", ['<script>alert("x")</script>', "red&<", '"onload="x'])
def test_names_are_words_never_markup(hostile: str) -> None:
    plate = Nameplate(hostile, WindingConnection.WYE, 2.0, wire_colours={"A": hostile})
    svg = draw_connections(Layout().after(ALIGN_D), plate)
    assert words(svg).count(hostile) == 2
    assert not list(parsed(svg).iter(f"{SVG}script"))


def test_colour_names() -> None:
    assert css_colour(" RD ") == css_colour("red")
    assert css_colour("mauve with stripes") == UNKNOWN
    assert len({css_colour(name) for name in ("red", "blue", "black", "white", "yellow", "green")}) == 6


def test_nothing_leaves_the_picture() -> None:
    for socket, node in product(Socket, Node):
        layout = Layout().after(Connect({Terminal.A: socket})).after(ConnectProbes((VoltageProbe(4, node, Node.C),)))
        for element in parsed(draw_connections(layout, WYE)).iter():
            for key, largest in (("x", 820.0), ("cx", 820.0), ("y", 520.0), ("cy", 520.0)):
                assert 0.0 <= float(element.get(key, 0.0)) <= largest


def test_hall_sensors_have_a_connector_of_their_own_when_they_are_probed():
    probes = ConnectProbes(
        (
            VoltageProbe(1, Node.A, Node.C),
            VoltageProbe(2, Node.HALL_1, Node.HALL_GROUND),
            VoltageProbe(3, Node.HALL_3, Node.HALL_GROUND),
        )
    )
    svg = draw_connections(layout_after([Connect({}), probes]), WYE)
    for pin in ("H1", "H2", "H3", "H0", "Hall sensors"):
        assert words(svg).count(pin) == 1
    without = draw_connections(layout_after([Connect({}), STAR_PROBES]), WYE)
    assert "Hall sensors" not in words(without)
    # A tip and a reference each, ending at their pins and nowhere beside them.
    ends = [element.get("d", "").split()[-2:] for element in parsed(svg).iter(f"{SVG}path")]
    assert ends.count(["600", "427"]) == 1
    assert ends.count(["600", "477"]) == 1
    assert ends.count(["600", "502"]) == 2


def test_who_turns_the_shaft_is_told_to_go_on_until_it_stops() -> None:
    assert layout_after([LockRotor(), StartTurning(0.2)]).shaft_turned
    assert not layout_after([StartTurning(0.2), StopTurning()]).shaft_turned


def test_probes_and_voltmeter_on_the_supplys_output_show_the_supply() -> None:
    layout = Layout().after(Connect({}))
    plain = draw_connections(layout, WYE)
    on_supply = layout.after(ConnectVoltmeterToSupply()).after(
        ConnectProbes((VoltageProbe(1, Node.SUPPLY_POSITIVE, Node.SUPPLY_NEGATIVE),))
    )
    drawn = draw_connections(on_supply, WYE)
    assert "DC supply" not in plain
    assert "DC supply" in drawn
    assert "tip on the supply" in drawn
    assert on_supply.after(DisconnectVoltmeter()).voltmeter_on_supply is False
