"""A layout in words: what the drawing says to who cannot see it."""

from bench.drawings.layout import Layout
from drivers.interfaces.text import Text, text
from procedures.core.actions import Connect, ConnectProbes, ConnectVoltmeter, ConnectVoltmeterToSupply
from procedures.core.nameplate import Nameplate


def told(layout: Layout, nameplate: Nameplate) -> list[Text]:
    """Return a line for each terminal, probe and meter of a layout, and for its shaft."""
    lines: list[Text] = []
    if layout.terminals is not None:
        lines += Connect(layout.terminals).lines(nameplate.wire_colours)[1:]
    if layout.leads_shorted:
        lines.append(text("the LCR meter's leads are clipped together"))
    if layout.probes:
        lines += ConnectProbes(layout.probes).lines({})[1:]
    if layout.voltmeter is not None:
        lines += ConnectVoltmeter(*layout.voltmeter).lines({})
    if layout.voltmeter_on_supply:
        lines += ConnectVoltmeterToSupply().lines({})
    if layout.rotor_locked:
        lines.append(text("shaft locked"))
    if layout.dynamometer_coupled:
        lines.append(text("coupled to the dynamometer"))
    return lines
