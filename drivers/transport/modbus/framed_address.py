"""The framing in the address of a serial Modbus line: read, and put in the place of another."""

from urllib.parse import urlencode, urlsplit

from drivers.transport.parameters import parameters_of
from drivers.transport.serial.line_settings import line_settings

_FRAMING = ("baudrate", "bytesize", "parity", "stopbits", "framer")


def framing_of(address: str) -> tuple[int, str, bool]:
    """Return rate (bit/s), form ("8N2") and whether frames are ASCII. Raises ValueError for keys that cannot be."""
    parameters = parameters_of(urlsplit(address).query)
    settings = line_settings({key: value for key, value in parameters.items() if key in _FRAMING})
    return (
        settings.baudrate,
        f"{settings.bytesize}{settings.parity}{settings.stopbits:g}",
        parameters.get("framer") == "ascii",
    )


def framed(address: str, rate: int, form: str, *, in_ascii: bool) -> str:
    """Return an address with another framing; its other keys stay."""
    parts = urlsplit(address)
    others = {key: value for key, value in parameters_of(parts.query).items() if key not in _FRAMING}
    keys = {"baudrate": str(rate), "parity": form[1], "stopbits": form[2:]}
    if form[0] != "8":
        keys["bytesize"] = form[0]
    if in_ascii:
        keys["framer"] = "ascii"
    return f"{parts.scheme}://{parts.path}?{urlencode(keys | others)}"
