"""The approximate width of words, to keep room for them."""

#: Widths of Noto Sans' letters over the size; rounded up.
_NARROW, _USUAL, _CAPITAL, _BROAD, _FULL = 0.36, 0.63, 0.72, 0.96, 1.0
_BOLD = 1.07
#: Longer words of a user's own file are cut in the drawing; its description has them whole.
_LONGEST = 24
#: Chinese characters and their punctuation are as wide as they are high.
_CHINESE = 0x2E80


def width_of(words: str, size: float, *, bold: bool = False) -> float:
    """Return the width of a line of words of a given size, never less than Noto Sans sets it."""
    return size * (_BOLD if bold else 1.0) * sum(_letter(letter) for letter in words)


def shortened(words: str) -> str:
    """Return words that have room; too long ones end in an ellipsis."""
    return words if len(words) <= _LONGEST else words[: _LONGEST - 1] + "…"


def _letter(letter: str) -> float:
    if ord(letter) >= _CHINESE:
        return _FULL
    if letter in " iIjl.,:;'|!()[]/-rft":
        return _NARROW if letter not in "rft" else 0.42
    if letter in "mwMW%@—…→Ω":
        return _BROAD
    return _CAPITAL if letter.isupper() else _USUAL
