"""Output of commands: the summary for people, one JSON object for programs."""

import sys
from collections.abc import Callable, Iterable, Mapping
from shlex import quote
from typing import TYPE_CHECKING, Any

from bench.journal.encoding import indented
from bench.journal.run_folder import RunFolder
from bench.journal.run_view import RunView
from bench.plugins.catalogue import BrokenPlugin, Catalogue
from bench.plugins.catalogues import Catalogues
from bench.run.console import console_on
from drivers.interfaces.text import Translate, text

if TYPE_CHECKING:
    from bench.run.request import Finished


def print_json(made: Mapping[str, Any]) -> None:
    """Print one object on standard output."""
    sys.stdout.write(indented(made) + "\n")


def say_broken(broken: Iterable[BrokenPlugin], translate: Translate) -> None:
    """Name on standard error what of the plug-ins cannot be used; a run goes on without it."""
    for one in broken:
        print(f"motorbench: {one.sentence.render(translate)}", file=sys.stderr)


def broken_of(catalogues: Catalogues, catalogue: Catalogue[Any]) -> tuple[BrokenPlugin, ...]:
    """Return what of one catalogue cannot be used, and the plug-ins that cannot be used at all."""
    return (*catalogues.unusable, *catalogue.broken())


def padded(words: str, width: int) -> str:
    """Return words filled up to so many columns of a terminal, of which a Chinese character takes two."""
    from rich.cells import cell_len

    return words + " " * max(width - cell_len(words), 0)


def print_catalogue(catalogue: Catalogue[Any], about: Callable[[str], str]) -> None:
    """Print names, what is said of each, and where it comes from."""
    console = console_on(sys.stdout)
    for name in catalogue:
        console.print(f"{name:<28}{padded(about(name), 60)} {catalogue.origin(name)}", markup=False, soft_wrap=True)


def print_summary(view: RunView, folder: RunFolder, translate: Translate) -> None:
    """Print the table, the warnings, how long it took and where the run lies."""
    from reports.tables.summary import summary

    console = console_on(sys.stdout)
    console.print(summary(view.parameters(), view.warnings(), view.truth, translate, console.width))
    console.print()
    if view.wall_time > 0.0 and view.truth:
        # A run of an older version does not say how long its hands took.
        by_hand = text(
            "Bench time {bench:.0f} s ({hands:.0f} s of it manual work) in {wall:.2f} s of real time: {ratio:.0f} ×",
            bench=view.bench_time,
            hands=view.hand_time,
            wall=view.wall_time,
            ratio=view.bench_time / view.wall_time,
        )
        times = text(
            "Bench time {bench:.0f} s in {wall:.2f} s of real time: {ratio:.0f} ×",
            bench=view.bench_time,
            wall=view.wall_time,
            ratio=view.bench_time / view.wall_time,
        )
        console.print((by_hand if view.hand_time else times).render(translate), markup=False)
    console.print(text("Run: {folder}", folder=str(folder.path)).render(translate), markup=False, soft_wrap=True)


def print_next_steps(folder: RunFolder, translate: Translate) -> None:
    """Say which commands make something of a run."""
    message = text(
        "Next: motorbench report {folder}; motorbench export {folder} --for vesc (motorbench export --list names all)",
        folder=quote(str(folder.path)),
    )
    console_on(sys.stdout).print(message.render(translate), markup=False, soft_wrap=True)


def print_page(page: str, folder: RunFolder, translate: Translate) -> None:
    """Say where a run's page is; where it could not be drawn, what says why."""
    message = (
        text("Report: {page}", page=page)
        if page
        else text(
            "The report's page could not be made; motorbench report {folder} shows the reason",
            folder=quote(str(folder.path)),
        )
    )
    console_on(sys.stdout).print(message.render(translate), markup=False, soft_wrap=True)


def print_end(view: RunView, folder: RunFolder, translate: Translate, *, resumable: bool = True) -> None:
    """Say on standard error why a run did not complete."""
    said: dict[str, object] = {
        "status": STATUS_WORDS.get(view.status, text("was interrupted")),
        "cause": view.cause or text("its process ended without a word"),
        "folder": str(folder.path),
    }
    words = text("the run {status}: {cause}\nThe journal is in {folder}; continue with --resume {folder}", **said)
    if not resumable:
        words = text("the run {status}: {cause}\nThe journal is in {folder}", **said)
    print(f"motorbench: {words.render(translate)}", file=sys.stderr)


def say_missing(done: "Finished", translate: Translate) -> int:
    """Return the exit status of a run that completed: 1, said on standard error, where something asked for is not there.

    That is a figure that is withheld, and a fault that never took effect.
    """
    said = []
    if withheld := done.view.parameters().withheld:
        said.append(text("not given: {names}", names=[reasons[0].label for reasons in withheld.values()]))
    said += [
        text(
            "{source}: this fault had no effect; check that the run uses its instrument and reaches its step",
            source=source,
        )
        for source in done.unfelt
    ]
    for sentence in said:
        print(f"motorbench: {sentence.render(translate)}", file=sys.stderr)
    return 1 if said else 0


STATUS_WORDS = {
    "failed": text("failed"),
    "aborted": text("was aborted"),
    "interrupted": text("was interrupted"),
}
