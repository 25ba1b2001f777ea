"""DC voltage ranges and accuracy of the Keysight 34461A (data sheet 5991-1983EN, specifications 34461A)."""

from drivers.interfaces import Accuracy
from drivers.interfaces.text import text

#: Where the figures below stand: one year, calibration temperature ± 5 °C, 60 minutes of warm-up, auto zero on.
SOURCE = "Keysight 34461A data sheet 5991-1983EN, DC voltage, 1 year, calibration temperature ± 5 °C"

#: By range (V): limits of error in % of the reading and in % of the range.
RANGES: dict[float, tuple[float, float]] = {
    0.1: (0.0050, 0.0035),
    1.0: (0.0040, 0.0007),
    10.0: (0.0035, 0.0005),
    100.0: (0.0045, 0.0006),
    1000.0: (0.0045, 0.0010),
}
HIGHEST_RANGE = max(RANGES)

#: Step of a reading as a share of the range, by power-line cycles (Operating and Service Guide, "Range, Resolution and
#: Integration Time"). The accuracy is stated for these two only; the instrument also offers 0.02, 0.2 and 1.
RESOLUTION = {10.0: 1e-6, 100.0: 0.3e-6}
FEWEST_CYCLES, MOST_CYCLES = min(RESOLUTION), max(RESOLUTION)


def range_for(voltage: float) -> float:
    """Return the smallest range (V) that holds a voltage (V, either sign); raises ValueError beyond the highest.

    The 20 % that a range shows beyond its name are kept in reserve.
    """
    for full_scale in RANGES:
        if abs(voltage) <= full_scale:
            return full_scale
    raise ValueError(
        text(
            "{voltage:g} V is beyond the highest range, {highest:g} V",
            voltage=voltage,
            highest=HIGHEST_RANGE,
        )
    )


def cycles_for(power_line_cycles: float) -> float:
    """Return the least integration time (power-line cycles) with a stated accuracy that is no shorter than asked for."""
    return next(offered for offered in sorted(RESOLUTION) if offered >= power_line_cycles)


def stated_accuracy(full_scale: float, cycles: float) -> Accuracy:
    """Return the accuracy in a range (V) at an integration time (power-line cycles, 10 or 100)."""
    reading, share = RANGES[full_scale]
    return Accuracy(
        gain=reading / 100,
        offset=share / 100 * full_scale,
        resolution=RESOLUTION[cycles] * full_scale,
        source=SOURCE,
    )
