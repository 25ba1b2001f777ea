"""The virtual fixture's relays: which channel is which crosspoint, and which module sits in which slot."""

from collections.abc import Iterator, Mapping

from sim_instruments.connections import LEADS_SHORT

#: Slot to module. A real 34970A has three slots; a station of this size has two mainframes or a larger one.
MODULES: Mapping[int, str] = {1: "34904A", 2: "34904A", 3: "34904A", 4: "34904A", 5: "34904A", 6: "34903A"}
#: Columns of each matrix: sockets, then sense leads, then the oscilloscope's leads.
_SOCKETS = ("supply+", "supply-", "lcr_high", "lcr_low", "inverter_u", "inverter_v", "inverter_w", "insulation_high")
_MORE = ("drive_1", "drive_2", "drive_3", "voltmeter+", "voltmeter-")
_LEADS = tuple(f"channel{channel}{pole}" for channel in (1, 2, 3, 4) for pole in "+-")
#: Only Hall leads reach channel 4: its input is the current probe's, and a relay pair takes it over.
_WINDING_LEADS = _LEADS[:6]


def crosspoints() -> dict[str, int]:
    """Return the channel of every crosspoint by its name: of a 34904A slot·100 + row·10 + column."""
    return dict(_layout())


def _layout() -> Iterator[tuple[str, int]]:
    for row, terminal in enumerate("ABC", 1):
        for column, socket in enumerate(_SOCKETS, 1):
            yield f"{terminal}:{socket}", 100 + 10 * row + column
        for column, socket in enumerate(_MORE, 1):
            yield f"{terminal}:{socket}", 200 + 10 * row + column
    for slot, nodes, leads in (
        (3, ("A", "B", "C", "N"), _WINDING_LEADS),
        (4, ("H1", "H2", "H3", "H0"), _LEADS),
        (5, ("star",), _WINDING_LEADS),
    ):
        for row, node in enumerate(nodes, 1):
            for column, lead in enumerate(leads, 1):
                yield f"{node}:{lead}", 100 * slot + 10 * row + column
    yield LEADS_SHORT, 601
