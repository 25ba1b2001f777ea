"""Settings of the E4980A that alter or withhold its readings until somebody turns them off (user's guide, SCPI command reference)."""

import cmath
import math

from sim_instruments.instruments.keysight.e4980a.parameters import OVERFLOW
from sim_instruments.scpi.errors import ScpiError
from sim_instruments.scpi.parameters import exactly, number
from sim_instruments.scpi.settings import ScpiSettings
from sim_instruments.scpi.tree import Call, CommandTree, bare

_CABLES = (0.0, 1.0, 2.0, 4.0)
#: Speed of a wave in the cable (m/s); the bench's leads have no length of their own.
_SPEED = 2.0e8
_BIAS = 2.0


class DeviationMode:
    """FUNCtion:DEV1 and :DEV2: readings as deviations from a reference, absolute or in percent."""

    def __init__(self, settings: ScpiSettings) -> None:
        self._settings = settings
        modes = ("OFF", "ABSolute", "PERCent")
        settings.add_choice("deviation", "FUNCtion:DEV<n>:MODE", modes, "OFF", count=2)
        settings.add_number("reference", "FUNCtion:DEV<n>:REFerence[:VALue]", -1.0e15, 1.0e15, 0.0, count=2)

    def shown(self, values: tuple[float, float]) -> tuple[float, float]:
        """Return a pair of readings as the bridge shows them."""
        return self._one(1, values[0]), self._one(2, values[1])

    def _one(self, which: int, value: float) -> float:
        mode, reference = self._settings.word("deviation", which), self._settings.number("reference", which)
        if mode == "OFF" or abs(value) == OVERFLOW:
            return value
        if mode == "ABS":
            return value - reference
        return OVERFLOW if reference == 0.0 else 100.0 * (value - reference) / reference


class CableLength:
    """CORRection:LENGth: 0, 1, 2 or 4 m. A length that is not the leads' turns the phase of what is measured."""

    def __init__(self, tree: CommandTree) -> None:
        self.metres = 0.0
        tree.add("CORRection:LENGth", command=self._set, query=bare(lambda: f"{self.metres:+.0f}"))

    def reset(self) -> None:
        """Return to no cable."""
        self.metres = 0.0

    def turned(self, impedance: complex, frequency: float) -> complex:
        """Return an impedance (Ω) as corrected for a cable that is not there."""
        return impedance * cmath.exp(2j * math.pi * frequency * self.metres / _SPEED)

    def _set(self, call: Call) -> None:
        exactly(call.arguments, 1)
        wanted = number(call.arguments[0], 0.0, _CABLES[-1])
        if wanted not in _CABLES:
            raise ScpiError(-224)
        self.metres = wanted


def add_bias(settings: ScpiSettings, fitted: bool) -> None:
    """Add BIAS:STATe and BIAS:VOLTage; without its option the bias cannot be switched on."""

    def check(_: int) -> None:
        if settings.flag("bias") and not fitted:
            settings.put("bias", False)
            raise ScpiError(-241)

    settings.add_flag("bias", "BIAS:STATe", False, changed=check)
    settings.add_number("bias_voltage", "BIAS:VOLTage[:LEVel]", -_BIAS, _BIAS, 0.0, unit="V")
