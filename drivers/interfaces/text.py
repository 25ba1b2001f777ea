"""Sentences for people, kept apart from their language."""

from collections.abc import Callable, Iterable, Mapping, Sequence
from dataclasses import dataclass, field

#: Gives a template in the reader's language; the English template is the key.
Translate = Callable[[str], str]


def english(template: str) -> str:
    """Return the template itself."""
    return template


@dataclass(frozen=True)
class Text:
    """An English template with its values; values may be texts themselves, or sequences of them."""

    template: str
    values: Mapping[str, object] = field(default_factory=dict)

    def render(self, translate: Translate = english) -> str:
        """Return the sentence in the language that `translate` gives."""
        return translate(self.template).format(**{name: _render(v, translate) for name, v in self.values.items()})

    def __str__(self) -> str:
        return self.render()


def text(template: str, **values: object) -> Text:
    """Make a Text; the extraction of translatable sentences looks for this name."""
    return Text(template, values)


def lines(sentences: Iterable[Text | str], between: str = "\n") -> Text:
    """Return sentences as one Text, each on a line of its own, or with something else `between` them."""
    values = {f"line{number}": sentence for number, sentence in enumerate(sentences)}
    return Text(between.join(f"{{{name}}}" for name in values), values)


#: What stands between the items of a list; Chinese has a comma of its own for it.
_BETWEEN = text(", ")


def _render(value: object, translate: Translate) -> object:
    if isinstance(value, Text):
        return value.render(translate)
    if isinstance(value, Sequence) and not isinstance(value, str):
        return _BETWEEN.render(translate).join(str(_render(item, translate)) for item in value)
    return value
