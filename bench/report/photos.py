"""The photos that a run kept, to be shown."""

from collections.abc import Callable
from functools import partial

from bench.drawings.photo import photo_svg
from bench.journal.run_folder import RunFolder
from drivers.interfaces.text import Text, Translate, text

_SHOWN = {"motor": text("Photo of the motor"), "station": text("Photo of the bench")}


def photos_of(folder: RunFolder) -> list[tuple[Text, Callable[[Translate], str]]]:
    """Return what each photo of a run shows, and what makes it a picture; none where none was kept or it is gone."""
    result: list[tuple[Text, Callable[[Translate], str]]] = []
    for what, words in _SHOWN.items():
        try:
            jpeg = folder.photo(what).read_bytes()
            photo_svg(jpeg, "")
        except (OSError, ValueError):
            # Somebody's hand was in the folder: the report does without.
            continue
        result.append((words, partial(_drawn, jpeg, words)))
    return result


def _drawn(jpeg: bytes, words: Text, translate: Translate) -> str:
    return photo_svg(jpeg, words.render(translate))
