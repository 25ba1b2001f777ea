"""Settings of the flux map at constant speed."""

from pydantic import Field

from procedures.verification.settings import DrivenWiringSettings


class FluxMapSettings(DrivenWiringSettings):
    """Settings of the map at constant speed."""

    locations: int = Field(default=51, ge=12, le=400, description="currents of the map, at most, counted at i_q ≥ 0")
    current_share: float = Field(
        default=1.0, gt=0.0, le=20.0, description="largest current of the map, share of the rated current"
    )
    d_from: float = Field(
        default=-1.0, ge=-1.0, le=0.0, description="smallest d-axis current, share of the largest current"
    )
    d_to: float = Field(default=1.0, ge=0.0, le=1.0, description="largest d-axis current, share of the largest current")
    symmetric: bool | None = Field(
        default=None,
        description="whether ψ_d is even and ψ_q odd in i_q; tested by the currents that are read at both signs when not given",
    )
    speed_share: float = Field(default=0.25, gt=0.0, le=1.0, description="speed that is held, share of the rated speed")
    settling: float = Field(
        default=0.05,
        ge=0.0,
        le=60.0,
        description="wait after a change of current, s; longer where the torque is filtered",
    )
    turns: int = Field(default=1, ge=1, le=1000, description="turns of the shaft over which a reading is averaged")
    longest: float = Field(
        default=3600.0, gt=0.0, le=86400.0, description="time after which no further current is read, s"
    )
