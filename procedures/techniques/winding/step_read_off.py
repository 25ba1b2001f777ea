"""A current step whose time constant a person reads off the oscilloscope's screen (§3.3.1 without waveforms)."""

import math
from collections.abc import Sequence
from dataclasses import dataclass

from GTC.lib import UncertainReal

from drivers.interfaces import Accuracy, Reading, Slope, Trigger
from drivers.interfaces.text import text
from procedures.core.actions import EnterReading
from procedures.core.bench import Bench, ProcedureError
from procedures.estimation.fitting.first_order import time_constant_of_ramp
from procedures.estimation.fitting.repeats import mean_of_readings
from procedures.techniques.acquisition import configure
from procedures.techniques.winding.step_recording import DrivenStep

#: Width of the screen in time constants: narrow enough to read the crossing, wide enough for the current's end.
_SCREEN = 8.0
#: A screen on which the crossing lies further left or right than these shares of it is set anew.
_LEFT, _RIGHT = 0.04, 0.2
_ATTEMPTS = 6
_SHORTEST, _LONGEST = 1e-7, 100.0
#: The supply's meters are read this many time constants after the step.
_SETTLED = 10.0
_TELL = 1.0 - math.exp(-1.0)


@dataclass(frozen=True)
class ReadOffStep:
    """The values read off a step: `crossing` (s) from the middle of the voltage's rise to 63.2 % of the current, `rise` (s) its
    length; and the supply's meters at the end.
    """

    crossing: float
    rise: float
    voltage: Reading
    current: Reading

    @property
    def time_constant(self) -> float:
        """The loop's time constant, s."""
        return time_constant_of_ramp(self.crossing, self.rise)


def read_off_steps(bench: Bench, step: DrivenStep, guess: float, repeats: int) -> list[ReadOffStep]:
    """Take `repeats` steps and have each read off the screen, once its width suits; `guess` (s) is its first width.

    Raises ProcedureError where no width shows the crossing.
    """
    sign = 1.0 if step.forward else -1.0
    for channel, top in ((step.voltage_channel, step.voltage), (step.current_channel, step.current)):
        low, high = sorted((-0.1 * sign * top, 1.3 * sign * top))
        configure(bench.oscilloscope, channel, low, high)
    slope = Slope.RISING if step.forward else Slope.FALLING
    bench.oscilloscope.configure_trigger(Trigger(step.voltage_channel, 0.5 * sign * step.voltage, slope))
    width = guess
    for _ in range(_ATTEMPTS):
        bench.oscilloscope.configure_acquisition(width, 1000, 0.3)
        first = _read_off(bench, step, width)
        if _LEFT * width <= first.crossing <= _RIGHT * width:
            rest = [_read_off(bench, step, width, first.rise) for _ in range(repeats - 1)]
            return [first, *rest]
        width = min(max(_SCREEN * first.crossing, _SHORTEST), _LONGEST)
    raise ProcedureError(
        text(
            "at no width of the screen was the point visible where the current crosses 63.2 %; check the trigger "
            "and the current probe, and that the time is read from the middle of the voltage's rise"
        )
    )


def loop_inductance(bench: Bench, axis: str, steps: Sequence[ReadOffStep], screen: float) -> UncertainReal:
    """Return L = τ·R (H) of the loop: τ read off within the share `screen` of it, R by the supply's meters."""
    unc, last = bench.uncertainties, steps[-1]
    tau = unc.statistical(
        text("time constant, {axis} axis", axis=axis), *mean_of_readings([step.time_constant for step in steps])
    )
    tau = unc.instrument("time read off the screen", tau, Accuracy(gain=screen, source="setting screen_reading"))
    # A rise that is no straight line moves the crossing by less than all that the rise does.
    bend = max(abs(step.time_constant / step.crossing - 1.0) for step in steps)
    tau = unc.instrument(
        text("shape of the voltage's rise, {axis} axis", axis=axis), tau, Accuracy(gain=bend, source="as read off")
    )
    voltage = unc.instrument("supply, voltage", last.voltage.value, last.voltage.accuracy)
    current = unc.instrument("supply, current", last.current.value, last.current.accuracy)
    return tau * voltage / current


def _read_off(bench: Bench, step: DrivenStep, width: float, rise: float | None = None) -> ReadOffStep:
    bench.oscilloscope.initiate()
    with bench.supply.energised(step.voltage, step.limit):
        bench.clock.sleep(max(_SETTLED / _SCREEN * width, 0.1))
        voltage, current = bench.supply.measure_voltage(), bench.supply.measure_current()
    if current.value <= 0.0:
        raise ProcedureError(text("no current flowed during the step; check the connections just made"))
    if rise is None:
        rise = bench.reading(
            EnterReading(
                "voltage_rise_time",
                text("rise time of the voltage on the screen, from its beginning to its end; 0 if it is vertical"),
                "s",
                0.0,
                _LONGEST,
            )
        )
    crossing = bench.reading(
        EnterReading(
            "time_constant",
            text(
                "the time from the middle of the voltage's rise to where the current crosses 63.2 % of its end, about {level:.3g} A",
                level=_TELL * current.value,
            ),
            "s",
            _SHORTEST,
            _LONGEST,
        )
    )
    if crossing <= 0.5 * rise:
        raise ProcedureError(
            text(
                "the current crosses 63.2 % {crossing:g} s after the middle of a rise of {rise:g} s, before its end: the voltage is "
                "too slow for this winding. Use an oscilloscope that gives waveforms, or the bridge",
                crossing=crossing,
                rise=rise,
            )
        )
    return ReadOffStep(crossing, rise, voltage, current)
