"""Signs that nobody sees in a name: they change what a terminal, a label or a page shows of it."""

import unicodedata

#: Control, format and private signs, halves of pairs, ends of lines and paragraphs.
_HIDDEN = {"Cc", "Cf", "Co", "Cs", "Cn", "Zl", "Zp"}


def hidden_sign(words: str) -> str:
    """Return the first sign of a name that is none to read, as "U+001B"; empty where there is none."""
    return next((f"U+{ord(sign):04X}" for sign in words if unicodedata.category(sign) in _HIDDEN), "")
