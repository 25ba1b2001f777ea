"""Results of a procedure that ended early, from the data taken until then."""

from typing import Any

from bench.i18n.errors import told
from bench.journal.errors import RecordError
from bench.journal.events.run import PartialResultMade
from bench.journal.journal import Journal
from drivers.interfaces.text import Text, text
from procedures.core.procedure import Procedure
from procedures.estimation.fitting.fit import EstimationError


class PartialResults:
    """Holds the procedure that is under way, so that one left by an error or an abort can still conclude."""

    def __init__(self) -> None:
        self._procedure: Procedure[Any] | None = None

    def begin(self, procedure: Procedure[Any]) -> None:
        """Note that a procedure begins."""
        self._procedure = procedure

    def forget(self) -> None:
        """Note that it has come to its end, or that nothing is to be made of it."""
        self._procedure = None

    def conclude(self, journal: Journal, why: Text) -> Text | None:
        """Record what it makes of what it took until it was left for `why`; return what went wrong with that. Everything is off by now."""
        procedure, self._procedure = self._procedure, None
        if procedure is None or journal.failure is not None:
            return None
        try:
            result = procedure.partial_result(why)
            if result is not None:
                journal.record(PartialResultMade(result=result))
        except RecordError:
            raise
        except EstimationError as error:
            return text(
                "the data that {procedure} had taken give no result: {why}", procedure=procedure.name, why=told(error)
            )
        except Exception as error:  # noqa: BLE001  a stranger's fault here must not hide how the run ended
            return told(error)
        return None
