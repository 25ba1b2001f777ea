"""The sources that feed the motor, to the left: each socket as high as the rails that it feeds, so that most leads run straight."""

from dataclasses import dataclass

from bench.drawings.canvas import Layer, straight
from bench.drawings.difference import SOURCES
from bench.drawings.leads import JOINT, SUPPLY_OUTPUT, Lead
from bench.drawings.lettering import width_of
from bench.drawings.palette import INK, PLUS
from bench.drawings.sheet import APART, OPEN, PHASES, DrawingSheet, Horizontal
from drivers.interfaces.role import ROLES
from drivers.interfaces.text import Text, text
from procedures.core.bench import Role

#: Between sockets of one instrument, between the clips of leads that are joined, between two tracks.
_SOCKETS, _CLIPS, _TRACKS = 40.0, 56.0, 28.0
_DEEP_UPRIGHT = 74.0
_TOGETHER = text("leads clipped together")
#: The link that joins terminals belongs to no instrument.
_LINK = text("Shorting link")
#: Half a terminal's box along the axis in the upright form.
_HALF_ALONG = 26.0

SocketOf = tuple[Role, str]


@dataclass(frozen=True)
class _Case:
    """An instrument's box: from v to v, and where its name stands."""

    role: Role
    first: float
    last: float


@dataclass(frozen=True)
class Sources:
    """The places of the sources: their boxes' depth, each socket's v, what it feeds, the track of those that bend."""

    deep: float
    cases: tuple[_Case, ...]
    place: dict[SocketOf, float]
    feeds: dict[SocketOf, list[Lead]]
    track: dict[SocketOf, float]

    @property
    def fed(self) -> set[str]:
        """The nodes that a source's lead goes to."""
        return {lead.node for leads in self.feeds.values() for lead in leads}


def place_sources(sheet: DrawingSheet) -> Sources:
    """Return where the sources stand, and set the sheet's strip of terminals right of them."""
    feeds: dict[SocketOf, list[Lead]] = {}
    for lead in (*sheet.difference.leads, *_outputs(sheet)):
        if lead.role in SOURCES and lead.node != JOINT:
            feeds.setdefault((lead.role, lead.socket), []).append(lead)
    mean = {socket: sum(sheet.v[lead.node] for lead in leads) / len(leads) for socket, leads in feeds.items()}
    roles = sorted({role for role, _ in feeds}, key=lambda role: min(mean[s] for s in feeds if s[0] is role))
    joined = {(lead.role, lead.socket): lead for lead in sheet.difference.leads if lead.node == JOINT}
    names = [_name_width(sheet, role) for role in (*roles, *(role for role, _ in joined))]
    deep = _DEEP_UPRIGHT if sheet.upright else max([150.0, *(width + 28.0 for width in names)])
    cases, place = list[_Case](), dict[SocketOf, float]()
    free = float("-inf")
    for role in roles:
        free = _stand(sheet, role, {s: mean[s] for s in feeds if s[0] is role}, free, cases, place)
    track = _tracks(deep, place, mean, feeds)
    sheet.strip = _strip(sheet, deep, track, {lead.node for leads in feeds.values() for lead in leads})
    if joined:
        label = width_of(sheet.say(_TOGETHER), 16)
        first = max(sheet.lowest + APART + (label / 2.0 if sheet.upright else 58.0), free + 74.0)
        wanted = {socket: first + _CLIPS * number for number, socket in enumerate(joined)}
        _stand(sheet, next(iter(joined))[0], wanted, free, cases, place)
        if not sheet.upright:
            sheet.strip = max(sheet.strip, deep + 90.0 + label - 40.0)
    return Sources(deep, tuple(cases), place, feeds, track)


def draw_sources(sheet: DrawingSheet, sources: Sources) -> None:
    """Draw boxes, sockets and the leads up to the terminals."""
    for case in sources.cases:
        sheet.canvas.box(Layer.BOX, (0.0, case.first), (sources.deep, case.last))
        middle = (case.first + case.last) / 2.0
        x, y = (middle, 26.0) if sheet.upright else (sources.deep / 2.0, case.first + 24.0)
        sheet.canvas.words(x, y, sheet.say(_label(case.role)), bold=True)
    for socket, leads in sources.feeds.items():
        turn = sources.track.get(socket, sources.deep)
        sheet.horizontals.append(Horizontal(sources.place[socket], sources.deep, turn, socket))
        sheet.horizontals += [Horizontal(sheet.v[lead.node], turn, sheet.strip, socket) for lead in leads]
    for socket, leads in sources.feeds.items():
        _draw_feeds(sheet, sources, socket, leads)
    _draw_joint(sheet, sources)
    for (_, word), v in sources.place.items():
        sheet.mark(sources.deep, v, word)


def colour_of_source(socket: SocketOf) -> str:
    """Return the colour of a source's leads."""
    return PLUS if socket == (Role.SUPPLY, "+") else INK


