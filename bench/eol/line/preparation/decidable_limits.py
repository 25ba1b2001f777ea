"""The station's uncertainty compared with a plan's limits: before the first motor if it is known, else at that motor."""

from collections.abc import Callable, Mapping

from bench.eol.line.batch_listener import BatchListener
from bench.eol.line.preparation.limit_notes import undecidable
from bench.eol.line.preparation.prepare import Prepared
from bench.eol.record import MotorRecord
from drivers.interfaces.text import Text, text


class DecidableLimits(BatchListener):
    """Tells of each limit that cannot be decided, once, and keeps it in `notes`."""

    def __init__(self, prepared: Prepared, tell: Callable[[Text], None]) -> None:
        super().__init__()
        self._prepared, self._tell = prepared, tell
        self._notes: dict[str, Text] = {}

    @property
    def notes(self) -> tuple[Text, ...]:
        """The messages about limits that cannot be decided."""
        return tuple(self._notes.values())

    def before(self, expanded: Mapping[str, float]) -> None:
        """Look at the expanded uncertainties, by parameter, that the station's latest test by the plan had."""
        plan, limits = self._prepared.plan, self._prepared.limits
        if limits and not expanded.keys() & limits.keys():
            words = text(
                "{source}: nothing was measured by this plan at this station yet. Whether its uncertainty can "
                "decide the limits is shown by the first motors (motorbench eol check shows it before)",
                source=plan.source,
            )
            self._tell(words)
        for parameter, uncertainty in expanded.items():
            self._look(parameter, uncertainty)

    def done(self, record: MotorRecord) -> None:
        """Look at what a motor's figures had."""
        for figure in record.measured:
            self._look(figure.parameter, figure.expanded)

    def _look(self, parameter: str, expanded: float) -> None:
        prepared = self._prepared
        if parameter in self._notes or parameter not in prepared.limits or parameter not in prepared.parameters:
            return
        expected = prepared.motor.nameplate.expected.get(parameter)
        words = undecidable(
            prepared.plan, prepared.limits[parameter], prepared.parameters[parameter], expanded, expected
        )
        if words is not None:
            self._notes[parameter] = words
            self._tell(words)
