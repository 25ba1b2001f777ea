"""`motorbench station drivers`: what a station may name, and where it comes from."""

import sys

from bench.cli.options import Json
from bench.cli.output import padded, print_catalogue, print_json, say_broken
from bench.i18n.errors import InputError, UsageError
from bench.i18n.language import language_of, translator
from bench.plugins.catalogues import Catalogues
from bench.plugins.requirements import unmet_requirements
from bench.station.command_table import markdown_tables, packages_with_commands
from bench.station.station_file import catalogues_at
from drivers.command_sources import SourcedCommand, SourcesError, declared_commands, sources_of
from drivers.interfaces.text import Text, Translate, lines, text, text_of, word


def drivers(
    name: str = "", *, station: str = "virtual", language: str = "auto", json: Json = False, markdown: bool = False
) -> int:
    """List the drivers by role, those of safety devices, the simulated instruments and the outputs, and where each comes from.

    Parameters
    ----------
    name
        A driver. Lists each command that it sends to its instrument, and the source that documents the command.
    station
        A station file. Its plug-ins are listed too.
    language
        en, zh, or auto (by the locale). Default for JSON: en.
    markdown
        Print the tables of `docs/reference/instrument-commands.md`, for the named driver or for all that have one.

    """
    catalogues = catalogues_at(station)
    if markdown:
        return _print_markdown(name, catalogues, translator(language_of(language)))
    if name:
        return _commands_of(name, catalogues, translator(language_of(language)), json=json)
    found, simulated, outputs = catalogues.drivers, catalogues.simulated_instruments, catalogues.records
    relays, contacts = catalogues.watchdog_relays, catalogues.interlocks
    listed = [
        {
            "name": driver.name,
            "role": driver.role.value,
            "simulated": driver.simulated or None,
            "sources": list(driver.sources),
            "from": found.origin(name).as_dict(),
        }
        for name, roles in found.items()
        for driver in roles
    ]
    broken, unmet = catalogues.broken(), unmet_requirements(catalogues)
    if json:
        print_json(
            {
                "drivers": listed,
                "watchdog_relays": [
                    {"name": name, "sources": list(kind.sources), "from": relays.origin(name).as_dict()}
                    for name, kind in relays.items()
                ],
                "interlocks": [
                    {"name": name, "schemes": kind.schemes, "from": contacts.origin(name).as_dict()}
                    for name, kind in contacts.items()
                ],
                "simulated_instruments": [
                    {"name": name, "role": kind.role, "from": simulated.origin(name).as_dict()}
                    for name, kind in simulated.items()
                ],
                "records": [{"name": name, "from": outputs.origin(name).as_dict()} for name in outputs],
                "broken": [one.as_dict() for one in broken],
                "unmet_requirements": [str(said) for said in unmet],
            }
        )
        return 0
    translate = translator(language_of(language))

    def say(said: Text | str) -> str:
        return word(said).render(translate)

    print_catalogue(found, lambda name: say(lines((word(one.role.value) for one in found[name]), ", ")))
    print()
    for name, roles in found.items():
        for source in dict.fromkeys(source for driver in roles for source in driver.sources):
            print(f"{name:<28}{say(text('source: {source}', source=word(source)))}")
    for name, relay in relays.items():
        for source in relay.sources:
            print(f"{name:<28}{say(text('source: {source}', source=word(source)))}")
    print()
    print_catalogue(relays, lambda _: say(text("watchdog relay")))
    print()
    print_catalogue(contacts, lambda name: " ".join([say(text("interlock")), *contacts[name].schemes]))
    print()
    print_catalogue(simulated, lambda name: say(text("simulated {role}", role=word(simulated[name].role))))
    print()
    print_catalogue(outputs, lambda _: say(text("records")))
    say_broken(broken, translate)
    for said in unmet:
        print(f"motorbench: {said.render(translate)}", file=sys.stderr)
    return 0


def _commands_of(name: str, catalogues: Catalogues, translate: Translate, *, json: bool) -> int:
    """Print one driver's commands with their sources. Raises InputError for a driver that says nothing of them."""
    commands = _declared(name, catalogues)
    if json:
        print_json({"driver": name, "commands": [_described(one) for one in commands]})
        return 0
    if not commands:
        print(text("it sends nothing").render(translate))
    for one in commands:
        keys = ", ".join(source.key for source in one.sources) or "–"
        print(f"{one.command:<32}{padded(one.words.render(translate), 24)}{keys}")
    print()
    for source in sources_of(commands):
        print(f"{source.key:<16}{source.name}\n{'':<16}{source.address}")
    return 0


def _declared(name: str, catalogues: Catalogues) -> tuple[SourcedCommand, ...]:
    packages = packages_with_commands(catalogues)
    if name not in packages:
        raise UsageError(
            text(
                "{name}: no driver of this name states the sources of its commands; those that do are: {known}",
                name=name,
                known=", ".join(packages),
            )
        )
    try:
        return declared_commands(packages[name], name)
    except SourcesError as error:
        raise InputError(text_of(error)) from error


def _print_markdown(name: str, catalogues: Catalogues, translate: Translate) -> int:
    """Print the tables of one driver, or of all; where a table cannot be had, that is said and the others are printed."""
    tables, failed = {}, False
    for one in (name,) if name else packages_with_commands(catalogues):
        try:
            tables[one] = _declared(one, catalogues)
        except InputError as error:
            if name:
                raise
            failed = True
            print(f"motorbench: {text_of(error).render(translate)}", file=sys.stderr)
    sys.stdout.write(markdown_tables(tables, translate))
    return 1 if failed else 0


def _described(one: SourcedCommand) -> dict[str, object]:
    return {
        "command": one.command,
        "independent": one.independent,
        "sources": [{"name": source.name, "address": source.address} for source in one.sources],
    }
