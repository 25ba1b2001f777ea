import re
from collections.abc import Iterable

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from bench.drawings.canvas import Form
from bench.drawings.colours import UNKNOWN, css_colour
from bench.drawings.connections import Scene, draw, draw_connections, extents_of, standing_extents
from bench.drawings.difference import SOURCES, ShaftWork, difference_of
from bench.drawings.layout import Layout
from bench.drawings.leads import FRAME, JOINT, Lead, LeadKind, leads_of
from bench.drawings.lettering import width_of
from bench.drawings.palette import HALO
from bench.i18n.language import translator
from drivers.interfaces.role import ROLES
from drivers.interfaces.text import Text, Translate
from procedures.core.actions import (
    ALIGN_D,
    ALL_OPEN,
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
    meter_across,
    phases_on,
)
from procedures.core.bench import Role
from procedures.core.nameplate import Nameplate, WindingConnection
from procedures.core.setup import BenchSetup, metered, probed, wired
from procedures.core.setup_change import ChangeSetup
from reports.fonts import FOLDER
from tests.bench.drawings.picture import SVG, Picture
from tests.bench.drawings.scenes import DELTA, WYE, every_scene

ENGLISH, CHINESE = translator("en"), translator("zh")
STAR_PROBES = ConnectProbes(phases_on((1, 2, 3)))
STEP_PROBES = ConnectProbes((VoltageProbe(1, Node.A, Node.B), CurrentProbe(4, Terminal.A)))
NAMES = {spec.label.render(): role.value for role, spec in ROLES.items()}


def both(words: Text | str) -> str:
    """Say it as a report in two languages does, the widest that a label can be."""
    return f"{ENGLISH(words)} {CHINESE(words)}"


def layout_after(actions: Iterable[Action]) -> Layout:
    layout = Layout()
    for action in actions:
        layout = layout.after(action)
    return layout


def drawn(scene: Scene, plate: Nameplate, form: Form, translate: Translate = ENGLISH) -> Picture:
    return Picture(
        draw_connections(
            scene.layout, plate, translate, before=scene.before, lines=scene.lines, by_hand=scene.by_hand, form=form
        )
    )


def told(layout: Layout) -> set[tuple[str, str, str]]:
    """Return what is connected to which node; a source's socket on two terminals joins them."""
    leads = leads_of(layout)
    same: dict[str, set[str]] = {}
    for lead in leads:
        if lead.kind is LeadKind.CLIP and lead.role in (Role.SUPPLY, Role.LCR_METER, Role.INSULATION_TESTER):
            joined = {o.node for o in leads if (o.role, o.socket) == (lead.role, lead.socket)}
            same[lead.node] = joined
    # The supply's sockets are nodes themselves.
    for sign in ("+", "-"):
        fed = {lead.node for lead in leads if lead.role is Role.SUPPLY and lead.socket.replace("−", "-") == sign}
        for node in (*fed, f"S{sign}"):
            same[node] = fed | {f"S{sign}"}
    # So does the shorting link: whatever is on one of its terminals is on all.
    linked = {lead.node for lead in leads if lead.role is Role.SWITCH_MATRIX}
    for node in linked:
        same[node] = same.get(node, set()) | linked
    found = set()
    # The link is copper and no instrument: what it joins is seen by what is on its terminals.
    for lead in (each for each in leads if each.role is not Role.SWITCH_MATRIX):
        socket = "⏚" if lead.kind is LeadKind.REFERENCE else lead.socket
        found |= {(lead.role.value, socket, node) for node in same.get(lead.node, set()) | {lead.node}}
    return {(role, socket, node) for role, socket, node in found if (role, node[:1]) != ("supply", "S")}


@pytest.fixture(scope="module")
def scenes() -> list[Scene]:
    return every_scene()


@pytest.mark.slow
def test_every_procedures_hand_work_is_drawn_by_the_rules(scenes: list[Scene]) -> None:
    """No label meets a lead, nothing crosses without a hop, no marks overlap, leads drawn are leads told."""
    seen = {lead for scene in scenes for lead in leads_of(scene.layout)}
    assert {lead.role for lead in seen} == {*SOURCES, Role.VOLTMETER, Role.OSCILLOSCOPE}
    assert {lead.node for lead in seen} >= {"A", "B", "C", "star", "H1", "H0", "S+", "S-", FRAME, JOINT}
    for number, scene in enumerate(scenes):
        for form in Form:
            plate, translate = ((WYE, ENGLISH), (DELTA, CHINESE), (WYE, both))[number % 3]
            picture = drawn(scene, plate, form, translate)
            # Every mark has the number of a line.
            numbers = difference_of(scene.before, scene.layout, scene.lines, by_hand=scene.by_hand).numbers.values()
            assert not scene.lines or max(numbers, default=0) <= len(scene.lines), scene
            assert picture.faults() == [], (scene, form)
            names = {spec.label.render(translate): role.value for role, spec in ROLES.items()}
            assert picture.nets(names) == told(scene.layout), (scene, form)