def _outputs(sheet: DrawingSheet) -> list[Lead]:
    """Return the supply's own output where a meter or probe is on it: no lead, but drawn as one."""
    return [Lead(Role.SUPPLY, socket, node) for node, socket in SUPPLY_OUTPUT.items() if node in sheet.v]


def _name_width(sheet: DrawingSheet, role: Role) -> float:
    return width_of(sheet.say(_label(role)), 18, bold=True)


def _label(role: Role) -> Text:
    return _LINK if role is Role.SWITCH_MATRIX else ROLES[role].label


def _stand(
    sheet: DrawingSheet,
    role: Role,
    wanted: dict[SocketOf, float],
    free: float,
    cases: list[_Case],
    place: dict[SocketOf, float],
) -> float:
    """Put an instrument's sockets where they are wanted, or as far below as what stands above needs; return its end."""
    places: list[float] = []
    sockets = sorted(wanted, key=lambda socket: (wanted[socket], socket[1]))
    for socket in sockets:
        places.append(max(wanted[socket], places[-1] + _SOCKETS) if places else wanted[socket])
    middle, half = (places[0] + places[-1]) / 2.0, 0.0
    if sheet.upright:
        half = _name_width(sheet, role) / 2.0 + 14.0
    first = min(places[0] - (30.0 if sheet.upright else 58.0), middle - half)
    last = max(places[-1] + 30.0, middle + half)
    lower = max(0.0, free + 16.0 - first)
    place.update({socket: v + lower for socket, v in zip(sockets, places, strict=True)})
    cases.append(_Case(role, first + lower, last + lower))
    return last + lower


def _tracks(
    deep: float, place: dict[SocketOf, float], mean: dict[SocketOf, float], feeds: dict[SocketOf, list[Lead]]
) -> dict[SocketOf, float]:
    bent = [s for s in place if len(feeds[s]) > 1 or abs(place[s] - mean[s]) > 1.0]
    # Going down, the higher socket turns further right; going up, the lower: so they cross least.
    down = sorted((s for s in bent if mean[s] >= place[s]), key=lambda s: -place[s])
    up = sorted((s for s in bent if mean[s] < place[s]), key=lambda s: place[s])
    return {socket: deep + 66.0 + _TRACKS * number for number, socket in enumerate((*down, *up))}


def _strip(sheet: DrawingSheet, deep: float, track: dict[SocketOf, float], fed: set[str]) -> float:
    """Return where the terminals stand: behind the tracks, and behind the words at an open one."""
    half = _HALF_ALONG if sheet.upright else max(sheet.half_terminal(node) for node in PHASES)
    behind = max(track.values(), default=deep + 52.0) + 29.0
    if not fed.issuperset(PHASES):
        behind += 49.0 if sheet.upright else 36.0 + width_of(sheet.say(OPEN), 16)
    return behind + half


def _draw_feeds(sheet: DrawingSheet, sources: Sources, socket: SocketOf, leads: list[Lead]) -> None:
    place, turn = sources.place[socket], sources.track.get(socket, sources.deep)
    colour = colour_of_source(socket)
    common = sheet.new(leads)
    sheet.lead(Layer.LEAD, straight((sources.deep, place), (turn, place)), colour, width=5.0, new=common)
    for lead in leads:
        v, new = sheet.v[lead.node], lead in sheet.difference.new
        if abs(v - place) > 1.0:
            sheet.lead(Layer.LEAD, sheet.column(turn, place, v, socket), colour, width=5.0, new=new)
        sheet.lead(Layer.LEAD, straight((turn, v), (sheet.strip, v)), colour, width=5.0, new=new)
    if len(leads) > 1:
        middle = [sheet.v[lead.node] for lead in leads][1:-1]
        for v in {place, *middle}:
            sheet.canvas.disc(Layer.LEAD, turn, v, 5.0, fill=colour, edge=colour)
    sheet.number([lead for lead in leads if lead in sheet.difference.new], sources.deep + 38.0, place)


def _draw_joint(sheet: DrawingSheet, sources: Sources) -> None:
    leads = [lead for lead in sheet.difference.leads if lead.node == JOINT]
    if not leads:
        return
    turn, new = sources.deep + 70.0, sheet.new(leads)
    ends = [sources.place[lead.role, lead.socket] for lead in leads]
    middle = sum(ends) / len(ends)
    for lead, v in zip(leads, ends, strict=True):
        way = straight((sources.deep, v), (turn, v), (turn, middle))
        sheet.lead(Layer.LEAD, way, INK, width=5.0, new=new)
        sheet.number([lead], sources.deep + 38.0, v)
    sheet.canvas.disc(Layer.LEAD, turn, middle, 9.0, fill=INK)
    x, y = sheet.canvas.page(turn + (26.0 if sheet.upright else 20.0), middle)
    sheet.canvas.words(x, y, sheet.say(_TOGETHER), size=16, anchor="middle" if sheet.upright else "start")
