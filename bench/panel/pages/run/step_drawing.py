"""A step's drawing: what is connected and what changes, in both forms, and the photos that the user has beside it."""

from nicegui import ui

from bench.drawings.canvas import Form
from bench.drawings.connections import Extents, Scene, draw, standing_extents
from bench.drawings.layout import turned_by_hand
from bench.drawings.lines import lines_of
from bench.panel.live.live_run import LiveRun
from bench.panel.motor_of import nameplate_of
from bench.panel.pages.icons import icon
from bench.panel.pages.parts import drawing, named
from bench.panel.pages.reader import Reader
from bench.report.photos import photos_of
from drivers.interfaces.text import text
from procedures.core.actions import (
    ChangeSetup,
    Connect,
    ConnectProbes,
    ConnectVoltmeter,
    ConnectVoltmeterToSupply,
    DisconnectVoltmeter,
    ShortMeterLeads,
)
from procedures.core.nameplate import Nameplate

_DRAWN = (
    ChangeSetup,
    Connect,
    ConnectProbes,
    ConnectVoltmeter,
    ConnectVoltmeterToSupply,
    DisconnectVoltmeter,
    ShortMeterLeads,
)


class StepDrawing:
    """The drawing of the present step; within a procedure the motor stays where it is."""

    def __init__(self, run: LiveRun, reader: Reader) -> None:
        self._run = run
        self._reader = reader
        self._drawn: Scene | None = None
        self._framed = ""
        self._photographed = False
        self._extents: dict[Form, Extents] = {}
        #: What else may stand in the drawing's place goes in here.
        self.stage = ui.element("div").classes("mb-stage")
        with self.stage:
            self._picture = ui.element("div").classes("mb-draw")
            larger = ui.element("button").classes("mb-b mb-larger").props("type=button data-larger aria-pressed=false")
            with named(larger, reader.say(text("Enlarge the drawing"))):
                icon("larger")
        self._photos = ui.element("div").classes("mb-photos")

    def show(self) -> None:
        """Draw it anew where it has changed."""
        view = self._run.view
        if view.procedure != self._framed:
            self._framed, self._extents = view.procedure, {}
        scene = None
        if view.layout.terminals is not None or isinstance(view.action, _DRAWN):
            scene = Scene(view.layout, view.before, lines_of(view.action), by_hand=turned_by_hand(view.action))
        if scene == self._drawn:
            return
        self._show_photos()
        self._drawn = scene
        self._picture.clear()
        if scene is None:
            return
        plate = nameplate_of(view.run.start)
        with self._picture:
            # The stylesheet shows the one that the screen has room for.
            with ui.element("div").classes("mb-wide"):
                self._draw(scene, plate, Form.WIDE)
            with ui.element("div").classes("mb-tall"):
                self._draw(scene, plate, Form.UPRIGHT)

    def _draw(self, scene: Scene, plate: Nameplate, form: Form) -> None:
        translate = self._reader.translate
        extents = self._extents.get(form) or standing_extents(plate, translate, form)
        made = draw(scene, plate, translate, form=form, extents=extents)
        self._extents[form] = made.extents
        drawing(made.svg)

    def _show_photos(self) -> None:
        if self._photographed:
            return
        self._photographed = True
        with self._photos:
            for words, picture in photos_of(self._run.folder):
                with ui.element("figure"):
                    drawing(picture(self._reader.translate))
                    ui.label(self._reader.say(words)).classes("mb-small")
