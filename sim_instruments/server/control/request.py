"""Requests to the control endpoint as strict models: unknown keys, wrong types and NaN are refused."""

from typing import Any, TypeVar

from pydantic import BaseModel, ConfigDict, TypeAdapter, ValidationError

from sim_instruments.server.control.http import RequestError

T = TypeVar("T")


class Request(BaseModel):
    """Base of what a request may hold."""

    model_config = ConfigDict(strict=True, frozen=True, extra="forbid", allow_inf_nan=False)


def checked(adapter: TypeAdapter[T], given: Any) -> T:
    """Return the request. Raises RequestError 400 that names every key that is wrong, and what is allowed."""
    try:
        return adapter.validate_python(given)
    except ValidationError as error:
        faults = [_told(fault["loc"], fault["msg"]) for fault in error.errors(include_url=False)]
        raise RequestError(400, "; ".join(faults)) from error


def _told(place: tuple[int | str, ...], words: str) -> str:
    name = ".".join(str(part) for part in place)
    words = words.removeprefix("Value error, ")
    return f"{name}: {words}" if name else words
