"""The list of a station's calibrations as it is printed."""

import sys
from collections.abc import Sequence

from bench.run.console import console_on
from bench.station.calibration_list import CalibrationDue
from drivers.interfaces.text import Translate, text


def print_due(due: Sequence[CalibrationDue], translate: Translate) -> None:
    """Print when each instrument is due for calibration, soonest first."""
    console = console_on(sys.stdout)
    console.print(text("Calibrations, soonest first").render(translate), markup=False)
    for each in due:
        mark = "–" if each.calibration is None else "!" if each.pressing else "✓"
        console.print(f"  {mark} {each.words.render(translate)}", markup=False, soft_wrap=True)
