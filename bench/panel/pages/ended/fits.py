"""Plots of a run's procedures: the quality of the fits, their residuals and a short judgement; and plots that judge no fit."""

import math
from collections.abc import Iterator, Sequence
from contextlib import contextmanager

import numpy as np
from nicegui import ui

from bench.panel.live.live_run import LiveRun
from bench.panel.pages.parts import named
from bench.panel.pages.reader import Reader
from bench.panel.panel import Panel
from bench.panel.plots import fit_plot, labelled
from drivers.interfaces.text import Text, text
from procedures.core.axes import Axes, FloatArray, PlotCurve
from procedures.core.result import ProcedureResult
from procedures.estimation.fitting.randomness import LEAST_READINGS, chance_of_pattern
from reports.document.record import ProcedureRecord
from reports.plots.misfit import causes, is_residual
from reports.plots.model import Plot
from reports.plots.of_procedures import plots
from reports.tables.figures import decimals_for, figure, scale_of

#: A residual shows a pattern where noise would look so in fewer cases than this.
_CHANCE = 0.01


def fits_part(panel: Panel, run: LiveRun, reader: Reader) -> None:
    """Build it; nothing where no procedure draws anything."""
    drawn = [
        (result, reader.say(title), plot)
        for result in run.view.run.results.values()
        for title in [panel.offer.title(result.procedure)]
        for plot in plots(ProcedureRecord(result.procedure, title, result.section, {}, (), result))
    ]
    fits = [(result, title, *pair) for result, title, plot in drawn for pair in _pairs(plot)]
    if fits:
        with _card(text("How well the models fit"), reader):
            for result, title, upper, left in fits:
                _one(result, title, upper, left, reader)
    others = [(title, plot.caption, axes) for _, title, plot in drawn for axes in _others(plot)]
    if others:
        with _card(text("Plots"), reader):
            for title, caption, axes in others:
                _other(title, caption, axes, reader)


@contextmanager
def _card(words: Text, reader: Reader) -> Iterator[None]:
    heading = reader.say(words)
    with named(ui.element("section").classes("mb-card mb-4"), heading):
        ui.label(heading).classes("text-lg font-semibold").props("role=heading aria-level=2")
        with ui.element("div").classes("mb-fits"):
            yield


def _pairs(plot: Plot) -> Iterator[tuple[Axes, Axes]]:
    """Give a plot's residuals with the fit that each belongs to: that above it, else that before it."""
    for number, row in enumerate(plot.rows):
        for column, axes in enumerate(row):
            if not is_residual(axes):
                continue
            above = plot.rows[number - 1] if number else ()
            if column < len(above) and not is_residual(above[column]):
                yield above[column], axes
            elif column and not is_residual(row[column - 1]):
                yield row[column - 1], axes


def _others(plot: Plot) -> Iterator[Axes]:
    """Give a plot's axes that belong to no fit."""
    fitted = [upper for upper, _ in _pairs(plot)]
    for axes in (each for row in plot.rows for each in row):
        if not is_residual(axes) and not any(axes is each for each in fitted):
            yield axes


def _other(title: str, caption: Text, axes: Axes, reader: Reader) -> None:
    say = reader.say
    # A plane of two currents is named by what is drawn on it.
    heading = title if axes.x_unit == axes.y_unit else f"{title} · {say(axes.y_label)}"
    with named(ui.element("figure").classes("mb-fit"), f"{heading}: {say(caption)}"):
        with ui.element("figcaption"):
            ui.label(heading).classes("text-base font-semibold")
            ui.label(say(caption)).classes("mb-small")
        ui.echart(fit_plot(labelled(axes, say))).classes("w-full h-80")


def _one(result: ProcedureResult, title: str, upper: Axes, left: Axes, reader: Reader) -> None:
    say = reader.say
    word = _judged(result, left, reader)
    with named(ui.element("figure").classes("mb-fit"), f"{title}: {say(word)}"):
        with ui.element("figcaption"):
            ui.label(f"{title} · {say(upper.y_label)}").classes("text-base font-semibold")
            ui.label(say(word)).classes("mb-small")
        ui.echart(fit_plot(labelled(upper, say), labelled(left, say))).classes("w-full h-80")


def _judged(result: ProcedureResult, left: Axes, reader: Reader) -> Text:
    """Return in a word what the residual is like, and its size; a procedure that names no cause need not have looked for any."""
    named_causes = [f"{reader.term(cause)} ({reader.say(answer)})" for cause, answer in causes(result.findings)]
    curves = [_ordered(curve) for curve in left.curves]
    size = _rms(curves, left.y_unit)
    if named_causes:
        return text("⚠ a pattern: {causes}; {size} rms", causes=named_causes, size=size)
    chances = [chance_of_pattern(curve) for curve in curves]
    if any(chance is not None and chance < _CHANCE / len(chances) for chance in chances):
        return text("⚠ a pattern that no cause explains; {size} rms", size=size)
    if not chances or None in chances:
        return text(
            "not judged: fewer than {least} readings, or all alike; {size} rms", least=LEAST_READINGS, size=size
        )
    return text("✓ no pattern found, {size} rms", size=size)


def _ordered(curve: PlotCurve) -> FloatArray:
    values = np.asarray(curve.y, dtype=np.float64)[np.argsort(curve.x, kind="stable")]
    return values[np.isfinite(values)]


def _rms(curves: Sequence[FloatArray], unit: str) -> str:
    values = np.concatenate(curves) if curves else np.zeros(0)
    rms = math.sqrt(float(np.mean(np.square(values)))) if values.size else 0.0
    scale = scale_of(rms, unit)
    shown = rms / scale.factor
    return f"{figure(shown, decimals_for(shown, shown))} {scale.unit}".rstrip()
