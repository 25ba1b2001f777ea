"""`motorbench station drivers`: what a station may name, and where it comes from."""

from bench.cli.output import print_catalogue, print_json, say_broken
from bench.i18n.language import language_of, translator
from bench.station.station_file import catalogues_at
from drivers.interfaces.text import Text, lines, text, word


def drivers(*, station: str = "virtual", language: str = "auto", json: bool = False) -> int:
    """List the drivers by role, those of safety devices, the simulated instruments and the outputs, and where each comes from.

    Parameters
    ----------
    station
        A station file, whose plug-ins are listed too.
    language
        en, zh, or auto by the locale; JSON is English where none is asked for.
    json
        Print one JSON object and nothing else.

    """
    catalogues = catalogues_at(station)
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
    broken = catalogues.broken()
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
            print(f"{name:<28}{say(text('written from {source}', source=word(source)))}")
    for name, relay in relays.items():
        for source in relay.sources:
            print(f"{name:<28}{say(text('written from {source}', source=word(source)))}")
    print()
    print_catalogue(relays, lambda _: say(text("watchdog relay")))
    print()
    print_catalogue(contacts, lambda name: " ".join([say(text("interlock")), *contacts[name].schemes]))
    print()
    print_catalogue(simulated, lambda name: say(text("simulated {role}", role=word(simulated[name].role))))
    print()
    print_catalogue(outputs, lambda _: say(text("records")))
    say_broken(broken, translate)
    return 0
