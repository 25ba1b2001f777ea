"""The last step of both dynamic pole-pair methods: p = 60 f / n."""

import math
from typing import Any, cast

from GTC import ureal

from drivers.interfaces import Reading
from drivers.interfaces.oscilloscope import ScreenReadings
from procedures.bench import Bench, ProcedureError
from procedures.estimation import pole_pairs
from procedures.procedure import Procedure
from procedures.text import text


def frequency_reading(bench: Bench, channel: int) -> Reading | None:
    """Return the frequency (Hz) read off the screen where the oscilloscope can give no waveform, else None."""
    scope = bench.oscilloscope
    return None if scope.gives_waveforms else cast("ScreenReadings", scope).measure_frequency(channel)


def count(procedure: Procedure[Any], frequency: float, uncertainty: float, speed: Reading, *, section: str) -> None:
    """Report pole pairs from electrical frequency (Hz, with its uncertainty) and the tachometer's reading (rad/s).

    Raises ProcedureError where the shaft stands, or the two figures allow more than one whole number.
    """
    speed_rpm = speed.value * 30.0 / math.pi
    if speed_rpm < 1.0:
        raise ProcedureError(
            text(
                "the tachometer reads {speed:.3g} rpm at {frequency:.4g} Hz: the rotor does not turn",
                speed=speed_rpm,
                frequency=frequency,
            )
        )
    half_width = (
        (speed.accuracy.gain * speed.value + speed.accuracy.offset + speed.accuracy.resolution) * 30.0 / math.pi
    )
    found = pole_pairs.from_frequency(frequency, speed_rpm, uncertainty, half_width)
    procedure.findings |= {
        "frequency": frequency,
        "speed_rpm": speed_rpm,
        "ratio": found.ratio,
        "certain": found.certain,
    }
    if not found.certain or abs(found.ratio - found.pole_pairs) > 0.25:
        procedure.notice(
            "uncertain-count",
            text(
                "60·f/n = {ratio:.3f} is not clearly one whole number; turn faster, or check that the speed is the motor's",
                ratio=found.ratio,
            ),
        )
    procedure.report(
        "pole_pairs",
        "1",
        ureal(float(found.pole_pairs), 0.0),
        section=section,
        estimator="nearest whole number to 60 f / n",
        note_value=found.ratio,
        convention="pole pairs, half the number of poles",
    )
