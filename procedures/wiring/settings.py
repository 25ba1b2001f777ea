"""Settings of the wiring's checks, of every procedure that has a connection made."""

from pydantic import Field

from procedures.settings import Settings


class WiringSettings(Settings):
    """Settings of a procedure whose connections are verified."""

    wiring_current_share: float = Field(
        default=0.05, gt=0.0, le=0.2, description="current that wiring is verified with, share of the rated current"
    )
    wiring_leads: float = Field(
        default=0.03, ge=0.0, le=10.0, description="largest resistance of a supply's leads and clips, there and back, Ω"
    )
    wiring_attempts: int = Field(
        default=3, ge=1, le=20, description="times that a connection is verified before the procedure is refused"
    )
