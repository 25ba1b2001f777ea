"""The plans in one folder: two of one name, and whose serial number it is that another plan's pattern does not match."""

import re
import tomllib
from collections.abc import Iterator
from contextlib import suppress
from dataclasses import dataclass
from pathlib import Path

from bench.eol.plan import Plan
from bench.eol.serial_number import is_written, spelled_pattern
from bench.i18n.errors import FileError, InputError
from drivers.interfaces.text import text, text_of


@dataclass(frozen=True)
class PlanBeside:
    """Description of another plan's file; `serial_pattern` is empty where it takes any."""

    path: Path
    name: str
    motor: str
    serial_pattern: str


def plans_beside(path: Path) -> Iterator[PlanBeside]:
    """Give the other plans in a plan's folder; files that are none are passed over."""
    for other in sorted(path.parent.glob("*.toml")):
        if other.name == path.name:
            continue
        # What is wrong in a file that nobody asked for is no fault of this plan.
        with suppress(OSError, ValueError):
            plan = tomllib.loads(other.read_text(encoding="utf-8")).get("plan")
            if isinstance(plan, dict) and all(isinstance(plan.get(key), str) for key in ("name", "motor")):
                yield PlanBeside(other, plan["name"], plan["motor"], str(plan.get("serial_pattern", "")))


def check_name(plan: Plan) -> None:
    """Raise InputError where another file in the plan's folder gives its name to another plan.

    Records, the order by experience and golden motors' histories know a plan by its name.
    """
    for other in plans_beside(Path(plan.source)):
        with suppress(OSError):
            if other.name == plan.name and other.path.read_text(encoding="utf-8") != plan.content:
                raise FileError(
                    text(
                        "{source}: plan.name = {name!r} is the name of {other}, too, which is another plan; records are kept by "
                        "that name: give each its own, or move one of them out of the folder",
                        source=plan.source,
                        name=plan.name,
                        other=str(other.path),
                    )
                )


def check_serial(plan: Plan, serial_number: str) -> None:
    """Refuse what is no serial number of a plan (InputError); say whose it is where a plan beside it knows."""
    try:
        plan.check_serial(serial_number)
    except InputError as error:
        owner = next((each for each in plans_beside(Path(plan.source)) if _matches(each, serial_number)), None)
        if owner is None:
            raise
        raise FileError(
            text(
                "{error}; it belongs to the plan {name} ({path}) for the type {motor}",
                error=text_of(error),
                name=owner.name,
                path=owner.path.name,
                motor=owner.motor,
            )
        ) from None


def _matches(plan: PlanBeside, serial_number: str) -> bool:
    with suppress(re.error, OverflowError, RecursionError):
        return (
            is_written(serial_number)
            and bool(plan.serial_pattern)
            and re.fullmatch(spelled_pattern(plan.serial_pattern), serial_number) is not None
        )
    return False
