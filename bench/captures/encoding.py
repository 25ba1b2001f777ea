"""The encoding of a text file that does not name it."""

import codecs

#: Longest first: the mark of UTF-16 begins that of UTF-32.
_MARKS = (
    (codecs.BOM_UTF32_LE, "utf-32"),
    (codecs.BOM_UTF32_BE, "utf-32"),
    (codecs.BOM_UTF16_LE, "utf-16"),
    (codecs.BOM_UTF16_BE, "utf-16"),
)
#: So many bytes show which of two places the zeros of UTF-16 have.
_SHOWN = 4096


def decoded(raw: bytes) -> str | None:
    """Return the text of a file's bytes; None where they are no text: zeros that belong to no encoding.

    Read are UTF-8, UTF-16 with a mark or without, UTF-32 with a mark, simplified Chinese (GB 2312) and Western (Windows 1252).
    """
    named = next((name for mark, name in _MARKS if raw.startswith(mark)), None) or _unmarked(raw)
    if named is not None:
        content = raw.decode(named, errors="replace")
    else:
        try:
            content = raw.decode("utf-8-sig")
        except UnicodeDecodeError:
            content = _in_old_encoding(raw)
    return None if "\0" in content else content


def _unmarked(raw: bytes) -> str | None:
    """Return the order of the bytes of UTF-16 without a mark: the zeros of its ASCII stand all at odd or all at even places."""
    begin = raw[:_SHOWN]
    low, high = begin[0::2], begin[1::2]
    if high.count(0) > 0.6 * len(high) and not low.count(0):
        return "utf-16-le"
    if low.count(0) > 0.6 * len(low) and not high.count(0):
        return "utf-16-be"
    return None


def _in_old_encoding(raw: bytes) -> str:
    """Return text that is no UTF-8: simplified Chinese where all its high bytes go in its pairs, otherwise Western.

    A Western "µH" or "°" stands alone among letters and signs of ASCII, which no pair of GB 2312 has in it.
    """
    try:
        return raw.decode("gb2312")
    except UnicodeDecodeError:
        return raw.decode("cp1252", errors="replace")
