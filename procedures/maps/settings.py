"""Settings that the procedures at several speeds share."""

from pydantic import Field

from procedures.verification.settings import TurnedWiringSettings


class SpeedsSettings(TurnedWiringSettings):
    """Settings of torque and fundamentals read at several speeds."""

    readings: int = Field(default=12, ge=3, le=1000, description="readings of the torque at each speed")
    interval: float = Field(default=0.05, gt=0.0, le=10.0, description="time between readings, s")
    settle: float = Field(
        default=0.3,
        ge=0.0,
        le=60.0,
        description="time at a speed before its first reading, s; a stated filter of the torque counts too",
    )
    zero_rest: float = Field(
        default=1.0, ge=0.0, le=60.0, description="wait before the torque's zero is read, until a filter has settled, s"
    )
    magnet_lag: float = Field(
        default=0.3,
        ge=0.0,
        le=1.0,
        description="share of the winding's rise by which warmed magnets may be cooler than the winding",
    )
    periods: float = Field(
        default=6.0, ge=2.0, le=100.0, description="electrical periods of each record, at most what 2 s hold"
    )
