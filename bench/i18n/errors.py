"""Errors that a person can correct: bad files, bad arguments, runs that cannot go on."""

from os.path import basename

from drivers.interfaces.text import Text, Translate, lines, text, text_of


class InputError(Exception):
    """Something given by the user cannot be used; the message names the file, the key, what was given and what is allowed.

    As a string it is English; `message` says it in another language where it holds a Text.
    """

    def __init__(self, said: Text | str) -> None:
        super().__init__(said)
        self.text = said if isinstance(said, Text) else untranslated(said)


class FileError(InputError):
    """A file or folder that was named is not there, cannot be read or holds something else: a command then ends as on wrong usage."""


class UsageError(InputError):
    """The command line asks for something that does not exist or does not go together."""


def at(place: object, said: Text | str) -> Text:
    """Return what is said of a place: a file, a key, an option."""
    return text("{place}: {said}", place=place, said=said)


def message(cause: BaseException, translate: Translate) -> str:
    """Return what went wrong in the reader's language, with the notes that the shutdown added."""
    return told(cause).render(translate)


def told(cause: BaseException) -> Text:
    """Return what went wrong, with the notes that the shutdown added, for a reader of any language."""
    sentence = text_of(cause)
    named = sentence if sentence.render() else untranslated(type(cause).__name__)
    notes = [untranslated(note) for note in getattr(cause, "__notes__", ())]
    return lines([named, *notes]) if notes else named


def fault(error: BaseException) -> Text:
    """Return what an error in a program says, ours or a plug-in's: its kind, and the file and line that raised it."""
    place, trace = type(error).__name__, error.__traceback__
    while trace is not None and trace.tb_next is not None:
        trace = trace.tb_next
    if trace is not None:
        place += f" ({basename(trace.tb_frame.f_code.co_filename)}:{trace.tb_lineno})"
    return at(place, told(error))


#: Where there is nothing to say.
NOTHING = Text("")


def untranslated(words: str) -> Text:
    """Return words as they stand in every language."""
    return Text("{said}", {"said": words})
