"""The counters of a batch: motors by verdict, the first-pass yield with its interval on an axis, and the pace."""

import math
from collections.abc import Mapping
from datetime import datetime
from typing import Any
from urllib.parse import urlencode

from nicegui import ui

from bench.eol.statistics.proportion import proportion
from bench.panel.pages.line.tile import VERDICTS
from bench.panel.pages.reader import Reader
from drivers.interfaces.text import Text, text


class Counters:
    """The card of the counters."""

    def __init__(self, reader: Reader) -> None:
        self._reader = reader
        with ui.element("section").classes("mb-card"):
            self._place = ui.element("div").classes("flex items-baseline").style("flex-wrap: wrap; gap: 12px 32px")
            self._axis = ui.element("div").classes("mb-yield-axis").props("aria-hidden=true")

    def show(self, state: Mapping[str, Any]) -> None:
        """Show what the batch last said."""
        counts = state["counts"]
        motors, new = counts.get("motors", 0), counts.get("new", 0)
        self._place.clear()
        with self._place:
            self._count(text("Motors judged"), str(motors))
            for verdict, (mark, words) in VERDICTS.items():
                self._count(words, f"{mark} {counts['verdicts'][verdict]}")
            if new:
                first = proportion(counts["first_pass"], new)
                below = "95 %: {:.1f} … {:.1f} %".format(*(100.0 * end for end in first.interval))
                if new < motors:
                    below += f" · {self._reader.say(text('of {new} never judged before', new=new))}"
                self._count(text("First-pass yield"), f"{100.0 * first.share:.1f} %", below)
            if motors:
                self._count(text("Final yield"), f"{100.0 * counts['final'] / motors:.1f} %")
            if counts.get("pace") is not None:
                self._count(text("A motor every"), f"{counts['pace']:.1f} s")
            if counts.get("golden"):
                self._count(text("Golden tests"), str(counts["golden"]))
            self._count(text("Waiting"), str(state["waiting"]))
            about = {"batch": state["batch"], "plan": state["plan"], "time": _local(counts["since"])}
            ui.label(self._reader.say(text("batch {batch}, plan {plan}, since {time}", **about))).classes("text-base")
            address = f"/statistics?{urlencode({'batch': state['batch']})}"
            ui.link(self._reader.say(text("Statistics of this batch")), address).classes("mb-link text-base")
        self._axis.set_visibility(bool(new))
        if new:
            low, high = first.interval
            self._draw(low, first.share, high)

    def _count(self, what: Text, number: str, below: str = "") -> None:
        with ui.element("div") as box:
            box.props["data-count"] = what.template
            ui.label(self._reader.say(what)).classes("text-sm")
            ui.label(number).classes("mb-count")
            if below:
                ui.label(below).classes("text-sm")

    def _draw(self, low: float, share: float, high: float) -> None:
        """Draw shares on an axis that ends at 1 and begins at a tenth below the least."""
        begin = max(0.0, math.floor(10.0 * low - 1e-9) / 10.0)

        def at(value: float) -> str:
            return f"{100.0 * (value - begin) / (1.0 - begin):.2f}%"

        self._axis.clear()
        with self._axis:
            self._mark("line")
            for tick in (begin, 0.5 * (begin + 1.0), 1.0):
                self._mark("tick", left=at(tick))
                ui.label(f"{100.0 * tick:.0f} %").style["left"] = at(tick)
            self._mark("range", left=at(low), right=f"{100.0 * (1.0 - high) / (1.0 - begin):.2f}%")
            self._mark("point", left=at(share))

    def _mark(self, name: str, **place: str) -> None:
        mark = ui.element("i")
        mark.props["data-mark"] = name
        mark.style.update(place)


def _local(time: str) -> str:
    return datetime.fromisoformat(time).astimezone().strftime("%H:%M")
