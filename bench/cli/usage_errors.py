"""Answers to a command line that cannot be understood."""

from collections.abc import Sequence
from difflib import get_close_matches
from pathlib import Path
from typing import Literal, get_args, get_origin

from cyclopts import (
    CoercionError,
    CycloptsError,
    MissingArgumentError,
    RepeatArgumentError,
    UnknownCommandError,
    UnknownOptionError,
    UnusedCliTokensError,
    ValidationError,
)

from drivers.interfaces.text import Text, text, word

_KINDS = {int: text("a whole number"), float: text("a number"), bool: text("yes or no"), Path: text("a path")}
#: What the options' validators say.
_BOUNDS = {str(bound): bound for bound in (text("Must be >= 0."),)}


def said_of(error: CycloptsError) -> Text:
    """Return what is wrong with a command line, and what was likely meant."""
    return text("{said} See motorbench --help", said=_said(error))


def _said(error: CycloptsError) -> Text:
    match error:
        case UnknownOptionError():
            given = error.token.keyword or error.token.value
            known = [name for argument in error.argument_collection for name in argument.names]
            return _meant(text("Unknown option: {given}.", given=given), given, known)
        case UnknownCommandError() if error.unused_tokens:
            given = error.unused_tokens[0]
            known = [name for name in error.app or () if not name.startswith("-")]
            said = _meant(text('Unknown command "{given}".', given=given), given, known)
            return text("{said} Commands: {known}.", said=said, known=known) if known else said
        case UnusedCliTokensError():
            return text("More than this command takes: {tokens}.", tokens=list(error.unused_tokens or ()))
        case RepeatArgumentError():
            return text("{name} is given more than once.", name=error.token.keyword or "")
        case MissingArgumentError() if type(error) is MissingArgumentError and error.argument is not None:
            return text("{name} needs a value.", name=error.keyword or error.argument.name)
        case ValidationError() if error.argument is not None:
            why = error.exception_message
            given = " ".join(token.value for token in error.argument.tokens)
            name, bound = error.argument.name, _BOUNDS.get(why, word(why))
            return text("{name} cannot be {value}. {why}", name=name, value=given, why=bound)
        case CoercionError() if error.token is not None and error.msg is None and error.target_type in _KINDS:
            kind = _KINDS[error.target_type]
            name = error.token.keyword or (error.argument.name if error.argument is not None else "")
            return text('{name}: "{value}" is not {kind}.', name=name, value=error.token.value, kind=kind)
        case CoercionError() if error.token is not None and get_origin(error.target_type) is Literal:
            name = error.token.keyword or (error.argument.name if error.argument is not None else "")
            given, allowed = error.token.value, [str(one) for one in get_args(error.target_type)]
            return _meant(
                text("{name} {value}: allowed are {names}.", name=name, value=given, names=allowed), given, allowed
            )
    return Text("{said}", {"said": str(error).strip()})


def _meant(said: Text, given: str, known: Sequence[str]) -> Text:
    near = get_close_matches(given, known, n=1)
    return text("{said} Did you mean {near}?", said=said, near=near[0]) if near else said
