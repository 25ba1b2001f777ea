"""Settings of the wiring's checks, of every procedure that has a connection made."""

from pydantic import Field

from procedures.core.settings import Settings


class WiringSettings(Settings):
    """Settings of a procedure whose connections are verified."""

    wiring_attempts: int = Field(
        default=3, ge=1, le=20, description="times that a connection is verified before the procedure is refused"
    )


class FedWiringSettings(WiringSettings):
    """Settings where a harmless current verifies."""

    wiring_current_share: float = Field(
        default=0.05, gt=0.0, le=0.2, description="current that wiring is verified with, share of the rated current"
    )


class SupplyWiringSettings(FedWiringSettings):
    """Settings where a supply verifies."""

    wiring_leads: float = Field(
        default=0.1, ge=0.0, le=10.0, description="largest resistance of a supply's leads and clips, there and back, Ω"
    )
    wiring_settle: float = Field(
        default=0.2, ge=0.0, le=10.0, description="time until a supply's harmless current has settled, s"
    )


class TurnedWiringSettings(WiringSettings):
    """Settings where the turned shaft's voltage verifies."""

    wiring_speed_share: float = Field(
        default=0.1, gt=0.0, le=1.0, description="speed that wiring is verified at, share of the rated speed"
    )


class DrivenWiringSettings(FedWiringSettings, TurnedWiringSettings):
    """Settings where an inverter's current on a turned shaft verifies."""


class AllWiringSettings(SupplyWiringSettings, TurnedWiringSettings):
    """All settings of the connections' checks."""


def wiring_settings(settings: Settings) -> AllWiringSettings:
    """Return what a procedure's settings say of the connections' checks, the rest as by default."""
    return AllWiringSettings(**settings.model_dump(include=set(AllWiringSettings.model_fields)))
