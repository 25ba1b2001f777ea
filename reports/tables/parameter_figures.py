"""A parameter's figures as readers see them: scaled to a fitting prefix, with as many digits as the uncertainty carries."""

from dataclasses import dataclass

from procedures.core.result import Parameter
from reports.tables.figures import decimals_for, figure, percent, scale_of


@dataclass(frozen=True)
class ShownFigure:
    """Value, uncertainty, the note's figure, truth and 95 % interval in one unit; a dash where there is none."""

    value: str
    unit: str
    uncertainty: str
    relative: str
    note: str
    truth: str
    interval: str


def shown(parameter: Parameter, truth: float | None = None) -> ShownFigure:
    """Return a parameter's figures."""
    scale = scale_of(parameter.value, parameter.reader_unit)
    value, spread = parameter.value / scale.factor, parameter.standard_uncertainty / scale.factor
    decimals = decimals_for(spread, value)
    low, high = (figure(bound / scale.factor, decimals) for bound in parameter.coverage_interval)
    return ShownFigure(
        value=figure(value, decimals),
        unit=scale.unit,
        uncertainty=figure(spread, decimals) if spread else "–",
        relative=percent(abs(spread / value)) if value else "–",
        note=figure(None if parameter.note_value is None else parameter.note_value / scale.factor, decimals),
        truth=figure(None if truth is None else truth / scale.factor, decimals),
        interval=f"{low} … {high}" if spread else "–",
    )


def shown_withheld(truth: float | None = None, reader_unit: str = "") -> ShownFigure:
    """Return the figures of a parameter that is not given: dashes, and the truth of a virtual motor where it is known."""
    if truth is None:
        return ShownFigure("–", "", "–", "–", "–", "–", "–")
    scale = scale_of(truth, reader_unit)
    value = truth / scale.factor
    return ShownFigure("–", scale.unit, "–", "–", "–", figure(value, decimals_for(0.0, value)), "–")
