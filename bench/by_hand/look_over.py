"""The check by a person before an output is switched on: the stated connections and the probes' factors."""

from collections.abc import Sequence

from drivers.interfaces import Oscilloscope, ProbeKind
from drivers.interfaces.text import Text, lines, text
from procedures.core.actions import FittedProbe
from procedures.core.setup import BenchSetup
from procedures.core.setup_change import contact_lines


def fitted_probes(scope: Oscilloscope) -> tuple[FittedProbe, ...]:
    """Return the probes that the station fixes to an oscilloscope's channels, by channel."""
    found = [
        FittedProbe(channel, kind, scope.attenuation(channel)) for kind in ProbeKind for channel in scope.channels(kind)
    ]
    return tuple(sorted(found, key=lambda probe: probe.channel))


def probe_words(probe: FittedProbe) -> Text:
    """Return a probe with its factor."""
    said = {"channel": probe.channel, "factor": probe.attenuation}
    if probe.attenuation is None:
        return text(
            "channel {channel}: the station file states no factor of its probe; set at the oscilloscope what stands on the probe",
            **said,
        )
    if probe.kind is ProbeKind.CURRENT:
        return text("channel {channel}: current probe, {factor:g} A/V; figures are in A at the wire", **said)
    return text("channel {channel}: voltage probe {factor:g}:1; figures are in V at its tip", **said)


def question(typed: str, setup: BenchSetup, probes: Sequence[FittedProbe]) -> Text:
    """Return what is asked before a command switches something on."""
    on = contact_lines(setup) or [text("nothing")]
    channels = {probe.channel for probe in setup.probes}
    told = [probe_words(probe) for probe in probes if probe.channel in channels]
    coupled = text("The dynamometer is coupled") if setup.coupled else text("The dynamometer is not coupled")
    return lines(
        [
            text(
                "⚡ {typed}: look at the bench before it is switched on. Connected to the motor, as stated and "
                "not verified:",
                typed=typed,
            ),
            *(Text("  {what}", {"what": one}) for one in [*on, *told]),
            text(
                "{coupled}. No other source, lead or short circuit may be connected to the motor, and nobody may "
                "touch it",
                coupled=coupled,
            ),
            text("Type yes to switch it on; any other command leaves it off"),
        ]
    )
