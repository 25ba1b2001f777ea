"""Events of a run's journal: what every event declares, and the events that procedures make.

An event's fields are its data in the journal, in this order and by these names.
"""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from typing import Any, ClassVar, dataclass_transform

from procedures.core.actions import Action

#: What hand work gives.
Given = float | bool | str | Sequence[float] | None


def optional(default: Any = None) -> Any:
    """Return a field that is left out of the journal where it has its default."""
    if default == {}:
        return field(default_factory=dict, metadata={"optional": True})
    return field(default=default, metadata={"optional": True})


@dataclass_transform(kw_only_default=True, frozen_default=True, field_specifiers=(field,))
class Event:
    """Event of a run; a subclass with a `kind` is what the journal calls it, one without is shared by several.

    Its subclasses are frozen dataclasses whose fields are given by name.

    A `durable` event has reached the disk, not only the operating system, before what follows it happens. One that `joins`
    reaches it with the event that follows: for those after which nothing happens before another event is recorded. A `closing`
    one tells how something ends: it is still tried when the journal could not be written.
    """

    kind: ClassVar[str] = ""
    durable: ClassVar[bool] = False
    joins: ClassVar[bool] = False
    closing: ClassVar[bool] = False

    def __init_subclass__(
        cls, *, kind: str = "", durable: bool = False, joins: bool = False, closing: bool = False
    ) -> None:
        super().__init_subclass__()
        cls.kind, cls.durable, cls.joins, cls.closing = kind, durable, joins, closing
        dataclass(frozen=True, kw_only=True)(cls)


class StepStarted(Event, kind="step_started"):
    """A step begins: its identifier, its sentence in English, bench time (s)."""

    step: str
    text: str
    time: float


class StepFinished(Event, kind="step_finished", durable=True, joins=True):
    """A step has come to its end, at a bench time (s)."""

    step: str
    time: float


class StepFailed(Event, kind="step_failed", durable=True, closing=True):
    """A step was left by an error, at a bench time (s)."""

    step: str
    error: str
    time: float


@dataclass(frozen=True)
class UnknownAction:
    """Manual work from the journal of another version, with its fields unchanged."""

    details: Mapping[str, Any]


class ActionStarted(Event, kind="action"):
    """Manual work is requested: the action's class, the action, and its lines in English."""

    action: str
    details: Action | UnknownAction
    text: Sequence[str]


class ActionDone(Event, kind="action_done"):
    """Manual work is done; its result is a reading, angles (rad), whether something was corrected, a command, or None."""

    action: str
    given: Given


class RepeatStarted(Event, kind="repeat"):
    """A reading of several under one condition is about to be taken: between which terminals, its number from 1, of how many.

    `again` where it is taken once more, out of order.
    """

    terminals: str
    number: int
    count: int
    again: bool = optional(default=False)


class MayBeAsked(Event, kind="may_be_asked"):
    """From here on readings decide which of these lines (AB, BC, CA) hands connect once more; none ends it."""

    lines: Sequence[str]


class RepeatsTaken(Event, kind="repeats_taken"):
    """Readings under one condition are complete: those taken (in `unit`), and those left out because they contradict the others."""

    terminals: str
    quantity: str
    unit: str
    taken: Sequence[float]
    left_out: Sequence[float] = ()


class StrokesKept(Event, kind="strokes_kept"):
    """The record of strokes before this event counts for a map, with what else the map takes from the bench.

    `channel_gains` is what each channel's samples were divided by, `voltage_gain` the limit (relative) of the gain that is left in them,
    `current_gain` that of the inverter's currents. `flux_linkage` (V·s, peak) of the magnets has the standard uncertainty
    `u_flux_linkage`; `locked` says that the rotor was held. `resistance` (Ω, as warm as before the strokes) of the winding has the
    standard uncertainty `u_resistance`; 0 where it was not measured before.
    """

    channel_gains: Mapping[str, float]
    voltage_gain: float
    current_gain: float
    flux_linkage: float
    u_flux_linkage: float
    locked: bool
    resistance: float = optional(0.0)
    u_resistance: float = optional(0.0)


class ReadingTyped(Event, kind="reading_typed"):
    """A person typed a number: what was asked, what was typed, and the value taken in `unit`; None where it was refused, and why."""

    quantity: str
    unit: str
    typed: str
    value: float | None
    refused: str = optional("")


class ReadingCorrected(Event, kind="reading_corrected"):
    """A person corrected a number typed earlier: what was asked, what was typed now, the value before, the value used now, by whom.

    `before` and `after` are the whole reading of the `instrument` that shows it, or the value where it is no instrument's.
    """

    quantity: str
    unit: str
    was: float
    typed: str
    value: float
    by: str
    instrument: str = optional("")
    before: Any = field(default=None, metadata={"optional": True})
    after: Any = field(default=None, metadata={"optional": True})


class WarningGiven(Event, kind="warning"):
    """A procedure warns: an erratum's id or the finding's name, and the sentence in English."""

    id: str
    message: str


class WiringChecked(Event, kind="wiring_checked"):
    """A connection was compared with what was measured on it.

    `by` is the role that measured, `read` its readings by name, `possible` the miswirings that explain them; of `terminals`
    (by motor terminal), `probes` and `voltmeter` (its two terminals), those stand that the check was of.
    """

    outcome: str
    by: str
    reason: str
    read: Mapping[str, Any]
    possible: Sequence[Mapping[str, Any]]
    terminals: Mapping[str, str] | None = optional()
    probes: Sequence[Mapping[str, Any]] | None = optional()
    voltmeter: Sequence[str] | None = optional()
