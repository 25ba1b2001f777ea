"""Calls of keyoscacquire on the oscilloscope: settings, traces in every format."""

import numpy as np
from calls import TRUTH, Calls, address
from keyoscacquire.oscilloscope import Oscilloscope


def trace_is_right(found) -> bool:
    """Say whether a trace is the line-to-line EMF."""
    _, volts, _ = found
    return abs(np.max(volts) / TRUTH["amplitude"] - 1.0) < 0.05


scope = Oscilloscope(address=address("oscilloscope"), timeout=1_500, verbose=False)
scope.write("*CLS")
for line in (":CHAN1:SCAL 4", ":CHAN2:SCAL 4", ":TIM:RANG 0.1", ":TRIG:LEV 0"):
    scope.write(line)
calls = Calls("keyoscacquire Oscilloscope", lambda: scope._inst.query(":SYST:ERR?"))
calls.make("num_averages = 8", lambda: setattr(scope, "num_averages", 8))
for name in ("active_channels", "acq_type", "p_mode", "num_points", "wav_format", "timeout"):
    value = calls.make(name, lambda name=name: getattr(scope, name))
    calls.make(f"{name} = …", lambda name=name, value=value: setattr(scope, name, value))
for name in ("is_running", "get_error", "get_full_error_queue", "print_acq_settings", "stop", "run"):
    calls.make(f"{name}()", getattr(scope, name))
for form in ("BYTE", "WORD", "ASCii"):
    for kind in ("NORMal", "HRESolution", "AVER8"):
        calls.make(
            f"set_options_get_trace({form}, {kind})",
            lambda form=form, kind=kind: scope.set_options_get_trace(
                [1], wav_format=form, acq_type=kind, num_points=2000
            ),
            lambda found: trace_is_right(found),
        )
# The client takes the block's ten characters of header off for the series 2000 X alone, which it was written with.
scope._model_series = "2000"
calls.make(
    "set_options_get_trace(ASCii, NORMal), header taken off as of a 2000 X",
    lambda: scope.set_options_get_trace([1], wav_format="ASCii", acq_type="NORMal", num_points=2000),
    lambda found: trace_is_right(found),
)
