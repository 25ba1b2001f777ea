"""Wires' colours as people name them."""

#: Names of IEC 60757 and those in common use, to CSS colours that print apart.
_COLOURS = {
    "black": "#1a1a1a",
    "bk": "#1a1a1a",
    "brown": "#7a4a21",
    "bn": "#7a4a21",
    "red": "#d32f2f",
    "rd": "#d32f2f",
    "orange": "#f57c00",
    "og": "#f57c00",
    "yellow": "#fbc02d",
    "ye": "#fbc02d",
    "green": "#2e7d32",
    "gn": "#2e7d32",
    "blue": "#1565c0",
    "bu": "#1565c0",
    "violet": "#7b1fa2",
    "purple": "#7b1fa2",
    "vt": "#7b1fa2",
    "grey": "#8a8a8a",
    "gray": "#8a8a8a",
    "gy": "#8a8a8a",
    "white": "#ffffff",
    "wh": "#ffffff",
    "pink": "#ec87b0",
    "pk": "#ec87b0",
    "turquoise": "#26a6a6",
    "tq": "#26a6a6",
}
#: A wire whose colour is not known.
UNKNOWN = "#607d8b"


def css_colour(name: str) -> str:
    """Return the CSS colour of a wire's colour name, English or an IEC 60757 code; UNKNOWN for another word."""
    return _COLOURS.get(name.strip().lower(), UNKNOWN)
