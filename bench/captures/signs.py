"""Signs of numbers as spreadsheets and other scripts write them: minus signs, full-width forms, thousands apart by blanks."""

import re

from bench.files.full_width import PLAIN

#: Minus signs, hyphens and dashes that stand before a number.
_MINUS = re.compile(r"[\u2010-\u2013\u2212\ufe63](?=[\d.,])")
#: Blanks and apostrophes that are between groups of three digits, and are no separator of columns.
_GROUPS = re.compile(r"(?<![\w.,])(-?[1-9]\d{0,2})((?:[\u00a0\u2007\u2009\u202f'\u2019]\d{3})+)(?![\w'\u2019])")
_BLANK_GROUPS = re.compile(r"([+-]?[1-9]\d{0,2}(?: \d{3})+)([.,]\d*)?")
_NO_DIGIT = re.compile(r"[^\d-]")


def plain_signs(content: str) -> str:
    """Return text with the minus sign, the digits and the separators of ASCII, and without the marks between thousands that can be nothing
    else: non-breaking and thin blanks, apostrophes.
    """
    if not content.isascii():
        content = _MINUS.sub("-", content.translate(PLAIN))
    elif "'" not in content:
        return content
    return _GROUPS.sub(lambda match: match[1] + _NO_DIGIT.sub("", match[2]), content)


def without_blanks(cell: str) -> str:
    """Return a cell without the blanks between its thousands, as in "12 345,6"; any other cell as it is.

    Only for cells that something else than a blank separates.
    """
    match = _BLANK_GROUPS.fullmatch(cell.strip())
    return cell if match is None else match[1].replace(" ", "") + (match[2] or "")
