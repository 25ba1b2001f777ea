"""Takes what a procedure's estimator tells into an analysis' outcome."""

from typing import Any

from GTC.lib import UncertainReal

from bench.analysis.outcome import AnalysisOutcome
from drivers.interfaces.text import Text
from procedures.core.parameters import PARAMETERS
from procedures.estimation.fitting.misfit import NO_MISFIT, Misfit


class OutcomeTeller:
    """Stands in a procedure's place: figures become parameters, notices warnings; `findings` are kept by name."""

    def __init__(self, outcome: AnalysisOutcome) -> None:
        self.findings: dict[str, Any] = {}
        self._outcome = outcome

    def report(
        self,
        name: str,
        quantity: UncertainReal,
        *,
        section: str,
        estimator: str,
        note_value: float | None = None,
        misfit: Misfit = NO_MISFIT,
    ) -> None:
        """Add a parameter, or why it is withheld."""
        more = {} if note_value is None else {"note_value": note_value}
        self._outcome.parameter(
            name,
            quantity,
            estimator=estimator,
            convention=PARAMETERS[name].convention,
            misfit=misfit,
            **more,
        )

    def notice(self, identifier: str, message: Text) -> None:
        """Add a warning."""
        self._outcome.warn(message, identifier)

    def tell_misfit(self, misfit: Misfit) -> None:
        """Add what the loads show beyond the model."""
        self._outcome.tell_misfit(misfit)
