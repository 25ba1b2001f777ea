"""Keysight InfiniiVision 3000 and 4000 X-Series oscilloscopes (Programmer's Guide 3000T X-Series)."""

from collections.abc import Iterable, Sequence

from drivers.bases.found_state import WantedSetting
from drivers.bases.scpi_oscilloscope import Acquiring, Codes, Preamble, Probe, ScpiOscilloscope
from drivers.interfaces import AcquisitionType, ChannelSettings, ProbeKind, Trigger
from drivers.keysight.infiniivision_data import DATA
from drivers.keysight.infiniivision_settings import found_settings
from drivers.keysight.options import INFINIIVISION_IDENTITY

#: Bits of the operation status condition register: running, and armed for the trigger.
RUNNING, ARMED = 1 << 3, 1 << 5
UNIT = {ProbeKind.VOLTAGE: "VOLT", ProbeKind.CURRENT: "AMP"}


class KeysightInfiniiVision(ScpiOscilloscope):
    """A Keysight InfiniiVision."""

    data, answers = DATA, INFINIIVISION_IDENTITY
    _transfer = (":WAV:FORM WORD", ":WAV:UNS ON", ":WAV:BYT LSBF", ":WAV:POIN:MODE RAW")

    def _wanted(self) -> Iterable[WantedSetting]:
        return found_settings(self._identity.model, self._options.probes)

    def _channel_commands(self, channel: int, probe: Probe, settings: ChannelSettings) -> Sequence[str]:
        return (
            f":CHAN{channel}:DISP ON",
            f":CHAN{channel}:COUP DC",
            f":CHAN{channel}:UNIT {UNIT[probe.kind]}",
            f":CHAN{channel}:PROB {probe.attenuation:.6g}",
            f":CHAN{channel}:RANG {settings.range:.6g}",
            f":CHAN{channel}:OFFS {settings.offset:.6g}",
        )

    def _full_scale(self, channel: int) -> float:
        return self._number(f":CHAN{channel}:RANG?")

    def _mid_screen(self, channel: int) -> float:
        return self._number(f":CHAN{channel}:OFFS?")

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

    def _trigger_commands(self, trigger: Trigger) -> Sequence[str]:
        if trigger.channel is None:
            return (":TRIG:SWE AUTO",)
        return (
            ":TRIG:MODE EDGE",
            f":TRIG:EDGE:SOUR CHAN{trigger.channel}",
            f":TRIG:EDGE:LEV {trigger.level:.6g}",
            f":TRIG:EDGE:SLOP {trigger.slope.value}",
            ":TRIG:SWE NORM",
        )

    def _state(self) -> Acquiring:
        state = int(self._session.query_number(":OPER:COND?"))
        if not state & RUNNING:
            return Acquiring.DONE
        return Acquiring.ARMED if state & ARMED else Acquiring.FILLING

    def _record(self, channel: int, points: int) -> tuple[Codes, Preamble]:
        self._send((f":WAV:SOUR CHAN{channel}", f":WAV:POIN {_offered_points(points)}"))
        preamble = self._preamble(":WAV:PRE?", 1, "WORD")
        return self._codes(":WAV:DATA?", "<u2", preamble.points), preamble

    def _measurement(self, what: str, channel: int) -> str:
        return f":MEAS:{what}? CHAN{channel}"


def _offered_points(points: int) -> int:
    """Return the smallest record length the instrument offers (1, 2, 5 times a power of ten, from 100) that suffices.

    Source: Programmer's Guide, :WAVeform:POINts in RAW mode.
    """
    decade = 100
    while True:
        for factor in (1, 2, 5):
            if factor * decade >= points:
                return factor * decade
        decade *= 10
