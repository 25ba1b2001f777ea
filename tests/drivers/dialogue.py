"""Recordings of instruments as dialogues: their answers for a driver under test, and what it must have sent in the end."""

from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path

import pyvisa

from bench.traffic.recorder import TrafficRecorder
from bench.traffic.sessions import session_of
from bench.traffic.traffic_file import read_recording
from drivers.catalogue import Surroundings
from drivers.interfaces import Clock
from sim_instruments.clock.virtual_clock import VirtualClock
from sim_instruments.recorded.bench import RecordedBench

DIALOGUES = Path(__file__).parent / "dialogues"


@contextmanager
def played(name: str, clock: Clock) -> Iterator[tuple[Surroundings, str]]:
    """Give surroundings in which the one instrument of a recording answers, and its address; all must be sent that was recorded."""
    recording = read_recording(DIALOGUES / f"{name}.traffic")
    (role,) = recording.carriers
    bench = RecordedBench({role.value: session_of(recording, role, tolerant=False)}, VirtualClock())
    recorder = TrafficRecorder(clock.now)
    manager = pyvisa.ResourceManager(bench.visa_library)
    try:
        yield Surroundings(clock, lambda: manager, wire=recorder.wire(role)), bench.address(role.value)
    finally:
        bench.close()
    recorded, sent = (
        [line.content for line in lines if line.kind in ">~"] for lines in (recording.lines, recorder.lines(role))
    )
    assert sent == recorded
