"""One fault in a few words, as a flag takes it: `supply: silence on MEAS:CURR at step 3.2.2/3 after 0.5 for 2`."""

import shlex
from collections.abc import Callable, Iterator
from typing import Any

from bench.files.typed_value import typed_value
from bench.i18n.errors import UsageError, at
from drivers.interfaces.text import Text, lines, text, text_of

_FORM = text(
    "give [ROLE:] FAULT [KEY=VALUE …] [on PATTERN] [at TIME | at step STEP [of PROCEDURE] | when ROLE PATTERN] "
    "[after TIME] [for TIME]"
)


def parse_phrase(phrase: str) -> dict[str, Any]:
    """Return the table that a fault file would have for it. Raises UsageError that names the word that does not fit."""
    try:
        words = iter(shlex.split(phrase))
    except ValueError as error:
        raise UsageError(_refused(phrase, text_of(error))) from None
    result: dict[str, Any] = {}
    for word in words:
        try:
            _take(word, words, result)
        except StopIteration:
            raise UsageError(_refused(phrase, text("something is missing after {word!r}", word=word))) from None
        except ValueError as error:
            raise UsageError(_refused(phrase, text_of(error))) from None
    return result


def _refused(phrase: str, said: Text) -> Text:
    return at(f'--fault "{phrase}"', lines((said, _FORM), between="; "))


def _take(word: str, words: Iterator[str], told: dict[str, Any]) -> None:
    clause = _CLAUSES.get(word)
    key, equals, value = word.partition("=")
    if "fault" not in told:
        if word.endswith(":") and "role" not in told:
            told["role"] = word[:-1]
        else:
            told["fault"] = word.replace("-", "_")
    elif word == "at":
        place = next(words)
        if place == "step":
            _put(told, "step", next(words))
        else:
            _put(told, "at", _time(place))
    elif word == "when":
        _put(told, "message", {"role": next(words), "pattern": next(words)})
    elif clause is not None:
        name, read = clause
        _put(told, name, read(next(words)))
    elif equals and key:
        _put(told, key, typed_value(value))
    elif word != "s":
        raise ValueError(text("{word!r} does not fit", word=word))


def _put(told: dict[str, Any], key: str, value: Any) -> None:
    if key in told:
        raise ValueError(text("{key} is given twice", key=key))
    told[key] = value


def _time(word: str) -> float:
    try:
        return float(word.removesuffix("s"))
    except ValueError:
        raise ValueError(text("{word!r} is no time in seconds", word=word)) from None


#: What one word follows: the key in the table, and how the word is read.
_CLAUSES: dict[str, tuple[str, Callable[[str], Any]]] = {
    "on": ("pattern", str),
    "of": ("procedure", str),
    "after": ("after", _time),
    "for": ("duration", _time),
}
