"""Tables of load points that others measured: efficiency and loss of each."""

import math
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any

from bench.analysis.efficiency_doubts import doubts
from bench.analysis.map_table import SPEED, TORQUE, read_table
from bench.analysis.table_headings import KnownColumn
from bench.analysis.table_outcome import told
from bench.i18n.errors import InputError, at
from drivers.interfaces import Accuracy
from drivers.interfaces.text import Translate, english, text, text_of
from procedures.core.budget import Uncertainties
from procedures.estimation.fitting.fit import EstimationError
from procedures.estimation.fitting.misfit import Misfit
from procedures.estimation.flux.flux_map import MapFigure
from procedures.estimation.flux.load_points import efficiency_of

_LOAD = {
    "torque": KnownColumn("N·m", TORQUE),
    "speed": KnownColumn("rad/s", SPEED),
    "power": KnownColumn("W", ("power", "p", "pin", "pel", "inputpower", "electricalpower")),
}
#: More rows take minutes, and nobody reads them.
_MOST = 5000
_NAMES = {"torque": text("torque"), "speed": text("speed"), "power": text("power")}


def analyze_efficiency(
    path: Path,
    *,
    mapped: Sequence[str] = (),
    accuracies: Mapping[str, Accuracy] | None = None,
    translate: Translate = english,
) -> dict[str, Any]:
    """Return efficiency and loss of each row of torque, speed and electrical power. Raises InputError where none can be evaluated."""
    columns = read_table(path, _LOAD, ("torque", "speed", "power"), mapped, most=_MOST)
    result = told(path, Misfit(), translate)
    limits, uncertainties, rows = accuracies or {}, Uncertainties(), []
    used: list[int] = []
    for number, (torque, speed, power) in enumerate(
        zip(*(columns[n] for n in ("torque", "speed", "power")), strict=True), 1
    ):
        if not all(math.isfinite(each) for each in (torque, speed, power)):
            rows.append({"row": number, "refused": text("a cell is empty").render(translate)})
            continue
        read = {
            name: uncertainties.instrument(name, value, limits.get(name, Accuracy(source="as stated")))
            for name, value in (("torque", torque), ("speed", speed), ("power", power))
        }
        try:
            point = efficiency_of(read["torque"], read["speed"], read["power"])
        except EstimationError as error:
            rows.append({"row": number, "refused": text_of(error).render(translate)})
            continue
        used.append(number - 1)
        rows.append({
            "row": number, "torque": torque, "speed": speed, "generating": point.generating,
            "efficiency": _quantity(uncertainties, point.efficiency), "loss": _quantity(uncertainties, point.loss),
        })  # fmt: skip
    result["details"]["load_points"] = rows
    unstated = [name for name in _LOAD if not (limits.get(name) and (limits[name].gain or limits[name].offset))]
    if unstated:
        result["assumptions"].append(
            text(
                "errors of {names} are not stated and therefore not included; state them with --torque-gain, "
                "--torque-zero, --speed-gain, --power-gain",
                names=[_NAMES[name] for name in unstated],
            ).render(translate)
        )
    refused = [row for row in rows if "refused" in row]
    if len(refused) == len(rows):
        raise InputError(
            at(str(path), text("no row gives an efficiency: {why}", why=refused[0]["refused"] if refused else ""))
        )
    result["warnings"] += [
        {"id": "", "text": text("row {row}: {why}", row=row["row"], why=row["refused"]).render(translate)}
        for row in refused
    ]
    every = [(columns["torque"][k], columns["speed"][k], columns["power"][k]) for k in range(len(rows))]
    given, without = [every[k] for k in used], [every[k] for k in range(len(rows)) if k not in set(used)]
    result["warnings"] += [{"id": name, "text": said.render(translate)} for name, said in doubts(given, without)]
    return result


def _quantity(uncertainties: Uncertainties, quantity: Any) -> dict[str, Any]:
    return MapFigure(float(quantity.x), float(quantity.u), uncertainties.interval(quantity)).as_dict()
