"""No-load current: what the motor takes to turn itself."""

import math
from collections.abc import Callable
from dataclasses import dataclass
from typing import ClassVar

import numpy as np
from GTC.lib import UncertainReal
from pydantic import Field
from scipy.special import stdtrit

from drivers.interfaces import Accuracy, InverterAbility
from drivers.interfaces.text import text, word
from procedures.core.actions import ALL_OPEN, INVERTER, CoupleDynamometer, ReleaseRotor, UncoupleDynamometer
from procedures.core.bench import ProcedureError, Role
from procedures.core.demand import Demand, Demands
from procedures.core.procedure import Procedure
from procedures.core.procedure_error import OnlyBoundedError
from procedures.core.steps import step
from procedures.estimation.fitting.misfit import ALARM, NO_MISFIT, Answer, Cause, Finding, Misfit
from procedures.estimation.fitting.repeats import mean_of_readings
from procedures.estimation.mechanics.turn_mean import TurnMean, mean_over_turns
from procedures.techniques.shaft.driven_shaft import check_held, driving_speed_rad
from procedures.techniques.shaft.shaft_readings import ShaftReadings
from procedures.verification.settings import DrivenWiringSettings

_RPM = math.pi / 30.0
#: The test current must move the torque by so many of its standard uncertainties.
_CLEAR = 10.0
#: Each of the figures behind a bound, one-sided.
_SURELY = 0.975
#: Readings half a turn apart, or nearly, tell nothing of what repeats every turn: distance from a quarter, in half turns.
_SPREAD = 0.25
#: The first torque is read again after so many times the wait, so often at most, until it no longer changes.
_TIMES, _LONGER = 4.0, 3
#: Of a mean whose readings may all lie within one step, in units of that.
_ROUNDED = 1.0 / math.sqrt(12.0)


@dataclass(frozen=True)
class _Torque:
    """A mean torque (N·m) at a bench time (s), and what its readings of a `resolution` (N·m) showed.

    `once_a_turn` (N·m) is the shaft's, the transducer's filter taken off.
    """

    torque: UncertainReal
    shown: TurnMean
    once_a_turn: float
    time: float
    resolution: float

    @classmethod
    def between(cls, before: "_Torque", after: "_Torque") -> "_Torque":
        """Return the mean of two of one state."""
        once = max(before.once_a_turn, after.once_a_turn)
        mean, time = 0.5 * (before.torque + after.torque), 0.5 * (before.time + after.time)
        return cls(mean, after.shown, once, time, after.resolution)


@dataclass(frozen=True)
class _Drag:
    """A drag (N·m), the transducer's `zero` (N·m) with its scatter (N·m) at a bench time (s) where it was measured, and its part once a
    turn (N·m).
    """

    torque: UncertainReal
    zero: float = 0.0
    scatter: float = 0.0
    time: float | None = None
    once_a_turn: float = 0.0

    @classmethod
    def of_both(cls, forwards: _Torque, backwards: _Torque) -> "_Drag":
        """Return what both ways of turning show: half the difference is the drag, half the sum the zero."""
        scatter = 0.5 * math.hypot(forwards.shown.uncertainty, backwards.shown.uncertainty)
        return cls(
            0.5 * (forwards.torque - backwards.torque),
            0.5 * float((forwards.torque + backwards.torque).x),
            math.hypot(scatter, _ROUNDED * forwards.resolution),
            0.5 * (forwards.time + backwards.time),
            max(forwards.once_a_turn, backwards.once_a_turn),
        )


def _moved_zero(tare: _Drag, without: _Drag, drag: float) -> Misfit:
    """Return what is to be told of a zero that moved between two drags; `drag` (N·m) is the motor's."""
    if tare.time is None or without.time is None or not drag:
        return NO_MISFIT
    drift, spread = without.zero - tare.zero, math.hypot(tare.scatter, without.scatter)
    if not abs(drift) > ALARM * spread:
        return NO_MISFIT
    figures: dict[str, float | str] = {
        "record": "drag",
        "drift": drift,
        "share": abs(drift / drag),
        "time": without.time - tare.time,
    }
    score = drift / spread if spread else 0.0
    return Misfit((Finding(Cause.TORQUE_ZERO, Answer.MODELLED, ("no_load_current",), score, figures),))


class NoLoadCurrentSettings(DrivenWiringSettings):
    """Settings of the no-load current."""

    speed_share: float = Field(default=0.5, gt=0.0, le=1.0, description="speed, share of the rated speed")
    current_share: float = Field(
        default=0.1,
        gt=0.0,
        le=1.0,
        description="test current that gives the torque per ampere, share of the rated current",
    )
    readings: int = Field(default=8, ge=3, le=10_000, description="readings of the torque in each state")
    interval: float = Field(default=0.03, ge=0.0, le=10.0, description="time between readings, s")
    settle: float = Field(
        default=0.1,
        gt=0.0,
        le=60.0,
        description="time before the first of these readings, for the filter to settle, s; longer where the torque is seen to lag",
    )
    tare: float | None = Field(
        default=None,
        ge=0.0,
        description="drag of the dynamometer alone at this speed, N·m; measured when not given",
    )
    tare_uncertainty: float = Field(default=0.0, ge=0.0, description="its standard uncertainty, N·m")


