"""Stored captures: a scope maker's CSV, plain CSV, and motorbench's own waveforms."""

from bench.captures.capture import Capture, CaptureChannel, CaptureError
from bench.captures.reading import read_capture, read_captures
from bench.captures.selection import WHOLE, Selection

__all__ = ["WHOLE", "Capture", "CaptureChannel", "CaptureError", "Selection", "read_capture", "read_captures"]
