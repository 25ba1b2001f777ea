"""The temperature sensor that the 34461A takes its input for (Truevolt guide, TEMPerature and UNIT)."""

from sim_instruments.instruments.keysight.dmm_34461a.functions import FRES, RES, Function
from sim_instruments.instruments.keysight.dmm_34461a.temperature import NONE, rtd_temperature, thermistor_temperature
from sim_instruments.scpi.errors import ScpiError
from sim_instruments.scpi.lexer import Argument
from sim_instruments.scpi.parameters import choice, choices, exactly, number
from sim_instruments.scpi.settings import ScpiSettings

_KINDS = ("FRTD", "RTD", "FTHermistor", "THERmistor")
_TYPES = {"FRTD": 85, "RTD": 85, "FTH": 5000, "THER": 5000}
_FOUR_WIRE = ("FRTD", "FTH")


class TemperatureSensor:
    """A platinum sensor by default, with four wires and 100 Ω at 0 °C, or a thermistor of 5 kΩ."""

    def __init__(self, settings: ScpiSettings) -> None:
        self._settings = settings
        header = "[SENSe]:TEMPerature:TRANsducer"
        settings.add_choice("sensor", f"{header}:TYPE", _KINDS, "FRTD")
        for kind in _KINDS:
            short = choices((kind,))[kind.upper()]
            settings.add_integer(f"{short} type", f"{header}:{kind}:TYPE", _TYPES[short], _TYPES[short], _TYPES[short])
        for kind in ("FRTD", "RTD"):
            settings.add_number(f"{kind} at zero", f"{header}:{kind}:RESistance[:REFerence]", 49.0, 2100.0, 100.0)
        settings.add_choice("temperature unit", "UNIT:TEMPerature", ("C", "F", "K"), "C")

    def configure(self, arguments: tuple[Argument, ...]) -> None:
        """Take CONFigure's data elements: kind, type, 1 and a resolution that is DEFault. Raises ScpiError."""
        exactly(arguments, 0, 4)
        words = [one.kind == "word" and one.text in ("DEF", "DEFAULT") for one in arguments]
        kind = "FRTD" if not arguments or words[0] else choice(arguments[0], choices(_KINDS))
        if len(arguments) > 1 and not words[1]:
            number(arguments[1], _TYPES[kind], _TYPES[kind])
        if len(arguments) > 2:
            number(arguments[2], 1.0, 1.0)
        if len(arguments) > 3 and not words[3]:
            raise ScpiError(-224)
        self._settings.put("sensor", kind)

    @property
    def wires(self) -> Function:
        """The resistance function that its resistance is measured by."""
        return FRES if self._settings.word("sensor") in _FOUR_WIRE else RES

    def temperature(self, resistance: float) -> float:
        """Return the temperature, in the unit set, of a resistance (Ω); 9.9E37 for one that the sensor never has."""
        kind = self._settings.word("sensor")
        if kind in ("FRTD", "RTD"):
            celsius = rtd_temperature(resistance, self._settings.number(f"{kind} at zero"))
        else:
            celsius = thermistor_temperature(resistance)
        if celsius == NONE:
            return celsius
        unit = self._settings.word("temperature unit")
        return {"C": celsius, "F": 1.8 * celsius + 32.0, "K": celsius + 273.15}[unit]
