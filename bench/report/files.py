"""A run's report as files: page and PDF."""

from collections.abc import Mapping
from concurrent.futures import ThreadPoolExecutor
from pathlib import Path
from typing import TYPE_CHECKING, Any

from bench.i18n.errors import InputError
from bench.i18n.language import language_of, translator
from bench.journal.disk import write_file
from bench.journal.errors import RecordError
from drivers.interfaces.text import reason_of, text

if TYPE_CHECKING:
    from bench.journal.finished_run import FinishedRun
    from reports.document.speech import Speech

#: Codes by which HTML names the languages.
_CODES = {"en": "en", "zh": "zh-Hans"}


def speech(language: str) -> "Speech":
    """Return the languages of a wish: en, zh, both, or auto by the locale."""
    from reports.document.speech import Speech

    codes = ("en", "zh") if language == "both" else (name_of(language),)
    return Speech([(_CODES[code], translator(code)) for code in codes])


def name_of(language: str) -> str:
    """Return a wish's language as files are named by it: en, zh or both."""
    return language if language == "both" else language_of(language)


def rendered(run: "FinishedRun", language: str, drawn: Mapping[str, str] | None = None) -> dict[str, Any]:
    """Return a run's report in its languages; `drawn` holds plots that were drawn before, by name."""
    from bench.report.evidence import record_of
    from reports.document.compose import compose
    from reports.document.render import render

    return render(compose(record_of(run)), speech(language), drawn or {})


def write_both(report: Mapping[str, Any], folder: Path, language: str) -> tuple[Path, Path]:
    """Write page and PDF, the one while the other is set; raises InputError where one cannot be written."""
    with ThreadPoolExecutor(1) as beside:
        paper = beside.submit(write_paper, report, folder, language)
        page = write_page(report, folder, language)
        return page, paper.result()


def write_page(report: Mapping[str, Any], folder: Path, language: str) -> Path:
    """Write a rendered report as HTML, named by its language, and return the file. Raises InputError where it cannot be written."""
    from reports.document.page import page

    return _write(folder / f"report-{name_of(language)}.html", page(report).encode("utf-8"))


def write_paper(report: Mapping[str, Any], folder: Path, language: str) -> Path:
    """Write a rendered report as PDF, named by its language, and return the file. Raises InputError where it cannot be written."""
    from reports.document.paper import paper

    return _write(folder / f"report-{name_of(language)}.pdf", paper(report))


def _write(path: Path, content: bytes) -> Path:
    try:
        path.parent.mkdir(parents=True, exist_ok=True)
        write_file(path, content)
    except RecordError as error:
        raise InputError(
            text("{path}: the report cannot be written: {strerror}", path=path, strerror=reason_of(error.cause))
        ) from None
    except OSError as error:
        raise InputError(
            text("{parent}: the folder cannot be made: {strerror}", parent=path.parent, strerror=reason_of(error))
        ) from None
    return path
