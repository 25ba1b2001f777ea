"""`motorbench eol pack`: the journals of batches that were measured before, compressed."""

from pathlib import Path

from bench.cli.options import Json, Language
from bench.cli.output import print_json
from bench.i18n.errors import FileError, InputError
from bench.i18n.language import language_of, translator
from drivers.interfaces.text import reason_of, text


def pack(*batches: str, runs: Path = Path("runs"), language: Language = "auto", json: Json = False) -> None:
    """Pack the journals of runs that have ended, of all batches where none is named; each stays readable where it is.

    A batch that is being measured packs its own.

    Parameters
    ----------
    batches
        The batches' names.
    runs
        Folder of the batches' folders.

    """
    from bench.eol.line.batch_log import FILE, held_batch, is_measured
    from bench.eol.line.packing import pack_batch

    there = sorted(log.parent.name for log in runs.glob(f"*/{FILE}"))
    missing = [name for name in batches if name not in there]
    if not there:
        raise FileError(text("{runs}: contains no batches; give the folder of the batches with --runs", runs=runs))
    if missing:
        raise FileError(
            text(
                "{runs}: contains no batch {batches}; the batches are: {names}",
                runs=runs,
                batches=missing,
                names=there[:20],
            )
        )
    try:
        packed = 0
        for name in batches or [name for name in there if not is_measured(runs / name)]:
            # Its workers pack their own.
            with held_batch(runs / name):
                packed += pack_batch(runs / name)
    except OSError as error:
        raise InputError(text("{runs}: cannot be packed: {error}", runs=runs, error=reason_of(error))) from None
    if json:
        print_json({"packed": packed})
    else:
        print(text("packed: {count}", count=packed).render(translator(language_of(language))))
