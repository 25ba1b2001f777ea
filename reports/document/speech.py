"""In which language a document speaks: one, or two side by side."""

from collections.abc import Sequence
from dataclasses import dataclass

from drivers.interfaces.text import Translate
from reports.document.model import Cell


@dataclass(frozen=True)
class Speech:
    """The languages of a document, by their codes for HTML (`en`, `zh-Hans`), each with its translation."""

    languages: Sequence[tuple[str, Translate]]

    def say(self, words: Cell) -> list[str]:
        """Return the words in each language, once where all say the same; what is no text stays as it is."""
        if isinstance(words, str):
            return [words]
        said = (words.render(translate) for _, translate in self.languages)
        # A line does not break between a figure and its °C.
        return list(dict.fromkeys(one.replace(" °C", "\N{NO-BREAK SPACE}°C") for one in said))

    def together(self, template: str) -> str:
        """Return a template in every language beside each other, for a label that has one line."""
        return " ".join(dict.fromkeys(translate(template) for _, translate in self.languages))

    @property
    def codes(self) -> list[str]:
        """The languages' codes."""
        return [code for code, _ in self.languages]
