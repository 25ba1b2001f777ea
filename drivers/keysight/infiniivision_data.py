"""Ranges and accuracies of the Keysight InfiniiVision 3000T X-Series."""

from drivers.interfaces.full_scale import FULL_SCALE_READING

#: Where the figures below come from: only the gain has been compared with the data sheet.
OFFSET_SOURCE = "offset typical of its class, enter the calibration"
SOURCE = f"Keysight InfiniiVision 3000T X-Series data sheet 5992-0140; gain 2 % of full scale; {FULL_SCALE_READING}; {OFFSET_SOURCE}"
TIME_BASE_SOURCE = "time base typical of its class, not compared with the data sheet"

DIVISIONS = 8
#: Full screen (V at the input): 1 mV to 5 V a division.
MINIMUM_RANGE, MAXIMUM_RANGE = 8e-3, 40.0
#: Full record (s): 2 ns to 50 s a division, ten of them.
MINIMUM_RECORD, MAXIMUM_RECORD = 20e-9, 500.0
#: Highest sample rate (1/s) with two channels of a pair in use, and record length with all channels.
MAXIMUM_SAMPLE_RATE, MAXIMUM_POINTS = 2.5e9, 2_000_000

#: DC vertical gain accuracy, of full scale (data sheet): of eight divisions, whatever part of them a trace spans.
GAIN = 0.02
#: DC vertical offset accuracy, typical of the class: 0.1 division + 2 mV + 1 % of the offset setting.
OFFSET_DIVISIONS, OFFSET_FIXED, OFFSET_SHARE = 0.1, 2e-3, 0.01
#: Time base accuracy, relative, with ten years of aging; typical of the class.
TIME_BASE = 1.6e-6 + 10e-6

#: Codes of a WORD record (Programmer's Guide 3000T X-Series, :WAVeform:DATA): eight bits in the upper byte, of which
#: 0x00 stands for a hole, 0x01 for "below the screen" and 0xFF for "above it".
LOWEST_CODE, HIGHEST_CODE = 0x01FF, 0xFF00
CODES_PER_STEP = 256
#: Steps of a sample in the high-resolution mode within one of the converter's: twelve bits at 10 µs a division and slower.
FINE_STEPS = 16
#: Converter steps over the screen's height (eight bits).
CODES_ON_SCREEN = 256
