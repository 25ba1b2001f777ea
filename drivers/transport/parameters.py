"""Parameters behind the `?` of an address."""

from collections.abc import Collection, Mapping
from difflib import get_close_matches
from urllib.parse import parse_qsl

from drivers.interfaces.text import text

_TRUE, _FALSE = ("true", "1", "yes", "on"), ("false", "0", "no", "off")


def parameters_of(query: str) -> dict[str, str]:
    """Return the keys of `a=1&b=2` with their values. Raises ValueError for a key that is given twice or has no value."""
    result: dict[str, str] = {}
    for key, value in parse_qsl(query, keep_blank_values=True):
        if key in result:
            raise ValueError(text("{key} is given twice", key=key))
        if not value:
            raise ValueError(text("{key} has no value", key=key))
        result[key] = value
    return result


def refuse_unknown(given: Collection[str], known: Collection[str]) -> None:
    """Raise ValueError for a key that is not among those known: a misspelt one would be left at its default, unseen."""
    for key in given:
        if key in known:
            continue
        near = get_close_matches(key, known, n=1)
        if near:
            raise ValueError(text("unknown key {key}; is {near} meant?", key=key, near=near[0]))
        raise ValueError(text("unknown key {key}; there are {known}", key=key, known=", ".join(sorted(known))))


def one_of(given: Mapping[str, str], key: str, choices: Mapping[str, object], default: object) -> object:
    """Return what a key's word stands for. Raises ValueError for another word."""
    if key not in given:
        return default
    word = given[key]
    if word not in choices:
        raise ValueError(text("{key}={word}; allowed is {choices}", key=key, word=word, choices=", ".join(choices)))
    return choices[word]


def number(given: Mapping[str, str], key: str, default: float, least: float) -> float:
    """Return a number of at least `least`. Raises ValueError for anything else."""
    if key not in given:
        return default
    try:
        value = float(given[key])
    except ValueError:
        value = float("nan")
    if not least <= value < float("inf"):
        raise ValueError(
            text("{key}={word}; allowed is a number from {least:g} on", key=key, word=given[key], least=least)
        )
    return value


def whole(given: Mapping[str, str], key: str, default: int, least: int) -> int:
    """Return a whole number of at least `least`. Raises ValueError for anything else."""
    value = number(given, key, default, least)
    if value != int(value):
        raise ValueError(text("{key}={word}; allowed is a whole number", key=key, word=given[key]))
    return int(value)


def flag(given: Mapping[str, str], key: str, default: bool = False) -> bool:
    """Return whether a key is on. Raises ValueError for a word that is neither on nor off."""
    choices = dict.fromkeys(_TRUE, True) | dict.fromkeys(_FALSE, False)
    return bool(one_of({key: given[key].lower()} if key in given else {}, key, choices, default))
