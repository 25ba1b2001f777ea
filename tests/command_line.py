"""The command line, in this process."""

from collections.abc import Callable
from contextlib import AbstractContextManager, nullcontext

import pytest

from bench.cli.main import main

#: Takes what is typed after `motorbench`; returns exit status, standard output and standard error.
Call = Callable[..., tuple[int, str, str]]


def called(capsys: pytest.CaptureFixture[str], *arguments: str) -> tuple[int, str, str]:
    """Return what a `Call` does; a traceback fails the test."""
    with _workers(arguments), pytest.raises(SystemExit) as stop:
        main(arguments)
    out, err = capsys.readouterr()
    assert "Traceback" not in out + err
    return int(stop.value.code or 0), out, err


def _workers(arguments: tuple[str, ...]) -> AbstractContextManager[None]:
    if arguments[:1] != ("eol",):
        return nullcontext()
    from tests.bench.eol.loaded_workers import loaded_workers

    return loaded_workers()
