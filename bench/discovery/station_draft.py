"""A station file made of what a scan found: tables that hold, and as comments what a person must fill in."""

import re
from collections.abc import Iterable, Mapping
from dataclasses import MISSING, dataclass, fields
from typing import Any

from tomli_w import dumps

from bench.discovery.findings import FoundInstrument, ScanReport
from bench.discovery.inquiry import shown
from bench.station.driver_options import unit_of_option
from bench.station.station_limits import SECTIONS
from drivers.catalogue import Driver
from drivers.interfaces.text import Text, Translate, english, text
from procedures.core.bench import Role


@dataclass(frozen=True)
class Candidate:
    """An instrument in one role, as a station file's table would have it; `missing` are the options that a person must give."""

    role: Role
    name: str
    driver: Driver
    finding: FoundInstrument
    table: Mapping[str, Any]
    missing: tuple[str, ...]
    sole_role: bool

    @property
    def complete(self) -> bool:
        """True if the table is valid as it is, and no other role claims the instrument."""
        return not self.missing and self.sole_role


def candidates(report: ScanReport) -> tuple[Candidate, ...]:
    """Return every instrument in every role that a driver gives it, in the order of the roles."""
    found = []
    for finding in report.found:
        roles = {match.driver.role for match in finding.matches}
        for match in finding.matches:
            options = {option.name: option for option in fields(match.driver.options)}
            table: dict[str, Any] = {"driver": match.driver.name, "address": finding.address, **match.options}
            if finding.identity is not None and finding.identity.serial_number and "serial_number" in options:
                table["serial_number"] = finding.identity.serial_number
            required = [o.name for o in options.values() if o.default is MISSING and o.default_factory is MISSING]
            missing = tuple(name for name in required if name not in table)
            name = _name(finding, match.driver)
            found.append(Candidate(match.driver.role, name, match.driver, finding, table, missing, len(roles) == 1))
    return tuple(sorted(found, key=lambda one: list(Role).index(one.role)))


def draft(report: ScanReport, name: str, translate: Translate = english) -> str:
    """Return the text of a station file with what was found; it is valid as it stands."""
    parts = [
        _comment(
            text(
                "Proposed by motorbench station scan. Fill in the limits and the lines that are comments; then "
                "run motorbench station check.\nOptions and their defaults: docs/reference/drivers.md"
            ),
            translate,
        ),
        dumps({"station": {"name": name}}).strip(),
    ]
    by_role: dict[Role, list[Candidate]] = {}
    for one in candidates(report):
        by_role.setdefault(one.role, []).append(one)
    for role, several in by_role.items():
        parts += _role(role, several, translate)
    unknown = [one for one in report.found if not one.matches]
    if unknown:
        messages = [
            text(
                "no driver recognises {address}: {answer}{near}",
                address=one.address,
                answer=one.said,
                near=text("; near: {drivers}", drivers=one.near) if one.near else "",
            )
            for one in unknown
        ]
        parts.append("\n".join(_comment(line, translate) for line in messages))
    return "\n\n".join(parts) + "\n"


def _role(role: Role, several: Iterable[Candidate], translate: Translate) -> list[str]:
    several = list(several)
    whole = [one for one in several if one.complete]
    parts = []
    if len(whole) > 1:
        parts.append(
            _comment(text("several instruments have this role: `use` names the one that runs use"), translate)
            + "\n"
            + dumps({"instruments": {role.value: {"use": whole[0].name}}}).strip()
        )
    for one in several:
        above = [_comment(one.finding.said, translate)]
        if one.finding.addresses[1:]:
            above.append(_comment(text("also at {addresses}", addresses=one.finding.addresses[1:]), translate))
        if not one.sole_role:
            above.append(
                _comment(
                    text("this instrument can have several roles; remove the comment marks from one of them"), translate
                )
            )
        path = {one.name: one.table} if one.complete and len(whole) > 1 else one.table
        table = dumps({"instruments": {role.value: path}}).strip()
        if not one.complete:
            # What a person must say has no value that could be made up.
            table = "\n".join([f"# {line}" for line in table.splitlines()] + _to_fill_in(one))
        parts.append("\n".join([*above, table]))
    if whole and role in SECTIONS and len(whole) == 1:
        parts.append(_limits(role))
    return parts


def _to_fill_in(one: Candidate) -> list[str]:
    return [f"# {name} =    # {unit_of_option(name) or '…'}" for name in one.missing]


def _limits(role: Role) -> str:
    keys = SECTIONS[role].model_fields
    lines = [f"# [instruments.{role.value}.limits]"]
    for name, field in keys.items():
        extra = field.json_schema_extra
        unit = extra.get("unit", "") if isinstance(extra, dict) else ""
        lines.append(f"# {name} =    # {unit}")
    return "\n".join(lines)


def _comment(words: Text, translate: Translate) -> str:
    # A comment in TOML holds no control characters; what an instrument says may.
    return "\n".join(f"# {shown(line)}" for line in words.render(translate).splitlines())


def _name(finding: FoundInstrument, driver: Driver) -> str:
    identity = finding.identity
    parts = (identity.model, identity.serial_number) if identity else (driver.name,)
    return re.sub(r"[^a-z0-9]+", "_", " ".join(parts).lower()).strip("_") or driver.name