class NoLoadCurrent(Procedure[NoLoadCurrentSettings]):
    """Torque-producing current at which the motor turns itself at a speed: its drag over its torque per ampere.

    The dynamometer holds the speed, backwards and forwards: half the difference is the drag, however the transducer's zero moves
    between the two states. What the dynamometer takes alone is subtracted, and a test current tells how much current gives as much.
    The transducer's gain is the same everywhere and cancels.
    """

    name: ClassVar[str] = "no-load-current"
    title: ClassVar[str] = "No-load current"
    section: ClassVar[str] = "L4"
    roles: ClassVar[frozenset[Role]] = frozenset({Role.DYNAMOMETER, Role.INVERTER})
    gives: ClassVar[tuple[str, ...]] = ("no_load_current",)
    needs: ClassVar[Demands] = {
        Role.DYNAMOMETER: Demand(automatic=True),
        Role.INVERTER: Demand(automatic=True, abilities=frozenset({InverterAbility.Q_CURRENT})),
    }
    end_of_line: ClassVar[bool] = True
    _settle: float | None = None

    def measure(self) -> None:
        """Turn the dynamometer alone, then the motor without and with a current."""
        self._speed = driving_speed_rad(self.bench, self.nameplate, self.settings.speed_share)
        tare = self.tare()
        self.couple()
        without, moved, current = self.turn()
        self.conclude(tare, without, moved, current)

    @step(
        "L4/1",
        "The dynamometer alone, backwards and forwards at {speed_share:.0%} of the rated speed: its own drag",
        by_hand=True,
    )
    def tare(self) -> _Drag:
        """Return the drag (N·m) of the dynamometer alone, measured or as given."""
        bench, settings = self.bench, self.settings
        if bench.dynamometer.read_by_hand or bench.inverter.read_by_hand:
            raise ProcedureError(
                text(
                    "a small difference of torques is averaged over many readings, for which dynamometer and inverter "
                    "must be read automatically"
                )
            )
        if settings.tare is not None:
            return _Drag(bench.uncertainties.standard("tare: drag", settings.tare, settings.tare_uncertainty))
        bench.perform(ALL_OPEN, UncoupleDynamometer())
        back = self._backwards("the dynamometer alone, backwards")
        with bench.dynamometer.driving_speed(self._speed):
            result = _Drag.of_both(self._torque("the dynamometer alone"), back)
        bench.dynamometer.stop()
        return result

    @step(
        "L4/2",
        "Couple the motor, connect it to the inverter, and verify that its torque drives forwards",
        by_hand=True,
    )
    def couple(self) -> None:
        """Leave the motor ready to be driven from both sides."""
        self.bench.perform(ReleaseRotor(), INVERTER, CoupleDynamometer())
        self.wiring.inverter.direction(INVERTER)

    @step(
        "L4/3",
        "Backwards and forwards at the same speed: the torque without a current, then forwards with {current_share:.0%} of "
        "the rated one",
    )
    def turn(self) -> tuple[_Drag, UncertainReal, UncertainReal]:
        """Return the drag without a current, by how much (N·m) the test current moves the torque, and that current (A)."""
        bench, unc = self.bench, self.bench.uncertainties
        bound = min(bench.inverter.maximum_current, self.nameplate.current_bound)
        level = min(self.settings.current_share * self.nameplate.rated_current, bound)
        read: list[float] = []
        accuracy = Accuracy()

        def also() -> None:
            nonlocal accuracy
            reading = bench.inverter.measure_current()
            read.append(reading.value)
            accuracy = reading.accuracy

        bench.thermometer.warmed()
        back = self._backwards("the motor backwards without a current")
        with bench.dynamometer.driving_speed(self._speed):
            before = self._torque("the motor without a current")
            with bench.inverter.driving_current(level):
                driven = self._torque("the motor with the test current", also)
            after = self._torque("the motor once more without a current")
        bench.dynamometer.stop()
        # Either side of the test current, so that a zero that moves evenly falls out.
        without = _Torque.between(before, after)
        mean, uncertainty, freedom = mean_of_readings(read)
        current = unc.statistical("readings of the test current", mean, uncertainty, freedom)
        moved = without.torque - driven.torque
        return _Drag.of_both(without, back), moved, unc.instrument("inverter, current", current, accuracy)

    @step("L4/4", "No-load current: drag over torque per ampere")
    def conclude(self, tare: _Drag, without: _Drag, moved: UncertainReal, current: UncertainReal) -> None:
        """Report the current (A, peak) and keep drag and slope. Raises OnlyBoundedError where the motor drags too unevenly."""
        drag = without.torque - tare.torque
        self.tell_misfit(_moved_zero(tare, without, float(drag.x)))
        if float(moved.x) <= _CLEAR * float(moved.u):
            raise self._unclear(drag, moved, current)
        self.findings |= {
            "speed_rpm": self._speed / _RPM,
            "drag": float(drag.x),
            "tare": float(tare.torque.x),
            "drag_once_a_turn": without.once_a_turn,
            "torque_per_ampere": float((moved / current).x),
        }
        self.report(
            "no_load_current",
            drag / moved * current,
            section=self.section,
            estimator="drag of the motor alone over the torque per ampere of a test current",
        )

    def _unclear(self, drag: UncertainReal, moved: UncertainReal, current: UncertainReal) -> ProcedureError:
        """Return why no torque per ampere is found, and how much the motor takes at least where that can be told.

        A rotor that rubs drags unevenly, so that its torque scatters by more than a small current moves it.
        """
        message = text(
            "a current of {current:.3g} A changes the torque by {moved:.2g} N·m, known to ±{uncertainty:.1g} N·m: "
            "too little to find the torque per ampere. Raise current_share, or take more readings",
            current=float(current.x),
            moved=float(moved.x),
            uncertainty=float(moved.u),
        )
        least, most, test = (
            float(figure.x) + sign * float(stdtrit(figure.df, _SURELY)) * float(figure.u)
            for figure, sign in ((drag, -1.0), (moved, 1.0), (current, -1.0))
        )
        if min(least, most, test) <= 0.0:
            return ProcedureError(message)
        low = least / most * test
        sentence = text(
            "{said}; the motor drags by {drag:.2g} N·m, and takes {low:.2g} A at least",
            said=message,
            drag=least,
            low=low,
        )
        return OnlyBoundedError(sentence, "no_load_current", low)

    def _backwards(self, what: str) -> _Torque:
        with self.bench.dynamometer.driving_speed(-self._speed):
            result = self._torque(what)
        self.bench.dynamometer.stop()
        return result

    def _torque(self, what: str, also: Callable[[], None] = lambda: None) -> _Torque:
        """Return the mean torque after settling; `also` is done beside each reading.

        The first one is waited for until it no longer changes, and all others until then. Raises ProcedureError where it always does.
        """
        if self._settle is not None:
            return self._settled(what, self._settle, also)
        wait = self.settings.settle
        last = self._settled(what, wait, also)
        for _ in range(_LONGER):
            wait *= _TIMES
            again = self._settled(what, wait, also)
            spread = math.hypot(last.shown.uncertainty, again.shown.uncertainty)
            resolution = _ROUNDED * again.resolution
            if abs(again.shown.mean - last.shown.mean) <= ALARM * math.hypot(spread, resolution):
                # The shorter wait has been shown to be enough.
                self._settle = wait / _TIMES
                return again
            last = again
        raise ProcedureError(
            text(
                "the torque still changes {time:.3g} s after the speed was reached, as behind a slow filter or with a zero that drifts: "
                "shorten the torque transducer's filter, let the transducer warm up, or raise settle",
                time=wait,
            )
        )

    def _settled(self, what: str, settle: float, also: Callable[[], None]) -> _Torque:
        bench, unc = self.bench, self.bench.uncertainties
        bench.clock.sleep(settle)
        shaft, read = ShaftReadings(bench), []
        for _ in range(self.settings.readings):
            bench.clock.sleep(self._interval())
            read.append(shaft.measure())
            also()
        self.tell_misfit(shaft.misfit())
        check_held(bench, read, self._speed)
        shown = mean_over_turns([r.torque for r in read], [r.time for r in read], [r.speed for r in read])
        accuracy = read[-1].torque_accuracy
        own = unc.statistical(
            text("readings of the torque, {what}", what=word(what)),
            shown.mean,
            shown.uncertainty,
            shown.degrees_of_freedom,
        )
        common = Accuracy(gain=accuracy.gain, offset=accuracy.offset, source=accuracy.source)
        # A filter of the transducer's lets through less of what changes.
        once = shown.once_a_turn * math.hypot(1.0, read[-1].torque_filter * self._speed)
        time = float(np.mean([r.time for r in read]))
        return _Torque(unc.instrument("dynamometer, torque", own, common), shown, once, time, accuracy.resolution)

    def _interval(self) -> float:
        """Return the time between readings (s), such that they are not always at the same places of the turn."""
        turns = self.settings.interval * abs(self._speed) / (2.0 * math.pi)
        from_half = abs((2.0 * turns) % 1.0 - 0.5)
        return (
            self.settings.interval * (1.0 if from_half < _SPREAD else 1.0 + 0.15 / turns)
            if turns
            else self.settings.interval
        )
