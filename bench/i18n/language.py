"""The reader's language: English stands in the code, other languages in gettext catalogues."""

import os
from collections.abc import Callable, Mapping
from functools import cache
from importlib import resources

from bench.i18n.errors import UsageError
from drivers.interfaces.text import Translate, english, text

LANGUAGES = ("en", "zh")


def language_of(wish: str, environment: Mapping[str, str] | None = None) -> str:
    """Return the language of a wish `en`, `zh` or `auto`, the last by the locale of the environment."""
    if wish in LANGUAGES:
        return wish
    if wish != "auto":
        raise UsageError(text("--language {wish}: allowed are {names} and auto", wish=wish, names=LANGUAGES))
    given = os.environ if environment is None else environment
    for name in ("LC_ALL", "LC_MESSAGES", "LANG"):
        if given.get(name):
            return "zh" if given[name].lower().startswith("zh") else "en"
    return "en"


def translator(language: str) -> Translate:
    """Return what translates templates into a language; a template without a translation stays English."""
    return _looked_up(catalogue(language)) if language != "en" else english


@cache
def catalogue(language: str) -> Mapping[str, str]:
    """Return a language's templates by their English ones; English itself needs none."""
    if language == "en":
        return {}
    from babel.messages.pofile import read_po

    path = resources.files("bench.i18n") / "locale" / language / "LC_MESSAGES" / "motorbench.po"
    with path.open("rb") as file:
        messages = read_po(file, locale=language)
    return {str(m.id): str(m.string) for m in messages if m.id and m.string and not m.fuzzy}


def _looked_up(templates: Mapping[str, str]) -> Callable[[str], str]:
    def translate(template: str) -> str:
        return templates.get(template, template)

    return translate
