"""From a sensor's resistance to its temperature, as the 34461A works it out (Truevolt guide, [SENSe:]TEMPerature)."""

import math

#: Told of a resistance that no sensor of the kind has.
NONE = 9.9e37
#: IEC 60751.
_A, _B, _C = 3.9083e-3, -5.775e-7, -4.183e-12
_RTD_RANGE = (-200.0, 600.0)
#: A thermistor of 5 kΩ at 25 °C (44007), by Steinhart and Hart.
_THERMISTOR = (1.285e-3, 2.362e-4, 9.285e-8)
_THERMISTOR_RANGE = (-80.0, 150.0)


def rtd_temperature(resistance: float, at_zero: float) -> float:
    """Return the temperature (°C) of a platinum sensor of `at_zero` Ω at 0 °C, 9.9E37 outside −200 … 600 °C."""
    low, high = (at_zero * _ratio(limit) for limit in _RTD_RANGE)
    if not low <= resistance <= high:
        return NONE
    first, last = _RTD_RANGE
    for _ in range(60):
        middle = 0.5 * (first + last)
        first, last = (middle, last) if at_zero * _ratio(middle) < resistance else (first, middle)
    return 0.5 * (first + last)


def thermistor_temperature(resistance: float) -> float:
    """Return the temperature (°C) of a thermistor of 5 kΩ, 9.9E37 outside −80 … 150 °C."""
    if not 0.0 < resistance < math.inf:
        return NONE
    logarithm = math.log(resistance)
    first, second, third = _THERMISTOR
    inverse = first + second * logarithm + third * logarithm**3
    temperature = 1.0 / inverse - 273.15 if inverse > 0.0 else math.inf
    return temperature if _THERMISTOR_RANGE[0] <= temperature <= _THERMISTOR_RANGE[1] else NONE


def _ratio(temperature: float) -> float:
    cold = _C * (temperature - 100.0) * temperature**3 if temperature < 0.0 else 0.0
    return 1.0 + _A * temperature + _B * temperature**2 + cold