@settings(deadline=None, max_examples=25)
@given(st.data())
def test_any_other_connection_too(data: st.DataObject) -> None:
    """One source and any probes, from any layout to any other."""
    families = [
        [Socket.SUPPLY_POSITIVE, Socket.SUPPLY_NEGATIVE],
        [Socket.METER_HIGH, Socket.METER_LOW],
        [Socket.INVERTER_U, Socket.INVERTER_V, Socket.INVERTER_W],
        [Socket.INSULATION_HIGH],
    ]

    def layout() -> Layout:
        family = st.sampled_from([Socket.OPEN, *data.draw(st.sampled_from(families))])
        probes = []
        for channel in data.draw(st.lists(st.integers(1, 4), unique=True)):
            one, other = data.draw(st.lists(st.sampled_from(Node), min_size=2, max_size=2, unique=True))
            clamp = CurrentProbe(channel, data.draw(st.sampled_from(Terminal)))
            probes.append(clamp if data.draw(st.booleans()) else VoltageProbe(channel, one, other))
        return Layout(
            terminals={terminal: data.draw(family) for terminal in Terminal},
            probes=tuple(probes),
            rotor_locked=data.draw(st.booleans()),
            dynamometer_coupled=data.draw(st.booleans()),
        )

    scene = Scene(layout(), data.draw(st.sampled_from([None, layout()])))
    form = data.draw(st.sampled_from(Form))
    plate = data.draw(st.sampled_from([WYE, DELTA]))
    assert drawn(scene, plate, form, data.draw(st.sampled_from([ENGLISH, CHINESE]))).faults() == []


def test_the_rules_find_what_breaks_them() -> None:
    layout = layout_after([ALIGN_D, STEP_PROBES])
    svg = draw_connections(layout, WYE)
    assert Picture(svg).faults() == []
    without_hops = re.sub(r"C[-\d. ]+ ([-\d.]+ [-\d.]+)(?= L)", r"L\1", svg)
    assert any("without a hop" in fault for fault in Picture(without_hops).faults())
    moved = re.sub(r'<text x="[-\d.]+" y="[-\d.]+"([^>]*)>M1', r'<text x="420" y="2"\1>M1', svg)
    assert any("label" in fault for fault in Picture(moved).faults())
    crossed = layout_after([ALIGN_D, ConnectProbes((VoltageProbe(1, Node.B, Node.A),))])
    assert Picture(svg).nets(NAMES) != told(crossed)


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


def test_a_meter_whose_leads_are_clipped_together_is_on_nothing_else() -> None:
    layout = layout_after([meter_across(Terminal.A, Terminal.B), ShortMeterLeads()])
    assert {lead.node for lead in leads_of(layout)} == {JOINT}


def test_what_changes_is_numbered_as_the_lines_say_it() -> None:
    before = layout_after([meter_across(Terminal.C, Terminal.A)])
    after = layout_after([ALIGN_D, STEP_PROBES, LockRotor()])
    usual = difference_of(before, after)
    high = Lead(Role.LCR_METER, "H", "C")
    plus, minus = Lead(Role.SUPPLY, "+", "A"), Lead(Role.SUPPLY, "−", "B")
    tip = Lead(Role.OSCILLOSCOPE, "1", "A")
    ground = Lead(Role.OSCILLOSCOPE, "1", "B", LeadKind.REFERENCE)
    # Off before on, the shaft, meters before sources; a channel's tip and ground are one line.
    assert [usual.numbers[work] for work in (high, ShaftWork.LOCK, tip, ground)] == [1, 2, 3, 3]
    assert usual.numbers[plus] > usual.numbers[ground]
    lines = [[plus], [tip, ground], [high]]
    given_by_lines = difference_of(before, after, lines)
    assert [given_by_lines.numbers[work] for work in (plus, tip, ground, high)] == [1, 2, 2, 3]
    assert given_by_lines.numbers[minus] > 3
    picture = Picture(draw_connections(after, WYE, before=before, lines=lines))
    assert {"1", "2", "3", "take off", "LCR meter", "shaft locked"} <= set(picture.words())


