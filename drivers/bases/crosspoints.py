"""Names of a switch matrix's crosspoints, and which of them may be closed together."""

import re
from collections.abc import Collection, Mapping

from drivers.interfaces.text import Text, text

#: A motor terminal on something that feeds it or measures it; the groups are the terminal and, one of them, the kind.
_SOCKET = re.compile(
    r"([ABC]):(?:(supply)[+-]|(lcr)_(?:high|low)|(inverter)_[uvw]|(drive)_[123]|(insulation)_high|(link))", re.ASCII
)
#: A lead of a meter or of a probe on a node; the group is the lead.
_LEAD = re.compile(r"(?:(?:[ABC]|S[+-]):(voltmeter[+-])|(?:[ABCN]|star|H[0-3]|S[+-]):(channel[1-9][+-]))", re.ASCII)
_SHORT = "leads:short"
#: A current probe round a terminal's wire: it can be fixed, not switched.
_CURRENT_PROBE = re.compile(r"[ABC]:channel[1-9]~", re.ASCII)

LOWEST_CHANNEL, HIGHEST_CHANNEL = 100, 9999
_FORMS = (
    "A, B or C with supply+, supply-, lcr_high, lcr_low, inverter_u, inverter_v, inverter_w, drive_1, drive_2, drive_3, "
    "insulation_high, link, voltmeter+ or voltmeter-; S+ or S- with voltmeter+ or voltmeter-; "
    "A, B, C, N, star, H0, H1, H2, H3, S+ or S- with channel1+, channel1- and so on; leads:short"
)


def is_crosspoint(name: str) -> bool:
    """Tell whether a name is one of a crosspoint that can be switched."""
    return name == _SHORT or any(form.fullmatch(name) is not None for form in (_SOCKET, _LEAD))


def is_fixed_point(name: str) -> bool:
    """Tell whether a name is that of a permanent connection: a probe's or a meter's lead, a current probe."""
    return any(form.fullmatch(name) is not None for form in (_LEAD, _CURRENT_PROBE))


def check_channels(crosspoints: Mapping[str, int]) -> None:
    """Raise ValueError naming the crosspoint that has no such name, no such channel, or another one's channel."""
    taken: dict[int, str] = {}
    for name, channel in crosspoints.items():
        key = f'crosspoints."{name}" = {channel}'
        if not is_crosspoint(name):
            raise ValueError(text("{key}: there is no such crosspoint; allowed are {forms}", key=key, forms=_FORMS))
        if not LOWEST_CHANNEL <= channel <= HIGHEST_CHANNEL:
            raise ValueError(
                text(
                    "{key}: a channel is a number from {lowest} to {highest}, slot first",
                    key=key,
                    lowest=LOWEST_CHANNEL,
                    highest=HIGHEST_CHANNEL,
                )
            )
        if channel in taken:
            raise ValueError(text('{key}: the channel is "{taken}" already', key=key, taken=taken[channel]))
        taken[channel] = name


def conflict(crosspoints: Collection[str]) -> Text | None:
    """Return why these crosspoints may not be closed together, None where they may.

    A terminal has one socket at most, all sockets are of one kind of source, a lead touches one point (it would join two),
    and beside an insulation test nothing is connected.
    """
    sockets: dict[str, str] = {}
    kinds: dict[str, str] = {}
    leads: dict[str, str] = {}
    for name in sorted(crosspoints):
        if (socket := _SOCKET.fullmatch(name)) is not None:
            terminal, *found = socket.groups()
            if terminal in sockets:
                return text(
                    "{one} and {other} would put terminal {terminal} on two sockets",
                    one=sockets[terminal],
                    other=name,
                    terminal=terminal,
                )
            sockets[terminal] = name
            kinds[next(kind for kind in found if kind)] = name
        elif (lead := _LEAD.fullmatch(name)) is not None:
            end = lead.group(1) or lead.group(2)
            if end in leads:
                return text("{one} and {other} would join two points by one lead", one=leads[end], other=name)
            leads[end] = name
    if len(kinds) > 1:
        return text("{crosspoints} would join two sources", crosspoints=list(kinds.values()))
    beside = sorted(set(crosspoints) - set(sockets.values()))
    if "insulation" in kinds and beside:
        return text(
            "{one} would be connected to the voltage of an insulation test together with {other}",
            one=beside[0],
            other=kinds["insulation"],
        )
    return None
