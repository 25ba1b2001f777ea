"""Output of a check of a plan against defects."""

import math
import sys
from collections.abc import Mapping
from typing import TYPE_CHECKING, Any

from bench.eol.defects.check import DefectCheck
from bench.eol.defects.findings import FigureFinding, Findings
from bench.eol.defects.function_cost import INSULATION, THRESHOLDS, DefectSeverity, FunctionCost
from bench.eol.defects.proposal import Proposal
from bench.eol.limits import ParameterLimits
from bench.eol.statistics.proportion import Proportion
from bench.run.console import console_on
from drivers.interfaces.text import Text, Translate, text, word
from reports.labels import ParameterLabels

if TYPE_CHECKING:
    from rich.console import Console

_WIDTH = 80
_GRADES = {
    DefectSeverity.GROSS: text("gross"),
    DefectSeverity.MARGINAL: text("marginal"),
    DefectSeverity.SLIGHT: text("slight"),
}


def print_defects(checked: DefectCheck, translate: Translate) -> None:
    """Print what gets through, what is rejected wrongly, and what each figure and procedure is worth; 80 columns."""
    console, found = console_on(sys.stdout, markup=False), checked.findings

    def say(said: Text) -> None:
        console.print(said.render(translate), width=_WIDTH)

    if not found.complete:
        say(text("Partial: stopped after {done} of {planned} motors", done=found.measured, planned=found.planned))
    say(text("Motors drawn from {spread}; 95 % intervals by Clopper and Pearson", spread=checked.spread))
    _defects(console, found, translate)
    _figures(console, found, checked.labels, translate)
    _procedures(console, found, translate)
    for grade, share in found.through.items():
        if share.count:
            said = text("{grade} defects let through: {share}", grade=_GRADES[grade], share=_share(share))
            say(said)
    if found.false_rejects.count:
        say(text("Sound motors rejected: {share}", share=_share(found.false_rejects)))
    unlimited = [checked.labels[figure.parameter] for figure in found.figures if not figure.limited]
    if unlimited:
        say(text("! Measured without a limit: {names}", names=unlimited))
    if checked.cases.left_out:
        say(
            text(
                "Not tried, because motors of this type cannot have these defects here: {names}",
                names=list(checked.cases.left_out),
            )
        )
    for name, (why, count) in checked.unmodelled.items():
        said = text(
            "! {name} was not tried on {count} motors, and so finds none of their defects: {why}",
            name=name,
            count=count,
            why=why,
        )
        say(said)
    say(_scale())


def print_proposal(proposal: Proposal, checked: DefectCheck, path: Any, translate: Translate) -> None:
    """Print limits and order that were written."""
    console = console_on(sys.stdout, markup=False)
    table = _table(translate, text("proposed limits"), text("Parameter"), text("limits"))
    for name, limits in proposal.limits.items():
        table.add_row(checked.labels[name].render(translate), shown_range(limits.low, limits.high))
    console.print(table, width=_WIDTH)
    lines = [text("Order: {names}", names=[word(name) for name in proposal.order])]
    if checked.safety_tests:
        lines.append(
            text(
                "Safety tests, before everything that energises the motor whatever they find: {names}",
                names=[word(name) for name in checked.safety_tests],
            )
        )
    if proposal.idle:
        lines.append(
            text(
                "Finds no defect that another procedure does not also find: {names}",
                names=[word(name) for name in proposal.idle],
            )
        )
    lines.append(
        text(
            "Written: {path}; next: motorbench eol check {path}. It has the same plan name as the old plan. "
            "Before eol run, replace the old plan with it, or give it another name (plan.name)",
            path=path,
        )
    )
    for line in lines:
        console.print(line.render(translate), width=_WIDTH)


def as_json(checked: DefectCheck, proposal: Proposal | None) -> Mapping[str, Any]:
    """Return it in JSON's types, English; an open side of a limit is null."""
    result = checked.findings.as_dict()
    for figure in result["figures"]:
        figure |= {side: _finite(figure[side]) for side in ("low", "high", "mean", "deviation")}
    for defect in result["defects"]:
        defect["cost"]["value"] = _finite(defect["cost"]["value"])
    for share in (result["false_rejects"], *result["through"].values(), *(d["through"] for d in result["defects"])):
        share |= {"share": _finite(share["share"]), "interval": [_finite(end) for end in share["interval"]]}
    for figure in result["figures"]:
        share = figure["false_rejects"]
        share |= {"share": _finite(share["share"]), "interval": [_finite(end) for end in share["interval"]]}
    for procedure in result["procedures"]:
        procedure["time"] = _finite(procedure["time"])
    result["drawn_from"] = checked.spread.render()
    result["unmodelled"] = {name: {"why": why, "motors": count} for name, (why, count) in checked.unmodelled.items()}
    result["left_out"] = [label.render() for label in checked.cases.left_out]
    if proposal is not None:
        result["proposal"] = {
            "limits": {
                name: {"low": _finite(limits.low), "high": _finite(limits.high)}
                for name, limits in proposal.limits.items()
            },
            "order": list(proposal.order),
            "safety_tests": list(checked.safety_tests),
            "idle": list(proposal.idle),
        }
    return result


