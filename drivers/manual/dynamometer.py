"""A dynamometer that a person runs and reads."""

import math
from collections.abc import Iterator
from contextlib import contextmanager

from drivers.bases.always import always
from drivers.interfaces import Clock, Dynamometer, DynamometerReading
from drivers.interfaces.text import text
from drivers.manual.by_hand import InstrumentByHand
from drivers.manual.options import ManualDynamometerOptions
from drivers.manual.prompt import Prompt

RPM = 2 * math.pi / 60


class ManualDynamometer(InstrumentByHand[ManualDynamometerOptions], Dynamometer):
    """A dynamometer, or a drive motor, run and read by hand; speeds are shown and typed in rpm."""

    def __init__(
        self, prompt: Prompt, clock: Clock, options: ManualDynamometerOptions, *, name: str = "dynamometer"
    ) -> None:
        super().__init__(prompt, clock, options, name)

    @property
    def maximum_speed(self) -> float:
        """Largest speed (rad/s) that may be commanded: the station's limit."""
        return self._options.maximum_speed

    @property
    def maximum_torque(self) -> float:
        """Largest torque (N·m) that may be commanded: the station's limit."""
        return self._options.maximum_torque

    def zero_torque(self) -> None:
        """Let the person zero the torque display."""
        self._questions.confirm(text("With the shaft at rest, zero the torque display."))

    @contextmanager
    def driving_speed(self, speed: float) -> Iterator[None]:
        """Let the person bring the shaft to a speed (rad/s) for the length of the block, then let it coast."""
        self._check("driving_speed", speed)
        with always(self._let_coast):
            self._ask_speed(speed)
            yield

    def set_speed(self, speed: float) -> None:
        """Let the person change the speed (rad/s); raises SetpointError before anything is asked."""
        self._check("set_speed", speed)
        self._ask_speed(speed)

    @contextmanager
    def driving_torque(self, torque: float, speed_limit: float | None = None) -> Iterator[None]:
        """Let the person put a constant torque (N·m) on the shaft below a speed (rad/s) for the length of the block, then take it off."""
        highest = self.maximum_speed if speed_limit is None else speed_limit
        self._check("driving_torque", torque, highest)
        with always(self._let_coast):
            self._have_on(
                text(
                    "Set the dynamometer's speed limit to {highest:g} rpm. Put a constant torque of {torque:g} N·m on the shaft.",
                    highest=highest / RPM,
                    torque=torque,
                )
            )
            yield

    def command_zero(self) -> None:
        """Let the person command speed and torque to zero."""
        if not self._is_off:
            self._questions.confirm(text("Command a speed and a torque of zero."))

    def measure(self) -> DynamometerReading:
        """Ask for speed and torque; the power (W) is their product.

        Raises MeasurementError where no accuracy is stated or after three unusable answers.
        """
        speed_accuracy = self._questions.stated(self._options.speed_accuracy, text("speed"))
        torque_accuracy = self._questions.stated(self._options.torque_accuracy, text("torque"))
        fastest = self.maximum_speed / RPM
        speed = self._questions.ask(text("speed"), "rpm", -fastest, fastest, text("forwards positive")) * RPM
        torque = self._questions.ask(
            text("torque"), "N·m", -self.maximum_torque, self.maximum_torque, text("positive when it drives forwards")
        )
        return DynamometerReading(self._clock.now(), speed, torque, speed * torque, speed_accuracy, torque_accuracy)

    def stop(self) -> None:
        """Let the person brake the shaft to rest and switch the drive off."""
        self._questions.confirm(text("Brake the shaft to a standstill and switch the dynamometer off."))
        self._is_off = True

    def make_safe(self) -> None:
        """Let the person switch the dynamometer off."""
        self._let_coast()

    def _ask_speed(self, speed: float) -> None:
        self._have_on(text("Drive the shaft at {speed:g} rpm and wait until the speed is steady.", speed=speed / RPM))

    def _let_coast(self) -> None:
        self._have_off(text("Switch the dynamometer off and let the shaft coast."))
