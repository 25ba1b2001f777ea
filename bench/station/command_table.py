"""The commands that drivers send, and their sources: by driver, and as the tables of the documentation."""

from collections.abc import Mapping, Sequence

from bench.plugins.catalogues import Catalogues
from drivers.command_sources import SourcedCommand, sources_of
from drivers.interfaces.text import Translate, text

Tables = Mapping[str, Sequence[SourcedCommand]]


def packages_with_commands(catalogues: Catalogues) -> Mapping[str, str]:
    """Return the packages that drivers name for their commands: of instruments, then watchdog relays, then interlocks."""
    packages = {
        **{name: driver.commands_in for name, roles in catalogues.drivers.items() for driver in roles},
        **{name: relay.commands_in for name, relay in catalogues.watchdog_relays.items()},
        **{name: contact.commands_in for name, contact in catalogues.interlocks.items()},
    }
    return {name: package for name, package in packages.items() if package}


def markdown_tables(tables: Tables, translate: Translate) -> str:
    """Return a section for each driver: its commands with their sources by key, and what the keys stand for."""
    return "\n".join(_section(name, commands, translate) for name, commands in tables.items())


def _section(name: str, commands: Sequence[SourcedCommand], translate: Translate) -> str:
    title = f"## `{name}`\n\n"
    if not commands:
        return f"{title}{text('it sends nothing').render(translate)}\n"
    rows = [
        (one.command, one.words.render(translate), ", ".join(f"`{source.key}`" for source in one.sources) or "–")
        for one in commands
    ]
    head = tuple(heading.render(translate) for heading in (text("command"), text("known by"), text("sources")))
    lines = [
        f"| {' | '.join(head)} |",
        "| --- | --- | --- |",
        *(f"| `{row[0]}` | {row[1]} | {row[2]} |" for row in rows),
    ]
    messages = [f"- `{source.key}`: {source.name}; {source.address}" for source in sources_of(commands)]
    return title + "\n".join([*lines, "", *messages]) + "\n"
