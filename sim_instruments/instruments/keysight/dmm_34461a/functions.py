"""Measurements of the 34461A: functions, ranges and limits of error (5991-1983EN, Truevolt operating and service guide)."""

from dataclasses import dataclass
from typing import Literal

from sim_instruments.instruments.errors import VoltmeterErrors
from sim_instruments.scpi.parameters import forms

#: What a function's reading is made of: an integral over power-line cycles, the RMS of what is left without its mean, or its crossings.
Kind = Literal["integral", "rms", "count"]
_HEALTHY_LIMIT = 3.5e-5


@dataclass(frozen=True)
class Function:
    """One measuring function. `word` is what FUNCtion? replies, `header` that of SENSe, both MEASure's and CONFigure's, too.

    `limits` are the one-year limits of error by range, of the reading and of the range; one pair stands for all ranges.
    `zeroed` says that autozero can be switched, `fixed` that no range can be set, `null_limit` how far a null value goes, 0 where
    there is none. `highest_share` is how far beyond the highest range a reading goes.
    """

    word: str
    header: str
    unit: str
    kind: Kind
    ranges: tuple[float, ...]
    preset: float
    limits: tuple[tuple[float, float], ...] = ()
    zeroed: bool = False
    fixed: bool = False
    null_limit: float = 0.0
    highest_share: float = 1.2

    def names(self) -> frozenset[str]:
        """Return what FUNCtion takes for it, in upper case."""
        names = [""]
        for mnemonic in self.header.replace("[:", ":[").split(":"):
            optional = mnemonic.startswith("[")
            spelt = [f"{name}:{form}" for name in names for form in forms(mnemonic.strip("[]"))]
            names = [*spelt, *(names if optional else ())]
        return frozenset(name.removeprefix(":") for name in names)

    def errors(self, index: int, unit: VoltmeterErrors) -> tuple[float, float]:
        """Return a unit's errors in a range, of the reading and of the range: as far within the limits as its 10 V range."""
        if self.word == "VOLT":
            return unit.gain[index], unit.offset[index]
        gain, offset = self.limits[min(index, len(self.limits) - 1)]
        share = unit.gain[2] / _HEALTHY_LIMIT
        return share * gain, share * offset


_OHMS = (1.0e2, 1.0e3, 1.0e4, 1.0e5, 1.0e6, 1.0e7, 1.0e8)
_OHM_LIMITS = (
    (1.0e-4, 4.0e-5),
    (1.0e-4, 1.0e-5),
    (1.0e-4, 1.0e-5),
    (1.0e-4, 1.0e-5),
    (1.0e-4, 1.0e-5),
    (4.0e-4, 1.0e-5),
    (8.0e-3, 1.0e-4),
)
#: Test currents (A) of the resistance ranges.
TEST_CURRENTS = (1.0e-3, 1.0e-3, 1.0e-4, 1.0e-5, 5.0e-6, 5.0e-7, 5.0e-7)
_VOLTS = (0.1, 1.0, 10.0, 100.0, 1000.0)
_AC_VOLTS = (0.1, 1.0, 10.0, 100.0, 750.0)
# The last one has terminals of its own.
_AMPERES = (1.0e-4, 1.0e-3, 1.0e-2, 0.1, 1.0, 3.0, 10.0)

VOLT_DC = Function(
    "VOLT", "VOLTage[:DC]", "V", "integral", _VOLTS, 10.0, zeroed=True, null_limit=1.2e3, highest_share=1.0
)
VOLT_AC = Function(
    "VOLT:AC", "VOLTage:AC", "V", "rms", _AC_VOLTS, 10.0, ((6.0e-4, 3.0e-4),), null_limit=1.2e3, highest_share=1.0
)
CURR_DC = Function(
    "CURR", "CURRent[:DC]", "A", "integral", _AMPERES, 0.1, ((5.0e-4, 2.0e-4),), zeroed=True, null_limit=12.0
)
CURR_AC = Function("CURR:AC", "CURRent:AC", "A", "rms", _AMPERES, 0.1, ((1.0e-3, 4.0e-4),), null_limit=12.0)
RES = Function("RES", "RESistance", "OHM", "integral", _OHMS, 1.0e3, _OHM_LIMITS, zeroed=True, null_limit=1.2e8)
FRES = Function("FRES", "FRESistance", "OHM", "integral", _OHMS, 1.0e3, _OHM_LIMITS, null_limit=1.2e8)
# A resistance told as a temperature; it chooses its range by itself.
TEMP = Function(
    "TEMP", "TEMPerature", "", "integral", _OHMS, 1.0e3, _OHM_LIMITS, zeroed=True, fixed=True, null_limit=1.0e15
)
# Their ranges are those of the voltage that is counted.
FREQ = Function("FREQ", "FREQuency", "HZ", "count", _AC_VOLTS, 10.0, ((1.0e-4, 0.0),), null_limit=1.2e6)
PER = Function("PER", "PERiod", "S", "count", _AC_VOLTS, 10.0, ((1.0e-4, 0.0),), null_limit=1.2)
CONT = Function("CONT", "CONTinuity", "OHM", "integral", (1.0e3,), 1.0e3, ((1.0e-4, 2.0e-4),), fixed=True)
DIOD = Function("DIOD", "DIODe", "V", "integral", (10.0,), 10.0, ((1.0e-4, 2.0e-4),), fixed=True, highest_share=0.5)

FUNCTIONS = (VOLT_DC, VOLT_AC, CURR_DC, CURR_AC, RES, FRES, TEMP, FREQ, PER, CONT, DIOD)
#: What the maker's 34461A has not, or this one does not serve: told to measure it, it measures nothing.
REFUSED = ("VOLTage[:DC]:RATio", "CAPacitance")
