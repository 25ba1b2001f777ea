"""Settings of the paper's measurement."""

from typing import Annotated

from pydantic import Field

from procedures.estimation.winding.resistance import COPPER, COPPER_REFERENCE
from procedures.techniques.temperature.settings import (
    COLD,
    CopperCoefficient,
    MagnetCoefficient,
    ReferenceTemperature,
    TemperatureUncertainty,
    WindingTemperature,
)
from procedures.verification.settings import WiringSettings

#: Half-width, relative, that an R_11 or L11 − L12 given without one is taken to be known within.
UNSTATED_RESISTANCE, UNSTATED_INDUCTANCE = 0.02, 0.05


class EquivalentResistanceSettings(WiringSettings):
    """Settings of the paper's measurement."""

    load_shares: tuple[float, ...] = Field(
        default=(0.1, 0.2, 0.4, 0.6, 0.8), min_length=3, description="load torques, shares of the rated torque"
    )
    loads: tuple[float, ...] = Field(default=(), description="load torques, N·m; instead of the shares")
    settle: float = Field(default=3.0, gt=0.0, le=600.0, description="time at each load before reading, s")
    readings: int = Field(default=10, ge=2, le=1000, description="readings of bus voltage and current at each load")
    periods: int = Field(default=40, ge=5, le=1000, description="electrical periods in the current's record")
    winding_resistance: float | None = Field(
        default=None, gt=0.0, description="R_11, Ω; from the resistance procedure when not given"
    )
    winding_resistance_uncertainty: float | None = Field(
        default=None, ge=0.0, description="half-width of its uncertainty, Ω; 2 % of it when not given"
    )
    winding_resistance_temperature: float = Field(
        default=COLD, ge=-60.0, le=250.0, description="winding temperature at which it holds, °C"
    )
    winding_inductance: float | None = Field(
        default=None, gt=0.0, description="L11 − L12, H; from the inductance procedures when not given"
    )
    winding_inductance_uncertainty: float | None = Field(
        default=None, ge=0.0, description="half-width of its uncertainty, H; 5 % of it when not given"
    )
    winding_temperature: WindingTemperature = None
    winding_temperature_after: Annotated[
        float | None,
        Field(
            ge=-60.0,
            le=250.0,
            description="winding temperature as soon as the motor stands again, °C; asked for when not given",
        ),
    ] = None
    temperature_uncertainty: TemperatureUncertainty = 2.0
    coefficient: CopperCoefficient = COPPER
    reference_temperature: ReferenceTemperature = COPPER_REFERENCE
    magnet_coefficient: MagnetCoefficient = -0.001
    switch_resistance: float | None = Field(
        default=None, ge=0.0, description="on-resistance of one switch R_t, Ω; fitted when not given"
    )
