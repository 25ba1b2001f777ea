"""A writer that is killed (-9) at any moment: what it acknowledged is there, and what is referred to as well."""

import hashlib
import subprocess
import sys
from pathlib import Path

import pytest

from bench.journal.events.instruments import WaveformsTaken
from bench.journal.journal import Journal
from bench.journal.journal_file import read_journal
from bench.journal.run_folder import RunFolder
from bench.journal.verification import Integrity
from bench.journal.verify import verify
from tests.journals import event

WRITER = """
import sys
from pathlib import Path
import numpy as np
from bench.journal.disk import Reserve
from bench.journal.events.instruments import Energising, WaveformFile, WaveformsTaken
from bench.journal.journal import Journal
from bench.journal.waveforms import StoredWaveform, WaveformFolder
folder = Path(sys.argv[1])
wave = StoredWaveform(np.arange(5000) * 1e-6, np.sin(np.arange(5000)), "V", 0.01)
journal = Journal(folder / "journal.jsonl", lambda: 0.0, reserve=Reserve(folder / ".reserve"))
waveforms = WaveformFolder(folder / "waveforms")
number = 0
while True:
    stored = waveforms.store("oscilloscope", {"channel1": wave})
    file = WaveformFile(stored.path, stored.sha256, stored.length)
    journal.record(WaveformsTaken(instrument="oscilloscope", call="fetch", file=file, value={}))
    journal.record(Energising(instrument="supply", call="energised"))
    number += 2
    print(number, flush=True)
"""


@pytest.mark.parametrize("acknowledged", [1, 12])
def test_nothing_that_was_acknowledged_is_lost(tmp_path: Path, acknowledged: int) -> None:
    with subprocess.Popen([sys.executable, "-c", WRITER, str(tmp_path)], stdout=subprocess.PIPE, text=True) as process:
        assert process.stdout is not None
        for _ in range(acknowledged):
            process.stdout.readline()
        process.kill()
        told = process.stdout.read().split()
    folder = RunFolder(tmp_path)
    read = read_journal(folder.journal)
    assert len(read.events) >= max(2 * acknowledged, *(int(number) for number in told), 0)
    for recorded in read.events:
        if isinstance(recorded.event, WaveformsTaken):
            content = (tmp_path / recorded.event.file.path).read_bytes()
            assert hashlib.sha256(content).hexdigest() == recorded.event.file.sha256
    found = verify(folder)
    assert (found.verdict, found.findings) == (Integrity.UNFINISHED, [])
    journal = Journal(folder.journal, lambda: 0.0, previous=read)
    journal.record(event("run_finished"))
    journal.close()
    assert read_journal(folder.journal).events[-1].number == len(read.events) + 1
