"""The outputs of an E36313A: what each can do, and what is set of it."""

from dataclasses import dataclass


@dataclass(frozen=True)
class Rating:
    """Programming limits of an output: V, A, over-voltage V; `resolution` is that of readings (V, A)."""

    voltage: float
    current: float
    over_voltage: float
    default_current: float
    resolution: tuple[float, float]
    noise: tuple[float, float]


RATINGS = {
    1: Rating(6.18, 10.3, 6.6, 10.0, (1.0e-4, 1.0e-4), (5.0e-5, 2.0e-4)),
    2: Rating(25.75, 2.06, 27.5, 2.0, (1.0e-4, 1.0e-4), (1.0e-4, 5.0e-5)),
    3: Rating(25.75, 2.06, 27.5, 2.0, (1.0e-4, 1.0e-4), (1.0e-4, 5.0e-5)),
}


@dataclass
class ProgrammedOutput:
    """The settings of an output."""

    rating: Rating
    voltage: float = 0.0
    current: float = 0.0
    over_voltage: float = 0.0
    over_current: bool = False
    over_current_delay: float = 0.05
    over_current_start: str = "SCH"
    on: bool = False

    def reset(self) -> None:
        """Return to the defaults, switched off."""
        self.voltage, self.current = 0.0, self.rating.default_current
        self.over_voltage, self.over_current, self.over_current_delay = self.rating.over_voltage, False, 0.05
        self.over_current_start = "SCH"
        self.on = False
