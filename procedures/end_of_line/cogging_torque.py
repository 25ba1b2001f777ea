"""Cogging torque by a slow turn under the dynamometer's torque reading."""

import math
from dataclasses import dataclass
from typing import ClassVar

import numpy as np
from pydantic import Field

from drivers.interfaces import Accuracy, DynamometerReading
from drivers.interfaces.text import text
from procedures.core.actions import CoupleDynamometer, ReleaseRotor
from procedures.core.bench import ProcedureError, Role
from procedures.core.curves import curve
from procedures.core.demand import Demand, Demands
from procedures.core.procedure import Procedure
from procedures.core.steps import step
from procedures.estimation.fitting.fit import FloatArray
from procedures.estimation.fitting.misfit import NO_MISFIT, Answer, Cause, Finding, Misfit
from procedures.estimation.mechanics.cogging import Cogging, fit_cogging
from procedures.estimation.mechanics.cogging_speeds import AtHalfSpeed, compare, part_of_turn, read_again
from procedures.estimation.mechanics.torque_start import lag_at_start
from procedures.techniques.shaft.cogging_figure import TransducerFilter, cogging_figure
from procedures.techniques.shaft.driven_shaft import driving_speed_rad
from procedures.verification.settings import WiringSettings

_RPM = math.pi / 30.0
#: From this part of a turn on a figure is that of the turn.
_WHOLE = 0.98
#: Orders below this are no cogging where the pole pairs are not known: each pole passes a slot twice a turn at least.
_LOWEST = 6
#: Readings a turn, and for each pole pair: the least common multiple of slots and poles is often twelve times the pole pairs.
_FEWEST_A_TURN, _FOR_EACH_PAIR, _USUAL_PAIRS = 250, 60.0, 10.0
#: Readings come later than evenly spaced ones by up to this share of their spacing, by a rule that never repeats itself.
_UNEVEN, _GOLDEN = 0.8, 0.5 * (math.sqrt(5.0) - 1.0)
#: Readings a period at half the speed, at least so many in all, so long (s) after it is reached.
_AGAIN, _FEWEST, _SETTLED = 8, 60, 0.5


@dataclass(frozen=True)
class Turned:
    """Readings of one even turn, or of a part of it."""

    readings: list[DynamometerReading]

    @property
    def time(self) -> FloatArray:
        """Times (s) of the readings."""
        return np.array([r.time for r in self.readings])

    @property
    def torque(self) -> FloatArray:
        """Torques (N·m)."""
        return np.array([r.torque for r in self.readings])

    @property
    def speed(self) -> float:
        """Mean speed (rad/s)."""
        return float(np.mean([r.speed for r in self.readings]))

    @property
    def angle(self) -> FloatArray:
        """Angles (rad) by that speed, from 0."""
        return self.speed * (self.time - self.readings[0].time)


class CoggingTorqueSettings(WiringSettings):
    """Settings of the cogging torque."""

    speed_rpm: float = Field(default=6.0, gt=0.0, le=120.0, description="speed of the turn, rpm")
    order: int | None = Field(
        default=None,
        ge=2,
        le=10_000,
        description="periods of the cogging a turn: least common multiple of slots and poles; sought over a whole turn when not given",
    )
    periods: float = Field(
        default=12.0, ge=2.0, le=10_000.0, description="periods to turn through, if the order is known"
    )
    readings_per_period: int = Field(
        default=10, ge=4, le=1000, description="readings per period, if the order is known"
    )
    turns: float = Field(
        default=2.0,
        ge=1.0,
        le=20.0,
        description="turns, if the order is not known; one turn alone does not show what happens only once: a drift, hum, a "
        "knock",
    )
    readings: int | None = Field(
        default=None,
        ge=50,
        le=100_000,
        description="readings per turn, if the order is not known; 60 for each pole pair and at least 250, 600 if those are not known",
    )
    half_speed: bool = Field(
        default=True,
        description="read some periods at half the speed as well: a filter, or a vibration, then does not pass for cogging",
    )
    averaging: float = Field(
        default=0.02, ge=0.0, le=10.0, description="time over which the transducer averages at most, s"
    )


