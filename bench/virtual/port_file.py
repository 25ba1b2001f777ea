"""Ports of a served bench: a TOML file with a table for each endpoint, by its name."""

from pathlib import Path

from bench.files.toml_file import Section, read, validate
from bench.i18n.errors import FileError
from bench.motor.motor_sections import number
from drivers.interfaces.text import text

_LAST = 65535


class EndpointSection(Section):
    """`[ROLE]`, `[can]`, `[emergency_stop]`, `[supply_enable]` or `[control]`: its TCP ports."""

    hislip: int | None = number("", None, at_least=1, up_to=_LAST)
    socket: int | None = number("", None, at_least=1, up_to=_LAST)
    tcp: int | None = number("", None, at_least=1, up_to=_LAST)
    http: int | None = number("", None, at_least=1, up_to=_LAST)


def load_ports(path: Path) -> dict[str, dict[str, int]]:
    """Return ports by endpoint and way. Raises InputError with file, key and what is allowed for a bad one."""
    _, data = read(path, text("file of ports"))
    ports: dict[str, dict[str, int]] = {}
    owners: dict[int, str] = {}
    for name, table in data.items():
        if not isinstance(table, dict):
            raise FileError(text("{path}: {name} must be a table, like [{name}]", path=path, name=name))
        ports[name] = validate(EndpointSection, table, str(path), name).model_dump(exclude_none=True)
        for way, port in ports[name].items():
            key = f"{name}.{way}"
            if port in owners:
                raise FileError(
                    text("{path}: {key} = {port} is {other}'s, too", path=path, key=key, port=port, other=owners[port])
                )
            owners[port] = key
    return ports