def test_without_a_change_nothing_is_loud() -> None:
    layout = layout_after([ALIGN_D, STEP_PROBES, LockRotor()])
    assert HALO not in draw_connections(layout, WYE)
    assert HALO not in draw_connections(layout, WYE, before=layout)
    assert HALO in draw_connections(layout, WYE, before=Layout())


def test_the_motor_stands_still_in_a_procedures_frame() -> None:
    scenes = [
        Scene(layout, before)
        for layout, before in [
            (layout_after([ALIGN_D]), None),
            (layout_after([ALIGN_D, STAR_PROBES, CoupleDynamometer()]), layout_after([ALIGN_D])),
            (layout_after([ALL_OPEN]), None),
        ]
    ]
    for form in Form:
        extents = extents_of(scenes, WYE, form=form)
        assert extents is not None
        pictures = [
            Picture(draw_connections(scene.layout, WYE, before=scene.before, form=form, extents=extents))
            for scene in scenes
        ]
        for picture in pictures:
            assert picture.faults() == []
        assert len({picture.view for picture in pictures}) == 1
        # The motor's name and its terminals.
        for word in ("M1", "A", "B", "C"):
            places = {label.middle for picture in pictures for label in picture.labels if label.words == word}
            assert len(places) == 1, word
    assert extents_of([], WYE) is None


def test_the_motor_stands_where_most_steps_have_it() -> None:
    usual = standing_extents(WYE, ENGLISH, Form.WIDE)
    places = set()
    for actions_done in ([ALIGN_D], [ALIGN_D, STEP_PROBES], [meter_across(Terminal.A, Terminal.B), LockRotor()]):
        picture = Picture(draw(Scene(layout_after(actions_done)), WYE, extents=usual).svg)
        places |= {label.middle for label in picture.labels if label.words == "M1"}
    assert len(places) == 1


def test_the_upright_form_is_higher_than_wide() -> None:
    upright = Picture(draw_connections(layout_after([ALIGN_D, STAR_PROBES]), WYE, form=Form.UPRIGHT))
    assert upright.view[3] > upright.view[2]


@given(st.tuples(*[st.sampled_from(Socket)] * 3), st.booleans(), st.sampled_from([WYE, DELTA]))
@settings(deadline=None, max_examples=15)
def test_every_lead_is_told_to_who_cannot_see_it(
    sockets: tuple[Socket, ...], probes: bool, nameplate: Nameplate
) -> None:
    layout = Layout().after(Connect(dict(zip(Terminal, sockets, strict=True))))
    if probes:
        layout = layout.after(STEP_PROBES)
    picture = Picture(draw_connections(layout, nameplate))
    described = picture.root.findtext(f"{SVG}desc") or ""
    assert picture.root.get("role") == "img"
    assert described in (picture.root.get("aria-label") or "")
    for line in Connect(dict(zip(Terminal, sockets, strict=True))).lines(nameplate.wire_colours)[1:]:
        assert str(line) in described
    assert picture.words().count("open") == sockets.count(Socket.OPEN)


def test_wires_carry_their_colour_and_its_name() -> None:
    svg = draw_connections(Layout().after(INVERTER), WYE)
    assert {"white", "green", "black", "U", "V", "W", "Inverter"} <= set(Picture(svg).words())
    strokes = {element.get("stroke") for element in Picture(svg).root.iter(f"{SVG}path")}
    assert {css_colour("white"), css_colour("green")} <= strokes


def test_channels_differ_by_pattern_beside_colour() -> None:
    svg = draw_connections(layout_after([ALL_OPEN, STAR_PROBES]), WYE)
    dashes = [element.get("stroke-dasharray") for element in Picture(svg).layers["lead"]]
    assert len({dash for dash in dashes if dash}) == 3


def test_the_readers_language() -> None:
    picture = Picture(draw_connections(Layout().after(ALIGN_D).after(LockRotor()), WYE, CHINESE, before=Layout()))
    assert {"直流电源", "白", "绿", "黑", "轴已锁定"} <= set(picture.words())


