"""Sentences for people, kept apart from their language."""

from collections.abc import Callable, Iterable, Mapping, Sequence
from dataclasses import dataclass, field

from drivers.interfaces.system_errors import meaning

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
        template = translate(self.template)
        if template.startswith("{line0}; "):
            template = template.replace(str(_SEMICOLON), translate(str(_SEMICOLON)))
        return template.format(**{name: _render(v, translate) for name, v in self.values.items()})

    def __str__(self) -> str:
        return self.render()


def text(template: str, **values: object) -> Text:
    """Make a Text; an error among the values stands for its own message. The extraction of sentences looks for this name."""
    return Text(template, {n: text_of(v) if isinstance(v, BaseException) else v for n, v in values.items()})


def text_of(error: BaseException) -> Text:
    """Return an error's message: the Text that it holds, what the operating system's number means, else its own words."""
    for held in (getattr(error, "text", None), *error.args[:1]):
        if isinstance(held, Text):
            return held
    if isinstance(error, OSError):
        if known := meaning(error):
            reason = Text(known)
            return text("{reason}: '{file}'", reason=reason, file=error.filename) if error.filename else reason
        if error.errno is None and isinstance(error.__context__, OSError) and (known := meaning(error.__context__)):
            # A library put the system's error into words of its own.
            return Text(known)
    return Text("{message}", {"message": str(error) or type(error).__name__})


def reason_of(error: OSError) -> Text:
    """Return what the operating system's error means, without the file's name."""
    known = meaning(error)
    return Text(known) if known else Text("{message}", {"message": error.strerror or str(error)})


def word(term: Text | str) -> Text:
    """Return a term by itself, such as a quantity's name, as a Text that a catalogue may translate."""
    if isinstance(term, Text):
        return term
    return Text("{term}", {"term": term}) if "{" in term or "}" in term else Text(term)


def lines(sentences: Iterable[Text | str], between: str = "\n") -> Text:
    """Return sentences as one Text, each on a line of its own, or with something else `between` them."""
    values = {f"line{number}": sentence for number, sentence in enumerate(sentences)}
    return Text(between.join(f"{{{name}}}" for name in values), values)


#: What stands between the items of a list, and between sentences on one line; Chinese has marks of its own for them.
_BETWEEN = text(", ")
_SEMICOLON = text("; ")


def _render(value: object, translate: Translate) -> object:
    if isinstance(value, Text):
        return value.render(translate)
    if isinstance(value, Sequence) and not isinstance(value, str):
        return _BETWEEN.render(translate).join(str(_render(item, translate)) for item in value)
    return value
