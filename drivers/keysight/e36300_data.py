"""Ranges and accuracies of the Keysight E36300 series; a station's calibration entry goes before the accuracies."""

from drivers.bases.scpi_supply import SupplyData
from drivers.interfaces import Accuracy

#: The ratings are those of data sheet 5992-2124. The readback accuracies have not been compared with it: they are what
#: supplies of this class have over 12 months at 23 °C ± 5 °C.
SOURCE = "readback accuracy typical of its class, not compared with the data sheet; enter the calibration"

#: Over-voltage protection is taken to go up to 110 % of the rated voltage; the instrument refuses what is beyond its own.
OVER_VOLTAGE_SHARE = 1.1


def _output(
    rated_voltage: float, rated_current: float, voltage: tuple[float, float], current: tuple[float, float]
) -> SupplyData:
    # Supplies of this series can be programmed to 103 % of the rating; the instrument refuses what is beyond its own.
    return SupplyData(
        round(1.03 * rated_voltage, 6),
        round(1.03 * rated_current, 6),
        OVER_VOLTAGE_SHARE * rated_voltage,
        Accuracy(gain=voltage[0], offset=voltage[1], source=SOURCE),
        Accuracy(gain=current[0], offset=current[1], source=SOURCE),
    )


#: Outputs by model and number. The pairs are gain (relative) and offset (V, A) of the readback.
OUTPUTS: dict[str, dict[int, SupplyData]] = {
    "E36311A": {
        1: _output(6.0, 5.0, (1.0e-3, 5e-3), (2.0e-3, 10e-3)),
        2: _output(25.0, 1.0, (0.5e-3, 10e-3), (1.5e-3, 4e-3)),
        3: _output(25.0, 1.0, (0.5e-3, 10e-3), (1.5e-3, 4e-3)),
    },
    "E36312A": {
        1: _output(6.0, 5.0, (0.3e-3, 2e-3), (0.4e-3, 4e-3)),
        2: _output(25.0, 1.0, (0.3e-3, 5e-3), (0.4e-3, 2e-3)),
        3: _output(25.0, 1.0, (0.3e-3, 5e-3), (0.4e-3, 2e-3)),
    },
    "E36313A": {
        1: _output(6.0, 10.0, (0.3e-3, 2e-3), (0.5e-3, 10e-3)),
        2: _output(25.0, 2.0, (0.3e-3, 5e-3), (0.4e-3, 4e-3)),
        3: _output(25.0, 2.0, (0.3e-3, 5e-3), (0.4e-3, 4e-3)),
    },
}