def _defects(console: "Console", found: Findings, translate: Translate) -> None:
    headings = text("Defect"), text("severity"), text("grade"), text("it costs"), text("through"), Text("95 %")
    table = _table(translate, text("defects"), *headings)
    before = ""
    for each in found.defects:
        label = each.label.render(translate)
        table.add_row(
            "" if label == before else label,
            each.severity.render(translate),
            _GRADES[each.cost.grade].render(translate),
            _cost(each.cost).render(translate),
            f"{each.through.hits}/{each.through.count}",
            _interval(each.through),
        )
        before = label
    console.print(table, width=_WIDTH)


def _figures(console: "Console", found: Findings, labels: ParameterLabels, translate: Translate) -> None:
    headings = text("Figure"), text("limits"), text("sound ones"), text("rejects"), text("catches"), text("alone")
    table = _table(translate, text("figures"), *headings)
    for each in found.figures:
        table.add_row(
            labels[each.parameter].render(translate),
            shown_range(each.low, each.high) if each.limited else text("none").render(translate),
            f"{each.mean:.4g} ± {each.deviation:.2g} {each.unit}",
            f"{each.false_rejects.hits}/{each.false_rejects.count}",
            _count(each, each.catches),
            _count(each, each.alone),
        )
    console.print(table, width=_WIDTH)


def _procedures(console: "Console", found: Findings, translate: Translate) -> None:
    headings = text("Procedure"), text("time, s"), text("catches"), text("alone")
    title = text("procedures; of {count} motors with a gross or marginal defect", count=found.defective)
    table = _table(translate, title, *headings)
    for each in found.procedures:
        name = word(each.procedure).render(translate)
        table.add_row(name, "–" if math.isnan(each.time) else f"{each.time:.1f}", str(each.catches), str(each.alone))
    console.print(table, width=_WIDTH)


def _table(translate: Translate, title: Text, *headings: Text) -> Any:
    from rich.box import SIMPLE
    from rich.table import Table

    names = [heading.render(translate) for heading in headings]
    return Table(*names, title=title.render(translate), box=SIMPLE, pad_edge=False, padding=(0, 1))


def _cost(cost: FunctionCost) -> Text:
    per_cent = 100.0 * cost.value
    return {
        "torque": text("torque/A {value:+.0f} %", value=per_cent),
        "heat": text("heat {value:+.0f} %", value=per_cent),
        "drag": text("drag {value:+.1f} %", value=per_cent),
        "ripple": text("ripple {value:+.1f} %", value=per_cent),
        "commutation": text("commutation {value:.0f}°", value=cost.value),
        "insulation": text("insulation"),
        "fails": text("does not work"),
    }[cost.by]


def _scale() -> Text:
    named = {
        f"{name}_{grade}": scale * value
        for name, values in THRESHOLDS.items()
        for scale in ((1.0 if name == "commutation" else 100.0),)
        for grade, value in zip(("marginal", "gross"), values, strict=True)
    }
    return text(
        "Marginal (gross) from: torque per ampere ±{torque_marginal:g} % ({torque_gross:g} %), copper loss of the "
        "hottest phase at rated torque +{heat_marginal:g} % ({heat_gross:g} %), of rated torque drag "
        "+{drag_marginal:g} % ({drag_gross:g} %) and ripple +{ripple_marginal:g} % ({ripple_gross:g} %), "
        "commutation {commutation_marginal:g}° ({commutation_gross:g}°), insulation below {insulation_marginal:g} "
        "MΩ ({insulation_gross:g} MΩ); a motor that does not work is gross too",
        **named,
        insulation_marginal=1e-6 * INSULATION[0],
        insulation_gross=1e-6 * INSULATION[1],
    )


def shown_range(low: float, high: float) -> str:
    """Return limits as tables show them, an open side left out."""
    limits = ParameterLimits(low, high)
    if math.isinf(limits.low):
        return f"≤ {high:.4g}"
    return f"≥ {low:.4g}" if math.isinf(high) else f"{low:.4g} … {high:.4g}"


def _count(figure: FigureFinding, count: int) -> str:
    return str(count) if figure.limited else "–"


def _share(share: Proportion) -> str:
    return f"{share.hits}/{share.count} = {_per_cent(share.share)} % ({_interval(share)})"


def _interval(share: Proportion) -> str:
    low, high = share.interval
    return f"{_per_cent(low)} … {_per_cent(high)} %"


def _per_cent(share: float) -> str:
    return f"{100.0 * share:.{1 if share < 0.1 else 0}f}".removesuffix(".0")


def _finite(value: float) -> float | None:
    return value if math.isfinite(value) else None
