"""A run in one table: what was measured, how well, what the note's formula says, and where it stands in the note."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING

from drivers.interfaces.text import Text, Translate, text, word
from procedures.core.parameter_set import ParameterSet
from procedures.core.result import Notice, Parameter, Withheld, said_of
from reports.tables.fitted import FittedColumn, fitted
from reports.tables.parameter_figures import shown, shown_withheld

if TYPE_CHECKING:
    from rich.console import Group
    from rich.table import Table


@dataclass(frozen=True)
class SummaryRow:
    """One line of the summary, ready to print; `other` marks another procedure's figure of the parameter above."""

    name: str
    value: str
    unit: str
    uncertainty: str
    relative: str
    note: str
    truth: str
    section: str
    other: bool = False


def rows(parameters: ParameterSet, truth: Mapping[str, float], translate: Translate) -> list[SummaryRow]:
    """Return the lines: every reported figure, and beneath it those of other procedures; then what is not given."""
    result = []
    for name, parameter in parameters.parameters.items():
        result.append(_row(parameter, parameter.label.render(translate), truth.get(name), translate))
        result.extend(
            _row(
                other,
                _by(other, parameter, translate),
                None,
                translate,
                other=True,
            )
            for other in parameters.alternatives.get(name, ())
        )
    result += [_not_given(r[0], truth.get(name), translate) for name, r in parameters.withheld.items()]
    return result


def why_withheld(parameters: ParameterSet) -> list[Text]:
    """Return why parameters are not given: their names, the procedure, the cause, and what to do."""
    return said_of(reason for reasons in parameters.withheld.values() for reason in reasons)


def other_warnings(parameters: ParameterSet, warnings: Sequence[tuple[str, Notice]]) -> list[tuple[str, Notice]]:
    """Return the warnings that `why_withheld` does not say already."""
    said = {(r.procedure, r.cause, str(r.message)) for reasons in parameters.withheld.values() for r in reasons}
    return [
        (procedure, notice)
        for procedure, notice in warnings
        if (procedure, notice.identifier, str(notice.message)) not in said
    ]


def _by(other: Parameter, best: Parameter, translate: Translate) -> str:
    """Say where a figure comes from that stands beneath another: its procedure, or its way where the procedure is the same."""
    if other.procedure != best.procedure:
        return text("· {procedure}", procedure=word(other.procedure)).render(translate)
    return text("· by another method").render(translate)


def table(lines: Sequence[SummaryRow], translate: Translate, *, with_truth: bool, width: int) -> "Table":
    """Return the summary as a table that `width` columns of a terminal hold."""

    def column(heading: Text, leaves: int = 0, *, right: bool = True, breaks: int = 0) -> FittedColumn:
        return FittedColumn(heading.render(translate), leaves, right, breaks)

    columns = [
        column(text("Parameter"), right=False, breaks=24),
        column(text("Value")),
        column(text("Unit"), right=False),
        column(text("u"), 3),
        column(text("u, %")),
        FittedColumn(_note_heading(translate), 2, right=True),
        *([column(text("Truth"), 4)] if with_truth else []),
        column(Text("§"), 1, right=False),
    ]
    rows = [
        (
            *(line.name, line.value, line.unit, line.uncertainty, line.relative, line.note),
            *((line.truth,) if with_truth else ()),
            line.section,
        )
        for line in lines
    ]
    return fitted(columns, rows, width, ["dim" if line.other else None for line in lines])


def _note_heading(translate: Translate) -> str:
    # In two lines: its figures are shorter than its name.
    return text("Note's formula").render(translate).replace(" ", "\n")


def summary(
    parameters: ParameterSet,
    warnings: Sequence[tuple[str, Notice]],
    truth: Mapping[str, float],
    translate: Translate,
    width: int,
) -> "Group":
    """Return the whole summary, `width` columns wide: the table, what u means, and the warnings with the procedure each came from."""
    from rich.console import Group
    from rich.padding import Padding
    from rich.text import Text as Words

    parts: list[Table | Words | Padding] = []
    if parameters.parameters or parameters.withheld:
        made = table(rows(parameters, truth, translate), translate, with_truth=bool(truth), width=width)
        parts.append(made)
        note = _note_heading(translate)
        legend = (
            text("u: standard uncertainty. Note's formula: its result on the same readings.")
            if note in [column.header for column in made.columns]
            else text("u: standard uncertainty.")
        )
        parts.append(Words(legend.render(translate), style="dim"))
    else:
        parts.append(Words(text("No parameter was measured.").render(translate)))
    others = [
        _headed(notice, procedure).render(translate) for procedure, notice in other_warnings(parameters, warnings)
    ]
    why = [sentence.render(translate) for sentence in why_withheld(parameters)]
    for title, sentences in ((text("Not given"), why), (text("Warnings"), others)):
        if sentences:
            parts.append(Words("\n" + title.render(translate), style="bold"))
            parts += [Padding(Words(sentence), (0, 0, 0, 2), expand=False) for sentence in sentences]
    return Group(*parts)


def _headed(notice: Notice, procedure: str) -> Text:
    what = word(notice.identifier)
    if not procedure:
        return text("{place}: {said}", place=what, said=notice.message)
    return text("{what} ({procedure}): {said}", what=what, procedure=word(procedure), said=notice.message)


def _row(
    parameter: Parameter, name: str, truth: float | None, translate: Translate, *, other: bool = False
) -> SummaryRow:
    figures = shown(parameter, truth)
    sheet = parameter.source != "measured"
    return SummaryRow(
        name=name,
        value=figures.value,
        unit=figures.unit,
        uncertainty=text("data sheet").render(translate) if sheet else figures.uncertainty,
        relative=figures.relative,
        note=figures.note,
        truth=figures.truth,
        section=parameter.section,
        other=other,
    )


def _not_given(reason: Withheld, truth: float | None, translate: Translate) -> SummaryRow:
    figures = shown_withheld(truth, reason.reader_unit)
    return SummaryRow(
        name=reason.label.render(translate),
        value=text("not given").render(translate),
        unit=figures.unit,
        uncertainty=figures.uncertainty,
        relative=figures.relative,
        note=figures.note,
        truth=figures.truth,
        section=reason.section,
    )