def test_star_and_delta_differ_and_the_artificial_neutral_is_drawn() -> None:
    delta = Nameplate("M1", WindingConnection.DELTA, 2.0, wire_colours=WYE.wire_colours)
    wye, other = (Picture(draw_connections(Layout().after(INVERTER), plate)) for plate in (WYE, delta))
    assert [e.get("d") for e in wye.layers["box"]] != [e.get("d") for e in other.layers["box"]]
    picture = Picture(draw_connections(Layout().after(ALL_OPEN).after(STAR_PROBES), WYE))
    assert {"3 × 20 kΩ", "artificial neutral"} <= set(picture.words())


@pytest.mark.parametrize("hostile", ['<script>alert("x")</script>', "red&<", '"onload="x', "{colour}"])
def test_names_are_words_never_markup(hostile: str) -> None:
    plate = Nameplate(hostile, WindingConnection.WYE, 2.0, wire_colours={"A": hostile})
    picture = Picture(draw_connections(Layout().after(ALIGN_D), plate))
    assert picture.words().count(hostile if len(hostile) <= 24 else hostile[:23] + "…") == 2
    assert not list(picture.root.iter(f"{SVG}script"))
    assert hostile in (picture.root.findtext(f"{SVG}desc") or "")


def test_colour_names() -> None:
    assert css_colour(" RD ") == css_colour("red")
    assert css_colour("mauve with stripes") == UNKNOWN
    assert len({css_colour(name) for name in ("red", "blue", "black", "white", "yellow", "green")}) == 6


@pytest.mark.slow
def test_words_are_no_wider_than_the_room_that_is_kept_for_them(scenes: list[Scene]) -> None:
    from PIL import ImageFont

    fonts = {
        (bold, chinese): ImageFont.truetype(FOLDER / name, 100)
        for (bold, chinese), name in {
            (False, False): "NotoSans-Regular.ttf",
            (True, False): "NotoSans-Bold.ttf",
            (False, True): "NotoSansCJKsc-GB2312.otf",
        }.items()
    }
    seen = {
        (element.text or "", element.get("font-weight") == "700")
        for translate in (ENGLISH, CHINESE)
        for scene in scenes[::4]
        for element in drawn(scene, WYE, Form.WIDE, translate).root.iter(f"{SVG}text")
    }
    assert len(seen) > 40
    for words, bold in seen:
        chinese = any(ord(letter) > 0x2E80 for letter in words)
        real = fonts[bold and not chinese, chinese].getlength(words) / 100.0
        assert real <= width_of(words, 1.0, bold=bold) + 0.05, words


def test_who_turns_the_shaft_is_told_to_go_on_until_it_stops() -> None:
    assert layout_after([LockRotor(), StartTurning(0.2)]).shaft_turned
    assert not layout_after([StartTurning(0.2), StopTurning()]).shaft_turned


def test_probes_and_voltmeter_on_the_supplys_output_show_the_supply() -> None:
    layout = Layout().after(ALL_OPEN)
    on_supply = layout.after(ConnectVoltmeterToSupply()).after(
        ConnectProbes((VoltageProbe(1, Node.SUPPLY_POSITIVE, Node.SUPPLY_NEGATIVE),))
    )
    assert "DC supply" not in draw_connections(layout, WYE)
    picture = Picture(draw_connections(on_supply, WYE))
    assert "DC supply" in picture.words()
    assert "tip on the supply" in (picture.root.findtext(f"{SVG}desc") or "")
    assert on_supply.after(DisconnectVoltmeter()).voltmeter_on_supply is False


def test_the_insulation_testers_other_lead_is_on_the_frame() -> None:
    layout = Layout().after(Connect(dict.fromkeys(Terminal, Socket.INSULATION_HIGH)))
    for form in Form:
        picture = drawn(Scene(layout), WYE, form)
        assert ("insulation_tester", "L", "frame") in picture.nets(NAMES)


def test_hall_pins_stand_at_the_motor_when_they_are_probed() -> None:
    probes = ConnectProbes(
        (VoltageProbe(1, Node.HALL_1, Node.HALL_GROUND), VoltageProbe(3, Node.HALL_3, Node.HALL_GROUND))
    )
    picture = Picture(draw_connections(layout_after([ALL_OPEN, probes]), WYE))
    assert {"H1", "H3", "H0", "Hall"} <= set(picture.words())
    assert "Hall" not in Picture(draw_connections(layout_after([ALL_OPEN, STAR_PROBES]), WYE)).words()
