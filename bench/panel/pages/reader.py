"""For whom a page is built, and in which language."""

from dataclasses import dataclass
from functools import lru_cache

from bench.i18n.errors import message
from bench.i18n.language import translator
from bench.panel.server.sessions import Session
from drivers.interfaces.text import Text, Translate, word
from reports.tables.figures import with_minus


@dataclass(frozen=True)
class Reader:
    """For whom a page is built: the session, and the session's language."""

    session: Session

    @property
    def translate(self) -> Translate:
        """The translation of templates into the reader's language."""
        return _translator(self.session.language)

    def say(self, words: Text) -> str:
        """Return a sentence in the reader's language."""
        return with_minus(words.render(self.translate))

    def term(self, name: str) -> str:
        """Return a short name such as `ac-coupled` in the reader's language; as words where that has none of its own for it."""
        said = self.say(word(name))
        return said.replace("-", " ") if said == name else said

    def fault(self, error: Exception) -> str:
        """Return what went wrong in the reader's language."""
        return message(error, self.translate)


#: Catalogues are files; a page asks for hundreds of sentences.
_translator = lru_cache(maxsize=8)(translator)
