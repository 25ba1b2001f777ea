"""Stored captures: a scope maker's CSV, plain CSV, and motorbench's own waveforms."""

from bench.captures.capture import Capture, CaptureChannel, CaptureError, ProbeFactor
from bench.captures.part import WHOLE, CapturePart
from bench.captures.reading import read_capture, read_captures

__all__ = [
    "WHOLE",
    "Capture",
    "CaptureChannel",
    "CaptureError",
    "CapturePart",
    "ProbeFactor",
    "read_capture",
    "read_captures",
]
