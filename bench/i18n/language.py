"""The reader's language: English stands in the code, other languages in gettext catalogues."""

import os
from collections.abc import Callable, Mapping
from functools import cache
from importlib import resources
from pathlib import Path
from string import Formatter
from typing import IO

from bench.i18n.english_names import NAMES
from bench.i18n.errors import UsageError
from drivers.interfaces.text import Translate, text

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
    """Return what translates templates into a language; a template without a translation stays English.

    English needs it for short names only, whose readers' names are in `english_names`.
    """
    return _looked_up(catalogue(language) if language != "en" else NAMES, _OF_PLUGINS[language], language)


@cache
def catalogue(language: str) -> Mapping[str, str]:
    """Return a language's templates by their English ones; English itself needs none."""
    if language == "en":
        return {}
    return _shipped("motorbench.po", language)


@cache
def former(language: str) -> Mapping[str, str]:
    """Return a language's templates by the English ones of former versions, which journals of theirs hold."""
    return {} if language == "en" else _shipped("former.po", language)


def _shipped(name: str, language: str) -> dict[str, str]:
    path = resources.files("bench.i18n") / "locale" / language / "LC_MESSAGES" / name
    with path.open("rb") as file:
        return _templates(file, language)


def add_translations_beside(module: Path) -> None:
    """Take a plug-in's own translations, `NAME.zh.po` beside its `NAME.py`; where motorbench has a sentence, its own stands.

    They hold for the process, as the module itself does. Raises ValueError for a file that cannot be read, and for a translation
    whose placeholders are not those of its sentence.
    """
    for language in LANGUAGES:
        path = module.with_suffix(f".{language}.po")
        if not path.is_file():
            continue
        from babel.messages.pofile import PoFileError

        try:
            with path.open("rb") as file:
                templates = _templates(file, language, strict=True)
        except (OSError, ValueError, LookupError, PoFileError) as error:
            raise ValueError(text("{file} cannot be read: {error}", file=path.name, error=error)) from None
        for english_template, template in templates.items():
            if (there := _placeholders(template)) is None or not there <= (_placeholders(english_template) or set()):
                raise ValueError(
                    text(
                        "{file}: the translation {translation!r} must have the placeholders of {sentence!r}, and no other",
                        file=path.name,
                        translation=template,
                        sentence=english_template,
                    )
                )
        _OF_PLUGINS[language].update(templates)


def add_title(name: str, title: str) -> None:
    """Take the English title by which readers know a procedure; ours stand in `english_names`."""
    _TITLES[name] = title


#: What the plug-ins loaded in this process brought, by language, and the titles of the procedures loaded by name.
_OF_PLUGINS: dict[str, dict[str, str]] = {language: {} for language in LANGUAGES}
_TITLES: dict[str, str] = {}


def _templates(file: IO[bytes], language: str, *, strict: bool = False) -> dict[str, str]:
    from babel.messages.pofile import read_po

    messages = read_po(file, locale=language, abort_invalid=strict)
    return {str(m.id): str(m.string) for m in messages if m.id and m.string and not m.fuzzy}


def _placeholders(template: str) -> set[str] | None:
    """Return the names in a template's braces, None where its braces do not match."""
    try:
        return {name for _, name, _, _ in Formatter().parse(template) if name is not None}
    except ValueError:
        return None


def _looked_up(templates: Mapping[str, str], of_plugins: Mapping[str, str], language: str) -> Callable[[str], str]:
    def translate(template: str) -> str:
        for known in (templates, of_plugins):
            if template in known:
                return known[template]
        if (title := _TITLES.get(template, template)) != template:
            return translate(title)
        # A template without spaces is a name, which no version words anew.
        return former(language).get(template, template) if " " in template else template

    return translate
