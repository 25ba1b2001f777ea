"""Null and scaling of the 34461A (Truevolt guide, <function>:NULL and CALCulate:SCALe): what readings go through before they are told."""

from collections.abc import Callable

from sim_instruments.instruments.keysight.dmm_34461a.functions import FUNCTIONS, Function
from sim_instruments.scpi.settings import ScpiSettings

_LARGEST = 1.0e15
_OVERFLOW = 9.9e37


class _Null:
    """The null of one function."""

    def __init__(self, settings: ScpiSettings, function: Function, changed: Callable[[int], None]) -> None:
        self._settings = settings
        self._state, self._value, self._auto = (f"{function.word} null {part}" for part in ("on", "value", "auto"))
        self._pending = False

        def begin(channel: int) -> None:
            self._pending = settings.flag(self._state) and settings.flag(self._auto)
            changed(channel)

        def given(channel: int) -> None:
            settings.put(self._auto, False)
            self._pending = False
            changed(channel)

        header, limit = f"[SENSe]:{function.header}:NULL", function.null_limit
        settings.add_flag(self._state, f"{header}[:STATe]", False, changed=begin)
        settings.add_number(self._value, f"{header}:VALue", -limit, limit, 0.0, unit=function.unit, changed=given)
        settings.add_flag(self._auto, f"{header}:VALue:AUTO", False, changed=begin)

    def disable(self) -> None:
        """Switch the null off."""
        for name in (self._state, self._auto):
            self._settings[name].reset()
        self._pending = False

    def told(self, reading: float) -> float:
        """Return a reading less the null value, which the first reading may be."""
        if self._pending:
            self._settings.put(self._value, reading)
            self._pending = False
        return reading - self._settings.number(self._value) if self._settings.flag(self._state) else reading


class ReadingMath:
    """Readings less their function's null value, then scaled as gain · x + offset or as a percentage of a reference."""

    def __init__(self, settings: ScpiSettings, changed: Callable[[int], None]) -> None:
        self._settings = settings
        self._nulls = {one.word: _Null(settings, one, changed) for one in FUNCTIONS if one.null_limit}
        put = settings
        put.add_flag("scaling", "CALCulate:SCALe[:STATe]", False, changed=changed)
        put.add_choice("scale", "CALCulate:SCALe:FUNCtion", ("SCALe", "PCT"), "SCAL", changed=changed)
        put.add_number("gain", "CALCulate:SCALe:GAIN", -_LARGEST, _LARGEST, 1.0, changed=changed)
        put.add_number("offset", "CALCulate:SCALe:OFFSet", -_LARGEST, _LARGEST, 0.0, changed=changed)
        put.add_number("reference", "CALCulate:SCALe:REFerence", -_LARGEST, _LARGEST, 1.0, changed=changed)

    def disable(self, function: Function) -> None:
        """Switch a function's null and the scaling off, as CONFigure does."""
        if function.word in self._nulls:
            self._nulls[function.word].disable()
        self._settings["scaling"].reset()

    def told(self, function: Function, reading: float) -> float:
        """Return what is told of a function's reading."""
        settings = self._settings
        if function.word in self._nulls:
            reading = self._nulls[function.word].told(reading)
        if not settings.flag("scaling"):
            return reading
        if settings.word("scale") == "PCT":
            reference = settings.number("reference")
            return 100.0 * (reading - reference) / reference if reference else _OVERFLOW
        return settings.number("gain") * reading + settings.number("offset")
