"""`motorbench eol close`: a batch that was broken off and is not to go on."""

from pathlib import Path

from bench.cli.options import Json, Language
from bench.cli.output import print_json
from bench.i18n.errors import FileError
from bench.i18n.language import language_of, translator
from drivers.interfaces.text import text


def close(
    *batches: str, runs: Path = Path("runs"), person: str = "", language: Language = "auto", json: Json = False
) -> None:
    """Close batches that were broken off, so that the panel names them no more; list them where none is named.

    Records and runs stay, and the same command of `eol run` goes on with a closed batch as well.

    Parameters
    ----------
    batches
        The batches' names.
    runs
        Folder of the batches' folders.
    person
        Name of the person who closes them, for the batch's file.

    """
    from bench.eol.line.batch_log import FILE, batches_broken_off, close_batch

    if not runs.is_dir() or not any(runs.glob(f"*/{FILE}")):
        raise FileError(text("{runs}: contains no batches; give the folder of the batches with --runs", runs=runs))
    there = batches_broken_off(runs)
    missing = [name for name in batches if name not in there]
    if missing:
        raise FileError(
            text(
                "{runs}: there is no batch {batches} that was broken off; those that were: {names}",
                runs=runs,
                batches=missing,
                names=there[:20] or text("none"),
            )
        )
    for name in batches:
        close_batch(runs / name, person)
    if json:
        print_json({"closed": list(batches), "broken_off": [name for name in there if name not in batches]})
        return
    words = (
        text("closed: {names}. Records and runs stay; the same command of eol run would go on", names=list(batches))
        if batches
        else text("broken off and not begun again, the latest first: {names}", names=there or text("none"))
    )
    print(words.render(translator(language_of(language))))
