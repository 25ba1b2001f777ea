"""Keysight InfiniiVision 3000 and 4000 X-Series oscilloscopes (Programmer's Guide 3000T X-Series)."""

from collections.abc import Iterable, Sequence

from drivers.bases.found_state import WantedSetting
from drivers.bases.scpi_oscilloscope import Acquiring, Codes, Preamble, ScpiOscilloscope
from drivers.bases.set_points import step_up
from drivers.interfaces import AcquisitionType
from drivers.keysight.infiniivision_data import DATA
from drivers.keysight.infiniivision_settings import found_settings
from drivers.keysight.options import INFINIIVISION_IDENTITY

#: Bits of the operation status condition register: running, and armed for the trigger.
RUNNING, ARMED = 1 << 3, 1 << 5


class KeysightInfiniiVision(ScpiOscilloscope):
    """A Keysight InfiniiVision."""

    data, answers = DATA, INFINIIVISION_IDENTITY
    _transfer = (":WAV:FORM WORD", ":WAV:UNS ON", ":WAV:BYT LSBF", ":WAV:POIN:MODE RAW")

    def _wanted(self) -> Iterable[WantedSetting]:
        return found_settings(self._identity.model, self._options.probes)

    def _acquisition_commands(
        self, record_time: float, points: int, pre_trigger: float, acquisition: AcquisitionType
    ) -> Sequence[str]:
        return (
            f":ACQ:TYPE {acquisition.value}",
            ":TIM:MODE MAIN",
            ":TIM:REF CENT",
            f":TIM:RANG {record_time:.9g}",
            # The position is the time from the trigger to the screen's centre.
            f":TIM:POS {(0.5 - pre_trigger) * record_time:.9g}",
        )

    def _state(self) -> Acquiring:
        state = int(self._session.query_number(":OPER:COND?"))
        if not state & RUNNING:
            return Acquiring.DONE
        return Acquiring.ARMED if state & ARMED else Acquiring.FILLING

    def _record(self, channel: int, points: int) -> tuple[Codes, Preamble]:
        # Offered in RAW mode from 100 on (Programmer's Guide, :WAVeform:POINts); the least that suffices.
        self._send((f":WAV:SOUR CHAN{channel}", f":WAV:POIN {step_up(max(points, 100)):.0f}"))
        preamble = self._preamble(":WAV:PRE?", 1, "WORD")
        return self._codes(":WAV:DATA?", "<u2", preamble.points), preamble

    def _measurement(self, what: str, channel: int) -> str:
        return f":MEAS:{what}? CHAN{channel}"
