"""Ranges and accuracies of the Keysight InfiniiVision 3000T X-Series."""

from drivers.bases.oscilloscope_data import OscilloscopeData
from drivers.interfaces import Accuracy

#: Of the figures below only the gain has been compared with the data sheet.
DATA = OscilloscopeData(
    # 1 mV to 5 V a division, 2 ns to 50 s a division, ten of them.
    ranges=(8e-3, 40.0),
    records=(20e-9, 500.0),
    # With two channels of a pair in use, and with all channels.
    maximum_sample_rate=2.5e9,
    maximum_points=2_000_000,
    # Codes of a WORD record (Programmer's Guide 3000T X-Series, :WAVeform:DATA): eight bits in the upper byte, of which
    # 0x00 stands for a hole, 0x01 for "below the screen" and 0xFF for "above it".
    clipped=(0x01FF, 0xFF00),
    codes_per_step=256,
    steps=256,
    # Twelve bits at 10 µs a division and slower.
    fine_steps=16,
    # DC vertical gain accuracy: of eight divisions, whatever part of them a trace spans.
    gain=0.02,
    gain_source="Keysight InfiniiVision 3000T X-Series data sheet 5992-0140; gain 2 % of full scale",
    # 0.1 division + 2 mV + 1 % of the offset setting.
    offset=(0.1, 2e-3, 0.01),
    offset_source="offset typical of its class, enter the calibration",
    # With ten years of aging.
    time_base=Accuracy(gain=1.6e-6 + 10e-6, source="time base typical of its class, not compared with the data sheet"),
)
