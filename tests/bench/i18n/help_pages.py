"""The help of every command, and what a translation of it is asked for."""

from collections.abc import Iterator
from contextlib import redirect_stdout
from io import StringIO

from cyclopts import App

from bench.cli.help import in_language
from bench.cli.main import make_app


def commands(app: App, path: tuple[str, ...] = ()) -> Iterator[tuple[str, ...]]:
    """Every command and group of commands, as it is typed."""
    yield path
    for name in app:
        if not name.startswith("-"):
            yield from commands(app[name], (*path, name))


def asked_for() -> dict[str, str]:
    """What the pages of all commands would translate, and the first that asks."""
    asked: list[str] = []

    def asking(template: str) -> str:
        asked.append(template)
        return template

    found: dict[str, str] = {}
    app = in_language(make_app(), asking)
    for path in commands(make_app()):
        with redirect_stdout(StringIO()):
            app([*path, "--help"], exit_on_error=False)
        found |= {each: "motorbench " + " ".join([*path, "--help"]) for each in asked if each and each not in found}
        asked.clear()
    return found
