"""What instruments set by hand ask for, in the reader's language: drivers speak English sentences with figures in them."""

import re
from collections.abc import Mapping

#: A figure's place in a template of the catalogue: {0}, {1}, …
_PLACE = re.compile(r"\{(\d+)\}")


def translate_said(sentence: str, templates: Mapping[str, str]) -> str:
    """Return a finished English sentence in the reader's language.

    `templates` maps English templates with numbered places to translated ones; a sentence that fits none stays as it is.
    """
    if sentence in templates:
        return templates[sentence]
    for template, translated in templates.items():
        if "{0}" not in template:
            continue
        pattern = "(.+)".join(re.escape(part) for part in _PLACE.split(template)[::2])
        match = re.fullmatch(pattern, sentence)
        if match:
            return translated.format(*match.groups())
    return sentence
