"""The supply's output as its front panel or remote interface sees it."""

from typing import Literal

from sim_instruments.world.machine_data import SupplyStage
from sim_instruments.world.sources.stuck_output import OutputSwitch
from sim_instruments.world.timeline import Timeline

SupplyMode = Literal["off", "cv", "cc", "unregulated", "tripped"]


class SupplyOutput:
    """Set points and true readings of the supply's output. Ranges and noise belong to the instrument's face."""

    def __init__(self, timeline: Timeline, stage: SupplyStage) -> None:
        self._timeline = timeline
        self.stage = stage
        self.stuck_output = OutputSwitch()
        self._inhibited = False

    def set_voltage(self, voltage: float) -> None:
        """Set the voltage level (V). Raises ValueError outside 0 … the stage's maximum."""
        self._check("voltage", voltage, self.stage.maximum_voltage, "V")
        with self._timeline.lock:
            if self._timeline.settings.supply.voltage == voltage:
                return
            with self._timeline.changing() as settings:
                settings.supply.voltage, settings.supply.changed = voltage, self._timeline.now

    def set_current_limit(self, current: float) -> None:
        """Set the current limit (A). Raises ValueError outside 0 … the stage's maximum."""
        self._check("current limit", current, self.stage.maximum_current, "A")
        with self._timeline.lock:
            if self._timeline.settings.supply.current_limit == current:
                return
            with self._timeline.changing() as settings:
                settings.supply.current_limit, settings.supply.changed = current, self._timeline.now

    def switch(self, on: bool) -> None:
        """Switch the output on or off; a tripped output stays off until its trip is cleared, an inhibited one while it is so."""
        with self._timeline.changing() as settings:
            follows = self.stuck_output.follows(on, settings.supply.on)
            settings.supply.on = follows and settings.supply.tripped is None and not self._inhibited
            settings.supply.changed = self._timeline.now

    def inhibit(self, inhibited: bool) -> None:
        """Take the output off by the inhibit input, or allow it again; it stays off until it is switched on anew."""
        with self._timeline.changing() as settings:
            self._inhibited = inhibited
            if inhibited:
                settings.supply.on = False
                settings.supply.changed = self._timeline.now

    @property
    def inhibited(self) -> bool:
        """True if the inhibit input holds the output off."""
        return self._inhibited

    def set_over_voltage(self, voltage: float | None) -> None:
        """Set the over-voltage protection (V), None for off."""
        with self._timeline.lock:
            if self._timeline.settings.supply.over_voltage == voltage:
                return
            with self._timeline.changing() as settings:
                settings.supply.over_voltage = voltage

    def set_over_current(self, on: bool, delay: float = 0.05, *, from_change: bool = False) -> None:
        """Switch the over-current protection: it trips once the output stays in constant current for `delay` s.

        With `from_change` the delay counts from the last change of voltage, current or output instead.
        """
        with self._timeline.lock:
            supply = self._timeline.settings.supply
            if (supply.over_current, supply.over_current_delay, supply.over_current_from_change) == (
                on,
                delay,
                from_change,
            ):
                return
            with self._timeline.changing():
                supply.over_current, supply.over_current_delay = on, delay
                supply.over_current_from_change = from_change

    def protections(self) -> dict[str, float | bool | None]:
        """Return what is set of the protections: over-voltage (V, None for off), over-current, and its delay (s)."""
        supply = self._timeline.settings.supply
        with self._timeline.lock:
            return {
                "over_voltage": supply.over_voltage,
                "over_current": supply.over_current,
                "over_current_delay": supply.over_current_delay,
            }

    def clear_trip(self) -> None:
        """Clear a trip; the output stays off."""
        with self._timeline.changing() as settings:
            settings.supply.tripped = None

    @property
    def tripped(self) -> Literal["voltage", "current"] | None:
        """The protection that has switched the output off, or None."""
        supply = self._timeline.settings.supply
        with self._timeline.lock:
            # Only an output that is on trips.
            if not supply.on:
                return supply.tripped
        with self._timeline.observing():
            return supply.tripped

    @property
    def is_on(self) -> bool:
        """True if the output is on."""
        supply = self._timeline.settings.supply
        with self._timeline.lock:
            # Nothing but `switch` puts it on.
            if not supply.on:
                return False
        with self._timeline.observing():
            return supply.on

    def voltage(self, aperture: float = 0.0) -> float:
        """Return the mean voltage (V) at the output's terminals over the last `aperture` s; 0 is the present value."""
        with self._timeline.observing():
            return self._timeline.mean(lambda segment, times: segment.output_voltage(times), aperture)

    def current(self, aperture: float = 0.0) -> float:
        """Return the mean output current (A) over the last `aperture` s; 0 is the present value."""
        with self._timeline.observing():
            return self._timeline.mean(lambda segment, times: segment.output_current(times), aperture)

    def mode(self) -> SupplyMode:
        """Return what regulates the output now: off, cv, cc, unregulated (neither holds yet) or tripped."""
        with self._timeline.observing():
            if self._timeline.settings.supply.tripped is not None:
                return "tripped"
            return self._timeline.present.supply_mode

    @staticmethod
    def _check(what: str, value: float, maximum: float, unit: str) -> None:
        if not 0.0 <= value <= maximum:
            raise ValueError(f"supply {what} {value:g} {unit} is outside 0 … {maximum:g} {unit}")
