"""Null and scaling of the 34461A (Truevolt guide, VOLTage:NULL and CALCulate:SCALe): what readings go through before they are told."""

from collections.abc import Callable

from sim_instruments.scpi.settings import ScpiSettings

_LARGEST = 1.0e15


class ReadingMath:
    """Readings less a null value, then scaled as gain · x + offset or as a percentage of a reference."""

    def __init__(self, settings: ScpiSettings, changed: Callable[[int], None]) -> None:
        self._settings = settings
        self._pending = False

        def begin(channel: int) -> None:
            self._pending = settings.flag("null") and settings.flag("null_auto")
            changed(channel)

        def given(channel: int) -> None:
            settings.put("null_auto", False)
            self._pending = False
            changed(channel)

        put, null = settings, "[SENSe]:VOLTage[:DC]:NULL"
        put.add_flag("null", f"{null}:STATe", False, changed=begin)
        put.add_number("null_value", f"{null}:VALue", -1200.0, 1200.0, 0.0, unit="V", changed=given)
        put.add_flag("null_auto", f"{null}:VALue:AUTO", False, changed=begin)
        put.add_flag("scaling", "CALCulate:SCALe[:STATe]", False, changed=changed)
        put.add_choice("scale", "CALCulate:SCALe:FUNCtion", ("SCALe", "PCT"), "SCAL", changed=changed)
        put.add_number("gain", "CALCulate:SCALe:GAIN", -_LARGEST, _LARGEST, 1.0, changed=changed)
        put.add_number("offset", "CALCulate:SCALe:OFFSet", -_LARGEST, _LARGEST, 0.0, changed=changed)
        put.add_number("reference", "CALCulate:SCALe:REFerence", -_LARGEST, _LARGEST, 1.0, changed=changed)

    def disable(self) -> None:
        """Switch null and scaling off, as CONFigure does."""
        for name in ("null", "null_auto", "scaling"):
            self._settings[name].reset()
        self._pending = False

    def told(self, reading: float) -> float:
        """Return what is told of a reading (V)."""
        settings = self._settings
        if self._pending:
            settings.put("null_value", reading)
            self._pending = False
        if settings.flag("null"):
            reading -= settings.number("null_value")
        if not settings.flag("scaling"):
            return reading
        if settings.word("scale") == "PCT":
            reference = settings.number("reference")
            return 100.0 * (reading - reference) / reference if reference else 9.9e37
        return settings.number("gain") * reading + settings.number("offset")