class CoggingTorque(Procedure[CoggingTorqueSettings]):
    """Peak-to-peak torque that an open motor repeats every turn, without its drag and a coupling's run-out.

    For a stepping motor it is the detent torque of IEC TS 60034-20-1, 6.9.
    """

    name: ClassVar[str] = "cogging-torque"
    title: ClassVar[str] = "Cogging torque"
    section: ClassVar[str] = "L5"
    roles: ClassVar[frozenset[Role]] = frozenset({Role.DYNAMOMETER})
    gives: ClassVar[tuple[str, ...]] = ("cogging_torque",)
    needs: ClassVar[Demands] = {Role.DYNAMOMETER: Demand(automatic=True)}
    end_of_line: ClassVar[bool] = True

    def measure(self) -> None:
        """Turn slowly, and take what repeats itself."""
        self.prepare()
        self.conclude(*self.turn())

    @step("L5/1", "Open the terminals, couple the dynamometer", by_hand=True)
    def prepare(self) -> None:
        """Leave the winding without a current, for that would brake."""
        if self.bench.dynamometer.read_by_hand:
            raise ProcedureError(
                text(
                    "cogging needs many torque readings a turn, and this dynamometer is read by a person; use one that is "
                    "read automatically"
                )
            )
        self.wiring.shaft.open_terminals(ReleaseRotor(), CoupleDynamometer())

    @step(
        "L5/2",
        "Turn the shaft evenly at {speed_rpm:g} rpm through some periods of the cogging or a turn, reading the torque; then "
        "some periods at half the speed",
    )
    def turn(self) -> tuple[Turned, Cogging, AtHalfSpeed]:
        """Return the readings, spread over the way, and what they show."""
        bench, settings = self.bench, self.settings
        speed = min(settings.speed_rpm * _RPM, driving_speed_rad(bench, self.nameplate, 1.0))
        pairs = self._pole_pairs()
        readings = settings.readings or max(_FEWEST_A_TURN, round(_FOR_EACH_PAIR * (pairs or _USUAL_PAIRS)))
        count, turns = round(readings * settings.turns), settings.turns
        if settings.order is not None:
            count, turns = round(settings.periods * settings.readings_per_period), settings.periods / settings.order
        turned = self._turned(speed, turns, count)
        found = self._fitted(turned)
        if not (settings.half_speed and found.orders.size):
            return turned, found, AtHalfSpeed()
        orders = read_again(found.orders, found.amplitudes)
        part = part_of_turn(orders)
        again = self._turned(0.5 * speed, part, max(math.ceil(_AGAIN * part * float(orders.max())), _FEWEST), _SETTLED)
        last = turned.readings[-1]
        seen = compare(
            (turned.angle, turned.torque),
            (again.angle, again.torque),
            orders,
            found,
            abs(turned.speed),
            settings.averaging,
            last.torque_filter,
        )
        return turned, found, seen

    def _turned(self, speed: float, turns: float, count: int, settle: float = 0.0) -> Turned:
        """Turn at a speed (rad/s) for so many turns, `settle` s after it is reached."""
        bench = self.bench
        interval = 2.0 * math.pi * turns / (speed * count)
        taken: list[DynamometerReading] = []
        with bench.dynamometer.driving_speed(speed):
            bench.clock.sleep(settle)
            begun = bench.clock.now()
            for number in range(count):
                # Not in step with anything: what is too quick to be seen must not look like something slow.
                due = begun + (number + _UNEVEN * math.fmod(number * _GOLDEN, 1.0)) * interval
                bench.clock.sleep(max(due - bench.clock.now(), 0.0))
                taken.append(bench.dynamometer.measure())
        bench.dynamometer.stop()
        return Turned(taken)

    def _pole_pairs(self) -> float | None:
        """Return the pole pairs, None where nothing says them."""
        return self.known_value("pole_pairs") or self.nameplate.pole_pairs or self.nameplate.expected.get("pole_pairs")

    def _fitted(self, turned: Turned) -> Cogging:
        last = turned.readings[-1]
        pairs = self._pole_pairs()
        return fit_cogging(
            turned.angle,
            turned.torque,
            time=turned.time,
            order=self.settings.order,
            lowest_order=max(2 * round(pairs), 2) if pairs else _LOWEST,
            resolution=last.torque_accuracy.resolution,
            torque_filter=last.torque_filter,
        )

    @step("L5/3", "Cogging torque, peak to peak: the part that repeats every turn and exceeds the noise")
    def conclude(self, turned: Turned, fit: Cogging, slower: AtHalfSpeed) -> None:
        """Report the peak-to-peak torque (N·m)."""
        unc, last, angle = self.bench.uncertainties, turned.readings[-1], turned.angle
        turns = abs(float(angle[-1] - angle[0])) * angle.size / (angle.size - 1) / (2.0 * math.pi)
        part = turns < _WHOLE
        self.findings |= {
            "turned": turns,
            "orders": fit.orders.tolist(),
            "amplitudes": fit.amplitudes.tolist(),
            "drag": fit.mean,
            "noise": fit.noise,
            "readings": curve(angle=angle, torque=turned.torque),
        }
        highest = 0.5 * angle.size / turns
        transducer = TransducerFilter(self.settings.averaging, last.torque_filter)
        size, notices = cogging_figure(
            unc, fit, slower, transducer, abs(turned.speed), highest, order_given=self.settings.order is not None
        )
        for name, said in notices:
            self.notice(name, said)
        seen = NO_MISFIT if fit.orders.size else self._lag(turned)
        self.report(
            "cogging_torque",
            unc.instrument("dynamometer, torque", size, self._gain(last.torque_accuracy)),
            section=self.section,
            estimator="orders that stand out of the noise, from trough to crest, in the part of a turn that was read"
            if part
            else "orders that stand out of the noise, from trough to crest",
            misfit=Misfit.together((fit.misfit, slower.misfit, seen)).of("cogging_torque"),
        )

    def _lag(self, turned: Turned) -> Misfit:
        """Return what is to be told where the drag comes by and by after the start: the filter that delays it hides cogging, too."""
        last = turned.readings[-1]
        lag = 0.0 if last.torque_filter else lag_at_start(turned.time, turned.torque, last.torque_accuracy.resolution)
        if lag <= self.settings.averaging:
            return NO_MISFIT
        figures: dict[str, float | str] = {"record": "cogging-start", "time_constant": lag}
        return Misfit((Finding(Cause.TORQUE_FILTER, Answer.WITHHELD, ("cogging_torque",), figures=figures),))

    def _gain(self, accuracy: Accuracy) -> Accuracy:
        """Return the transducer's gain: its zero falls out of a difference; a share of full scale may be a slope over that."""
        slope = accuracy.offset / self.bench.dynamometer.maximum_torque
        return Accuracy(gain=accuracy.gain or slope, source=accuracy.source)
