"""Limits of a bridge for an inductance, known from the type values before anything is energised."""

from collections.abc import Sequence
from typing import Protocol

from drivers.interfaces import Aperture, MeasurementError, SetpointError
from drivers.interfaces.text import text
from procedures.core.bench import Bench, Role
from procedures.core.nameplate import Nameplate
from procedures.core.result import Notice
from procedures.plausibility.capability import cannot_support, relative_uncertainty

#: Test frequencies that are tried instead, as multiples of the one that is set.
_HIGHER = (2.0, 5.0, 10.0, 20.0, 50.0, 100.0)
#: What is asked of an inductance where nothing else is set.
REQUESTED = 0.01


class InductanceBridgeSettings(Protocol):
    """The settings of a measurement by bridge."""

    @property
    def frequency(self) -> float:
        """Test frequency (Hz)."""

    @property
    def level(self) -> float:
        """Test level (V rms)."""

    @property
    def aperture(self) -> Aperture:
        """Measurement time."""

    @property
    def requested_uncertainty(self) -> float:
        """Relative standard uncertainty asked for."""


def check_inductance_capability(
    procedure: str, bench: Bench, nameplate: Nameplate, settings: InductanceBridgeSettings, reading: float
) -> Sequence[Notice]:
    """Hold the bridge's accuracy at the type value against the uncertainty asked for; `reading` is the meter's over the phase's value.

    Nothing is claimed without a type value of the d-axis inductance.
    """
    inductance = nameplate.expected.get("d_axis_inductance")
    if inductance is None:
        return ()
    resistance = nameplate.expected.get("stator_resistance", 0.0)

    def gives(frequency: float) -> float:
        _, accuracy = bench.lcr_meter.accuracy_at(
            reading * resistance, reading * inductance, frequency, settings.level, settings.aperture
        )
        return relative_uncertainty(accuracy, reading * inductance)

    here = gives(settings.frequency)
    if here <= settings.requested_uncertainty:
        return ()
    remedy = text("measure the step response with a calibrated oscilloscope instead: dq-inductance-time-constant")
    for higher in _HIGHER:
        try:
            enough = gives(higher * settings.frequency) <= settings.requested_uncertainty
        except (MeasurementError, SetpointError):
            break
        if enough:
            remedy = text("test at {frequency:g} Hz instead: --set frequency=…", frequency=higher * settings.frequency)
            break
    conditions = text(
        "({model}) at {frequency:g} Hz on {value:.3g} µH",
        model=bench.lcr_meter.identity.model,
        frequency=settings.frequency,
        value=1e6 * reading * inductance,
    )
    return (
        cannot_support(
            procedure, Role.LCR_METER, conditions, gives=here, asked=settings.requested_uncertainty, remedy=remedy
        ),
    )
