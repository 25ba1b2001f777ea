"""Uncertainty budgets: common inputs stay correlated, and every parameter keeps its budget rows (GUM, JCGM 100)."""

import math
from collections.abc import Sequence
from dataclasses import dataclass

from GTC import inf, reporting, ureal
from GTC.lib import UncertainReal

from drivers.interfaces import Accuracy
from drivers.interfaces.text import Text, lines, text, word
from procedures.core.parameter_definition import ParameterDefinition
from procedures.core.result import Contribution, Parameter
from procedures.estimation.fitting.expanded import half_width as expanded_half_width

#: Standard deviation of a rectangular distribution of half-width one.
_RECTANGULAR = 1.0 / math.sqrt(3.0)
#: With more degrees of freedom a scatter is as good as known, and their number says nothing but that.
_MANY = 1e9


@dataclass(frozen=True)
class _Input:
    source: Text
    kind: str
    quantity: UncertainReal
    identity: str
    rectangular: bool = False
    one_sided: bool = False


class Uncertainties:
    """The inputs of one run.

    An instrument's gain and offset errors are one input each for all its readings in one range, so all results calculated from them are
    correlated; resolution and statistics are separate inputs each time. `session` distinguishes the inputs of a resumed run from earlier
    ones.
    """

    def __init__(self, session: int = 1) -> None:
        self._session = session
        self._inputs: list[_Input] = []
        self._common: dict[str, UncertainReal] = {}
        self._reported: dict[tuple[str, str, str], UncertainReal] = {}

    def statistical(
        self, source: Text | str, value: float, standard_uncertainty: float, degrees_of_freedom: float = inf
    ) -> UncertainReal:
        """Return a Type A input: an estimate with the standard uncertainty of its fit or its repeats."""
        if standard_uncertainty == 0.0:
            return ureal(value, 0.0)
        return self._remember(source, "A", ureal(value, standard_uncertainty, max(degrees_of_freedom, 1.0)))

    def limit(self, source: Text | str, value: float, half_width: float) -> UncertainReal:
        """Return a Type B input: a value known within ± `half_width`, all values in it equally likely."""
        if half_width == 0.0:
            return ureal(value, 0.0)
        return self._remember(source, "B", ureal(value, half_width * _RECTANGULAR), rectangular=True)

    def one_sided(self, source: Text | str, value: float, most: float) -> UncertainReal:
        """Return a Type B input: `value` is the likely value, but the true value may be larger by up to `most`.

        It widens the interval of every result that depends on it in one direction only. Its standard uncertainty is taken about `value`.
        """
        if most == 0.0:
            return ureal(value, 0.0)
        return self._remember(source, "B", ureal(value, most * _RECTANGULAR), one_sided=True)

    def standard(
        self, source: Text | str, value: float, standard_uncertainty: float, degrees_of_freedom: float = inf
    ) -> UncertainReal:
        """Return a Type B input given by its standard uncertainty (a certificate, a tare)."""
        if standard_uncertainty == 0.0:
            return ureal(value, 0.0)
        return self._remember(source, "B", ureal(value, standard_uncertainty, degrees_of_freedom))

    def instrument(self, name: Text | str, quantity: UncertainReal | float, accuracy: Accuracy) -> UncertainReal:
        """Return a reading (or an estimate proportional to the readings) with the errors of its instrument."""
        read = (
            quantity
            * (1.0 + accuracy.gain * self._shared(text("{name}: gain, {by}", name=word(name), by=_by(accuracy))))
            if accuracy.gain
            else quantity
        )
        if accuracy.offset:
            read = read + accuracy.offset * self._shared(
                text("{name}: offset, {by}", name=word(name), by=_by(accuracy))
            )
        if accuracy.resolution:
            read = read + self.limit(text("{name}: resolution", name=word(name)), 0.0, accuracy.resolution / 2.0)
        if accuracy.noise:
            read = read + self.statistical(text("{name}: noise", name=word(name)), 0.0, accuracy.noise)
        return read if isinstance(read, UncertainReal) else ureal(read, 0.0)

    def parameter(
        self,
        name: str,
        unit: str,
        quantity: UncertainReal,
        *,
        procedure: str,
        section: str,
        estimator: str,
        note_value: float | None = None,
        convention: str = "",
        winding: float | None = None,
        definition: ParameterDefinition | None = None,
    ) -> Parameter:
        """Return the quantity as a parameter with its 95 % coverage interval and its budget.

        Raises TypeError for a plain number, because its uncertainty is not known.
        """
        if not isinstance(quantity, UncertainReal):
            raise TypeError(
                text(
                    "report an uncertain value: {name} was given {value!r}, a plain {kind}; make one of it with "
                    "bench.uncertainties.instrument, .statistical or .limit",
                    name=name,
                    value=quantity,
                    kind=type(quantity).__name__,
                )
            )
        self._reported[procedure, name, estimator] = quantity
        uncertainty = float(quantity.u)
        freedom = float(quantity.df) if uncertainty else inf
        freedom = freedom if freedom < _MANY else inf
        reached = self._reached(quantity)
        expanded = _expanded([each for each in reached if not each[0].one_sided])
        beyond = [contribution / _RECTANGULAR for entry, contribution in reached if entry.one_sided]
        value = float(quantity.x)
        return Parameter(
            name=name,
            value=value,
            unit=unit,
            standard_uncertainty=uncertainty,
            degrees_of_freedom=freedom,
            coverage_interval=(
                value - expanded + sum(min(each, 0.0) for each in beyond),
                value + expanded + sum(max(each, 0.0) for each in beyond),
            ),
            procedure=procedure,
            section=section,
            estimator=estimator,
            note_value=note_value,
            convention=convention,
            winding=winding,
            budget=tuple(_rows(reached)),
            definition=definition,
        )

    def scatter(self, quantity: UncertainReal) -> float:
        """Return what statistical inputs make of the quantity's standard uncertainty, in its unit."""
        return math.hypot(*(contribution for entry, contribution in self._reached(quantity) if entry.kind == "A"))

    def interval(self, quantity: UncertainReal) -> tuple[float, float]:
        """Return the quantity's 95 % coverage interval."""
        expanded = _expanded(self._reached(quantity))
        return float(quantity.x) - expanded, float(quantity.x) + expanded

    def of_parameter(self, parameter: Parameter) -> UncertainReal:
        """Return the quantity of an earlier parameter, correlated with everything that shares its inputs.

        A parameter of an earlier process (a resumed run) comes back with its uncertainty, but without its correlations.
        """
        key = (parameter.procedure, parameter.name, parameter.estimator)
        if key in self._reported:
            return self._reported[key]
        return self.standard(
            text("{name} by {procedure}", name=parameter.label, procedure=word(parameter.procedure)),
            parameter.value,
            parameter.standard_uncertainty,
            parameter.degrees_of_freedom,
        )

    def _reached(self, quantity: UncertainReal) -> list[tuple[_Input, float]]:
        """Return the inputs that reach `quantity` with their contributions, signed."""
        found = ((entry, float(reporting.u_component(quantity, entry.quantity))) for entry in self._inputs)
        return [(entry, contribution) for entry, contribution in found if contribution]

    def _shared(self, source: Text) -> UncertainReal:
        # The instrument is the same after a resumption, and so is its error.
        key = str(source)
        if key not in self._common:
            self._common[key] = self._remember(source, "B", ureal(0.0, _RECTANGULAR), rectangular=True, identity=key)
        return self._common[key]

    def _remember(
        self,
        source: Text | str,
        kind: str,
        quantity: UncertainReal,
        *,
        rectangular: bool = False,
        identity: str = "",
        one_sided: bool = False,
    ) -> UncertainReal:
        own = f"{self._session}.{len(self._inputs) + 1}"
        self._inputs.append(_Input(word(source), kind, quantity, identity or own, rectangular, one_sided))
        return quantity


def _expanded(reached: Sequence[tuple[_Input, float]]) -> float:
    """Return the expanded uncertainty at 95 %: limits stay rectangular, for two of them do not add up as normal errors do."""
    limits = [abs(contribution) / _RECTANGULAR for entry, contribution in reached if entry.rectangular]
    others = [(abs(c), float(entry.quantity.df)) for entry, c in reached if not entry.rectangular]
    return expanded_half_width(limits, others)


def _by(accuracy: Accuracy) -> Text:
    """Return what an accuracy rests on: a document, and what driver or operator said of it after a semicolon."""
    said = accuracy.source.split("; ")
    return word(said[0]) if len(said) == 1 else lines(map(word, said), "; ")


def _rows(reached: Sequence[tuple[_Input, float]]) -> list[Contribution]:
    rows = [
        Contribution(
            source=entry.source,
            value=float(entry.quantity.x),
            standard_uncertainty=float(entry.quantity.u),
            sensitivity=contribution / float(entry.quantity.u),
            contribution=abs(contribution),
            kind=entry.kind,
            identity=entry.identity,
        )
        for entry, contribution in reached
    ]
    return sorted(rows, key=lambda row: -row.contribution)
