"""For whom a page is built, and in which language."""

from dataclasses import dataclass
from functools import lru_cache

from bench.i18n.errors import message
from bench.i18n.language import translator
from bench.panel.sessions import Session
from drivers.interfaces.text import Text, Translate


@dataclass(frozen=True)
class Reader:
    """For whom a page is built: the session, and the session's language."""

    session: Session

    @property
    def translate(self) -> Translate:
        """What gives templates in the reader's language."""
        return _translator(self.session.language)

    def say(self, words: Text) -> str:
        """Return a sentence in the reader's language."""
        return words.render(self.translate)

    def fault(self, error: Exception) -> str:
        """Return what went wrong in the reader's language."""
        return message(error, self.translate)


#: Catalogues are files; a page asks for hundreds of sentences.
_translator = lru_cache(maxsize=8)(translator)
