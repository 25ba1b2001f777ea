"""`motorbench results unpack`: a packed journal as it was written."""

from pathlib import Path

from bench.cli.options import Language, Runs
from bench.i18n.errors import InputError, at
from bench.i18n.language import language_of, translator
from bench.journal.packed import unpack as unpack_journal
from bench.journal.run_folder import existing_run_folder
from drivers.interfaces.text import reason_of, text


def unpack(run: str, *, language: Language = "auto", runs: Runs = Path("runs")) -> None:
    """Unpack a run's journal into lines of text, byte by byte as it was written, for readers that do not know the packing.

    Parameters
    ----------
    run
        The run's folder, its name under `--runs`, or `latest`.

    """
    folder = existing_run_folder(run, runs)
    try:
        unpack_journal(folder.journal)
    except OSError as error:
        raise InputError(
            text("{path}: cannot be written: {error}", path=folder.journal, error=reason_of(error))
        ) from None
    size = text("{size:.0f} kB", size=folder.journal.stat().st_size / 1e3)
    print(at(folder.journal, size).render(translator(language_of(language))))
