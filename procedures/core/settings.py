"""Base of the settings of all procedures."""

from pydantic import BaseModel, ConfigDict


class Settings(BaseModel):
    """Base of a procedure's settings: immutable, unknown names refused, values checked."""

    model_config = ConfigDict(frozen=True, extra="forbid", allow_inf_nan=False, defer_build=True)
