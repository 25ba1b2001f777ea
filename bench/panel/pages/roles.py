"""Instruments' roles as people call them."""

from collections.abc import Mapping

from procedures.text import Text, text

_NAMES: Mapping[str, Text] = {
    "supply": text("DC supply"),
    "lcr_meter": text("LCR meter"),
    "oscilloscope": text("Oscilloscope"),
    "dynamometer": text("Dynamometer"),
    "tachometer": text("Tachometer"),
    "inverter": text("Inverter"),
    "voltmeter": text("Voltmeter"),
    "drive": text("Six-step drive"),
}


def role_name(role: str) -> Text:
    """Return what people call a role; one that is not known keeps its own name."""
    return _NAMES.get(role, Text("{name}", {"name": role}))
