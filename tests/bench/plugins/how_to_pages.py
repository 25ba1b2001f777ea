"""The code on the how-to pages, and the oscilloscope of another make that it has: a second one of our shared base."""

import re
from pathlib import Path
from typing import Any

from drivers.bases.oscilloscope_data import Probe
from drivers.interfaces import ProbeKind

PAGES = Path(__file__).parents[3] / "docs" / "how-to"
#: The files of the oscilloscope, which has a station of its own.
OSCILLOSCOPE = ("rigol_ds1000z.py", "simulated_rigol_ds1000z.py")
PROBES = {n: Probe(ProbeKind.CURRENT if n == 4 else ProbeKind.VOLTAGE, 10.0) for n in (1, 2, 4)}


def codes(page: str) -> dict[str, str]:
    """The Python files of a page, by the name that stands before each."""
    text = (PAGES / page).read_text(encoding="utf-8")
    return dict(re.findall(r"`(\w+\.py)`:\n\n```python\n(.*?)```", text, re.DOTALL))


def left(simulated: Any) -> None:
    """As somebody before us may have left a Rigol."""
    for message in ("CHAN1:INV ON", "CHAN2:BWL 20M", "CHAN3:DISP ON", "TRIG:COUP HFR", "STOP", "*CLS"):
        simulated.write(message.encode() + b"\n")
