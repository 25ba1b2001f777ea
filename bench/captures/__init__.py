"""Stored captures: a scope maker's CSV, plain CSV, and motorbench's own waveforms."""

from bench.captures.capture import Capture, CaptureError, Channel
from bench.captures.reading import read_capture, read_captures

__all__ = ["Capture", "CaptureError", "Channel", "read_capture", "read_captures"]
