"""Products of a run: exports and the report, each shown with its result, and downloaded as often as wanted."""

from dataclasses import dataclass
from pathlib import Path

from nicegui import ui

from bench.panel.child_command import child_command
from bench.panel.live.live_run import LiveRun
from bench.panel.pages.parts import expansion, named
from bench.panel.pages.reader import Reader
from drivers.interfaces.text import text

#: Lines of a made text that are shown.
_PREVIEW = 24


@dataclass(frozen=True)
class _Product:
    name: str
    content: bytes
    preview: str = ""


class ProductsPart:
    """The card that shows them; it is there from the first one on."""

    def __init__(self, run: LiveRun, reader: Reader) -> None:
        self._run = run
        self._reader = reader
        self._made: dict[str, _Product] = {}
        self._card = named(ui.element("section").classes("mb-card mb-4").props("role=status"), reader.say(_TITLE))
        self._card.set_visibility(False)

    async def export(self, target: str, suffix: str) -> None:
        """Export the run's parameters for a target and show the file, or why there is none."""
        language = self._reader.session.language
        self._show(working=True)
        out, refusal = await child_command(
            "export", str(self._run.folder.path), "--for", target, "--language", language
        )
        made = []
        if not refusal:
            words = out.decode("utf-8", "replace")
            made = [_Product(f"{self._run.name}.{target}{suffix}", out, "" if "\0" in words else words)]
        self._add(made, refusal)

    async def report(self) -> None:
        """Make the report and show its files, or why there are none."""
        language, folder = self._reader.session.language, self._run.folder.path
        self._show(working=True)
        _, refusal = await child_command("report", str(folder), "--language", language)
        paths: list[Path] = []
        if not refusal:
            paths = sorted(folder.glob(f"report*{language}*")) or sorted(folder.glob("report*"))
        self._add([_Product(f"{self._run.name}-{path.name}", path.read_bytes()) for path in paths], refusal)

    def _add(self, made: list[_Product], refusal: str) -> None:
        self._made |= {product.name: product for product in made}
        self._show(refusal=refusal)
        for product in made:
            ui.download.content(product.content, product.name)

    def _show(self, *, working: bool = False, refusal: str = "") -> None:
        say = self._reader.say
        self._card.set_visibility(True)
        self._card.clear()
        with self._card:
            ui.label(say(_TITLE)).classes("text-lg font-semibold").props("role=heading aria-level=2")
            if working:
                ui.label(say(text("Making it …"))).classes("text-base")
            if refusal:
                ui.label(refusal).props("role=alert").classes("mb-refused whitespace-pre-line")
            for product in self._made.values():
                self._one(product)

    def _one(self, product: _Product) -> None:
        say = self._reader.say
        with ui.row().classes("items-center gap-3 py-1 w-full"):
            ui.label(f"✓ {product.name}").classes("text-base break-all")
            ui.label(_size(len(product.content))).classes("mb-small")
            button = ui.button(
                say(text("Download again")), on_click=lambda: ui.download.content(product.content, product.name)
            )
            named(button.props("outline no-caps dense"), say(text("Download {name} again", name=product.name)))
        if product.preview:
            with expansion(say(text("What is in it"))):
                first = product.preview.splitlines()
                rest = [] if len(first) <= _PREVIEW else ["…"]
                ui.label("\n".join([*first[:_PREVIEW], *rest])).classes("mb-preview")


_TITLE = text("Made of this run")


def _size(count: int) -> str:
    return f"{count / 1e6:.1f} MB" if count >= 1e6 else f"{max(count / 1e3, 0.1):.1f} kB"
